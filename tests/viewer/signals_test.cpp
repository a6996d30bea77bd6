// `dtr view` ends on signals, as if its window were closed.
#include <fcntl.h>

#include <chrono>
#include <thread>

#include "tests/viewer/viewer_window.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = ViewerWindow::Json;
using ::testing::HasSubstr;

// CPU seconds of all threads, since other tests run beside this one: what is drawn when the signal
// comes.
constexpr double kSoonCpuS = 4;
constexpr char kLine[] = "dtr: interrupted; the same command starts from the beginning\n";

class ViewerSignals : public ViewerWindow {
 protected:
  /// Sends the signal and expects exit code 1, soon, and the line.
  void ExpectEnd(ViewerProgram& viewer, int signal) {
    const ViewerProgram::End end = viewer.EndBy(signal);
    EXPECT_EQ(end.code, kFailed);
    EXPECT_LT(end.cpu_s, kSoonCpuS);
    EXPECT_THAT(Text(In("stderr")), HasSubstr(kLine));
  }
  /// Standard error goes into a file until the end of the test.
  void CatchErrors() {
    saved_ = dup(STDERR_FILENO);
    const int file = open(In("stderr").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    ASSERT_GE(file, 0);
    dup2(file, STDERR_FILENO);
    close(file);
  }
  void TearDown() override {
    if (saved_ >= 0) dup2(saved_, STDERR_FILENO);
    if (saved_ >= 0) close(saved_);
  }

 private:
  int saved_ = -1;
};

TEST_F(ViewerSignals, AWindowThatShowsItsImageCloses) {
  NeedDisplay();
  if (IsSkipped()) return;
  CatchErrors();
  for (const int signal : {SIGINT, SIGTERM}) {
    const TemporaryFolder folder;
    ViewerProgram viewer(Set(), folder.path(), {"--size", "320x240"});
    viewer.WaitFor("the first image", Anything);
    ExpectEnd(viewer, signal);
  }
}

// At any moment: while libraries are loaded, the set is read, the first image is drawn.
TEST_F(ViewerSignals, AWindowThatIsNotThereYetEnds) {
  NeedDisplay();
  if (IsSkipped()) return;
  CatchErrors();
  for (const int wait_ms : {200, 400, 800, 1600}) {
    const TemporaryFolder folder;
    ViewerProgram viewer(Set(), folder.path(), {"--size", "320x240"});
    std::this_thread::sleep_for(std::chrono::milliseconds(wait_ms));
    const ViewerProgram::End end = viewer.EndBy(SIGTERM);
    // Before the program has a handler, the signal itself ends it.
    EXPECT_THAT(end.code, ::testing::AnyOf(kFailed, -1)) << wait_ms;
    EXPECT_LT(end.cpu_s, kSoonCpuS) << wait_ms;
  }
}

// A view whose file never comes: a pipe would keep its reader waiting; a large photo does it for
// seconds. Here the images of two passes take long to draw in software.
TEST_F(ViewerSignals, AWindowThatDrawsForLongEnds) {
  NeedDisplay();
  if (IsSkipped()) return;
  CatchErrors();
  ViewerProgram viewer(Set(), folder_.path(),
                       {"--size", "1200x760", "--renderer", "gl", "--method", "two-pass",
                        "--fly-through", "100000", "--largest-divisor", "1"});
  std::this_thread::sleep_for(std::chrono::seconds(3));
  ExpectEnd(viewer, SIGINT);
}

TEST_F(ViewerSignals, AVideoThatIsBeingRecordedLeavesNothingBehind) {
  NeedDisplay();
  if (IsSkipped()) return;
  if (FindProgram("ffmpeg").empty()) GTEST_SKIP() << "ffmpeg is missing";
  CatchErrors();
  fs::create_directory(folder_ / "saved");
  ViewerProgram viewer(Set(), folder_.path(), {"--size", "320x240", "--no-panel"},
                       folder_ / "saved");
  viewer.WaitFor("the first image", Anything);
  ViewerProgram::Do({"mousemove", "150", "120", "key", "k"});
  viewer.WaitFor("a camera of a path", [](const Json& s) { return s["path_keys"] == 1; });
  ViewerProgram::Do({"key", "Right"});
  viewer.WaitFor("the next view", [](const Json& s) { return s["at_view"] == "0004.jpg"; });
  ViewerProgram::Do({"key", "k"});
  viewer.WaitFor("a path", [](const Json& s) { return s["path_keys"] == 2; });
  const auto before = Contents(folder_ / "saved");
  ViewerProgram::Do({"key", "r"});
  viewer.WaitFor("a recording", [](const Json& s) { return s["recording"].get<bool>(); });
  ExpectEnd(viewer, SIGTERM);
  EXPECT_EQ(Contents(folder_ / "saved"), before);
  EXPECT_THAT(Text(In("stderr")), HasSubstr("not recorded: interrupted"));
}

}  // namespace
}  // namespace dtr::testing
