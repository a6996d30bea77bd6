// Limits that the system sets: threads, sizes of files; a terminal that is lost.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include "tests/cli/courtyard_and_set.h"
#include "tests/cli/failing_calls.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::IsEmpty;

class Limits : public CourtyardAndSet {
 protected:
  // As little work as every stage can be made of.
  std::vector<std::string> Build(const std::string& run) const {
    fs::create_directories(folder_ / run);
    return {"build",
            Photos(),
            "--poses",
            Shared("courtyard/sparse"),
            "-o",
            In(run + "/set.dtr"),
            "--max-size",
            "96",
            "--neighbours",
            "2",
            "--pass-neighbours",
            "2",
            "--iterations",
            "1",
            "--passes",
            "1",
            "--threads",
            "8"};
  }
};

TEST_F(Limits, WithoutThreadsItGoesOnWithThoseThereAre) {
  DTR_REQUIRE_FAILING_CALLS();
  DtrOk(Build("undisturbed"));
  const std::vector<std::string> render = {
      "render", Shared("good.dtr"), "--fly-through", "2", "--renderer", "cpu", "--threads", "8",
      "-o"};
  const auto frames = [&](const std::string& name) {
    std::vector<std::string> words = render;
    words.push_back(In(name));
    return words;
  };
  DtrOk(frames("undisturbed-frames"));
  for (const int threads : {0, 1, 3}) {
    const std::string name = std::to_string(threads);
    const Ran built = DtrWithFailingCalls("DTR_TEST_THREADS", threads, Build(name));
    ASSERT_EQ(built.code, 0) << built.err;
    EXPECT_THAT(DifferingFiles(Contents(folder_ / "undisturbed/set.dtr"),
                               Contents(folder_ / name / "set.dtr")),
                IsEmpty());
    const Ran drawn = DtrWithFailingCalls("DTR_TEST_THREADS", threads, frames(name + "-frames"));
    ASSERT_EQ(drawn.code, 0) << drawn.err;
    EXPECT_THAT(DifferingFiles(Contents(folder_ / "undisturbed-frames"),
                               Contents(folder_ / (name + "-frames"))),
                IsEmpty());
  }
}

TEST_F(Limits, AFileThatMayNotGrowIsOneLine) {
  constexpr rlim_t kBytes = 20 << 10;
  rlimit before;
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  rlimit small = before;
  small.rlim_cur = kBytes;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const Ran exported = DtrByItself({"export", Shared("good.dtr"), "-o", In("cloud.ply")});
  const Ran built = DtrByItself(Build("a"));
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  ExpectRejected(exported, kFailed, "File too large");
  for (const auto& [file, content] : Contents(folder_ / "a")) {
    EXPECT_EQ(file.find(".tmp"), std::string::npos) << file;
  }
  ExpectRejected(built, kFailed, "File too large");
  EXPECT_FALSE(fs::exists(In("cloud.ply")));
  DtrOk(Build("a"));
  DtrOk(Build("undisturbed"));
  EXPECT_THAT(
      DifferingFiles(Contents(folder_ / "undisturbed/set.dtr"), Contents(folder_ / "a/set.dtr")),
      IsEmpty());
}

TEST_F(Limits, ALostTerminalInterruptsUnlessItIsIgnored) {
  const auto begun = [&] { return fs::exists(In("a/set.dtr.partial/work")); };
  ExpectRejected(Dtr(Build("a"), {SIGHUP, begun}), kFailed,
                 "interrupted; what was finished is saved, the same command continues");
  signal(SIGHUP, SIG_IGN);  // as nohup does
  const Ran ran = Dtr(Build("a"), {SIGHUP, begun});
  signal(SIGHUP, SIG_DFL);
  EXPECT_EQ(ran.signal, 0);
  EXPECT_EQ(ran.code, 0) << ran.err;
}

}  // namespace
}  // namespace dtr::testing
