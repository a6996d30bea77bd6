// The same photos, poses and options give the same bytes: for any number of threads, and however
// often the work was cut off on the way.
#include <gtest/gtest.h>
#include <signal.h>

#include <nlohmann/json.hpp>

#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using ::testing::IsEmpty;

class Building : public ::testing::Test {
 protected:
  void SetUp() override { MakeSmallCourtyard(folder_.path() / "courtyard"); }
  // A set called set.dtr in a folder of its own: the report's title is the set's name.
  fs::path Set(const std::string& run) const {
    fs::create_directories(folder_ / run);
    return folder_ / run / "set.dtr";
  }
  std::vector<std::string> Arguments(const fs::path& set, const std::string& threads = "1") const {
    const fs::path courtyard = folder_ / "courtyard";
    return {"build",     (courtyard / "images").string(),
            "-o",        set.string(),
            "--poses",   (courtyard / "sparse").string(),
            "--holdout", "every:2",
            "--threads", threads};
  }
  TemporaryFolder folder_;
};

TEST_F(Building, SetsPicturesAndScoresDoNotDependOnTheNumberOfThreads) {
  for (const std::string threads : {"1", "2"}) {
    const std::string set = Set(threads).string();
    DtrOk(Arguments(set, threads));
    const fs::path out = folder_ / ("pictures" + threads);
    fs::create_directories(out);
    DtrOk({"render", set, "--renderer", "cpu", "--like", "0000", "-o", (out / "like.png").string(),
           "--depth-out", (out / "depth.exr").string(), "--coverage-out",
           (out / "seen.png").string(), "--threads", threads});
    DtrOk({"render", set, "--renderer", "cpu", "--fly-through", "3", "-o", (out / "path").string(),
           "--primitive", "splat", "--fill-holes", "--threads", threads});
    DtrOk({"evaluate", set, "--renderer", "cpu", "--threads", threads, "--json",
           (folder_ / ("scores" + threads)).string()});
  }
  EXPECT_THAT(DifferingFiles(Contents(Set("1")), Contents(Set("2"))), IsEmpty());
  const auto pictures = Contents(folder_ / "pictures1");
  EXPECT_EQ(pictures.size(), 6u);
  EXPECT_THAT(DifferingFiles(pictures, Contents(folder_ / "pictures2")), IsEmpty());
  Json scores[2] = {Json::parse(Text(folder_ / "scores1")), Json::parse(Text(folder_ / "scores2"))};
  for (Json& score : scores) {
    for (Json& view : score["views"]) view.erase("render_ms");
    score["mean"].erase("render_ms");
  }
  EXPECT_EQ(scores[0], scores[1]);
}

TEST_F(Building, ARunThatWasCutOffAnywhereIsFinishedToTheSameBytes) {
  DtrOk(Arguments(Set("undisturbed")));
  const auto expected = Contents(Set("undisturbed"));
  struct Cut {
    const char* folder;  // the signal comes when this folder of the partial set has `files` files
    int files, signal;
  };
  int interrupted = 0, run = 0;
  for (const Cut& cut :
       {Cut{"work", 1, SIGTERM}, Cut{"images", 2, SIGKILL}, Cut{"depth", 2, SIGKILL}}) {
    const fs::path set = Set("cut" + std::to_string(run++));
    const fs::path watched = set.string() + ".partial/" + cut.folder;
    const Ran first =
        Dtr(Arguments(set), {cut.signal, [&] { return FilesIn(watched) >= cut.files; }});
    if (first.signal == 0 && first.code == 0) continue;  // it was faster than the signal
    ++interrupted;
    EXPECT_FALSE(fs::exists(set));
    if (cut.signal == SIGTERM) ExpectRejected(first, 1, "interrupted; what was finished is saved");
    DtrOk(Arguments(set, "2"));
    EXPECT_THAT(DifferingFiles(expected, Contents(set)), IsEmpty()) << cut.folder << cut.files;
    EXPECT_FALSE(fs::exists(set.string() + ".partial"));
  }
  EXPECT_GE(interrupted, 2) << "the runs are too short to be cut off";
}

TEST_F(Building, OtherInputsOrOptionsNeverContinueAnInterruptedRun) {
  const fs::path set = Set("other");
  const fs::path images = set.string() + ".partial/images";
  const Ran cut = Dtr(Arguments(set), {SIGKILL, [&] { return FilesIn(images) >= 1; }});
  ASSERT_EQ(cut.signal, SIGKILL);
  const auto left = Contents(set.string() + ".partial");
  std::vector<std::string> other = Arguments(set);
  other.insert(other.end(), {"--seed", "7"});
  ExpectRejected(Dtr(other), 2, "expected work of the same inputs and options, found others");
  ChangePhoto(folder_ / "courtyard/images/0000.jpg");  // held out, and still an input
  ExpectRejected(Dtr(Arguments(set)), 2,
                 "expected work of the same inputs and options, found others");
  EXPECT_THAT(DifferingFiles(left, Contents(set.string() + ".partial")), IsEmpty());
}

}  // namespace
}  // namespace dtr::testing
