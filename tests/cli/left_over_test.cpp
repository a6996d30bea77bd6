// Commands that are killed at work: the same command leaves nothing but its result.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>

#include "calib/colmap/model_io.h"
#include "dtr/base/process.h"
#include "dtr/io/run_record.h"
#include "tests/cli/courtyard_and_set.h"
#include "tests/cli/failing_calls.h"
#include "tests/cli/fake_sfm.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

class LeftOver : public CourtyardAndSet {
 protected:
  static std::vector<std::string> NamesIn(const fs::path& folder) {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder)) {
      names.push_back(entry.path().filename().string());
    }
    return names;
  }
  // Kills runs until one was hit after `begun`: a fast one may be over before that is seen.
  void Kill(const std::vector<std::string>& words, const std::function<bool()>& begun) {
    constexpr int kMaxTries = 50;
    for (int i = 0; i < kMaxTries; ++i) {
      const Ran ran = Dtr(words, {SIGKILL, begun});
      if (ran.signal == SIGKILL) return;
      ASSERT_EQ(ran.code, 0) << ran.err;
      for (const auto& entry : fs::directory_iterator(work_)) fs::remove_all(entry.path());
    }
    FAIL() << "never killed at work";
  }
  void SetUp() override { fs::create_directories(work_); }
  std::string Work(const std::string& name) const { return (work_ / name).string(); }

  const fs::path work_ = folder_ / "work";
};

TEST_F(LeftOver, AVideosFrames) {
  if (FindProgram("ffmpeg").empty()) GTEST_SKIP() << "SKIPPED: ffmpeg is absent";
  const std::vector<std::string> render{"render", Shared("good.dtr"), "--fly-through",
                                        "24",     "--renderer",       "cpu",
                                        "-o",     Work("path.mp4")};
  const fs::path frames = Work("path.mp4.partial");
  // While images are drawn, and while they are encoded.
  Kill(render, [&] { return FilesIn(frames) >= 4; });
  EXPECT_GE(FilesIn(frames), 4);
  Kill(render, [&] { return fs::exists(frames / "video.mp4"); });
  EXPECT_THAT(NamesIn(work_), ElementsAre("path.mp4.partial"));
  DtrOk(render);
  EXPECT_THAT(NamesIn(work_), ElementsAre("path.mp4"));
}

TEST_F(LeftOver, AnExportHalfWritten) {
  const std::vector<std::string> exporting{"export", Shared("good.dtr"), "-o", Work("out")};
  Kill(exporting, [&] { return FilesIn(Work("out.partial/images")) >= 1; });
  EXPECT_THAT(NamesIn(work_), ElementsAre("out.partial"));
  DtrOk(exporting);
  EXPECT_THAT(NamesIn(work_), ElementsAre("out"));
  EXPECT_EQ(FilesIn(work_ / "out"), 1);  // dtr-export.json: no mark of unfinished work
}

// Before each of its first renames and deletions, then before every third.
TEST_F(LeftOver, ResultsOfCommandsKilledAtRenamesAndDeletions) {
  DTR_REQUIRE_FAILING_CALLS();
  constexpr int kEveryCall = 12;
  const std::vector<std::string> making{"dataset", "make", "courtyard", "--views", "2",
                                        "--width", "32",   "--height",  "24",      "-o"};
  const auto to = [](std::vector<std::string> words, const std::string& output) {
    words.push_back(output);
    return words;
  };
  DtrOk(to(making, In("photos")));
  const std::string set = In("small.dtr");
  DtrOk({"import", "--cameras", In("photos/cameras.json"), "--images", In("photos/images"),
         "--depth", In("photos/depth"), "-o", set});
  // The next run finishes a folder; that a single file or a set is there it says.
  const std::pair<std::vector<std::string>, std::string> commands[] = {
      {{"export", set, "--format", "colmap", "-o", Work("out")}, ""},
      {{"export", set, "--format", "depth", "-o", Work("out")}, ""},
      {{"export", set, "--format", "ply", "-o", Work("out.ply")}, "exists already"},
      {{"export", set, "--format", "web", "--no-evaluate", "-o", Work("out.html")},
       "exists already"},
      {to(making, Work("out")), ""},
      {{"join", set, set, "-o", Work("out.dtr")}, "expected no such folder yet, found one"}};
  const auto clear = [&] {
    for (const auto& entry : fs::directory_iterator(work_)) fs::remove_all(entry.path());
  };
  for (const auto& [command, there] : commands) {
    clear();
    DtrOk(command);
    const auto expected = Contents(work_);
    for (int call = 1;; call += call < kEveryCall ? 1 : 3) {
      clear();
      const Ran ran = DtrWithFailingCalls("DTR_TEST_KILLED_AT", call, command);
      if (ran.signal != SIGKILL) {
        EXPECT_EQ(ran.code, 0) << ran.err;
        EXPECT_GT(call, 1);
        break;
      }
      const Ran again = Dtr(command);
      if (again.code != 0) {
        ASSERT_NE(there, "") << again.err;
        ExpectRejected(again, kWrongUsage, there);
        DtrOk(to(command, "--force"));
      }
      EXPECT_THAT(DifferingFiles(expected, Contents(work_)), IsEmpty())
          << fmt::format("{}", fmt::join(command, " ")) << ", killed at call " << call;
    }
  }
}

TEST_F(LeftOver, ADatasetHalfMade) {
  const std::vector<std::string> making{"dataset", "make",    "courtyard", "--views",
                                        "4",       "--width", "96",        "--height",
                                        "64",      "-o",      Work("out")};
  Kill(making, [&] { return FilesIn(Work("out.partial/images")) >= 2; });
  DtrOk(making);
  EXPECT_THAT(NamesIn(work_), ElementsAre("out"));
  EXPECT_FALSE(fs::exists(work_ / "out/dataset.lock"));
}

TEST_F(LeftOver, AnImportHalfWritten) {
  std::vector<std::string> importing{
      "import",       "--cameras", Shared("courtyard/cameras.json"), "--images",
      Photos(),       "--depth",   Shared("courtyard/depth"),        "-o",
      Work("set.dtr")};
  Kill(importing, [&] { return FilesIn(Work("set.dtr.partial/images")) >= 1; });
  EXPECT_THAT(NamesIn(work_), ElementsAre("set.dtr.partial"));
  DtrOk(importing);
  EXPECT_THAT(NamesIn(work_), ElementsAre("set.dtr"));
  importing.back() = In("undisturbed.dtr");
  DtrOk(importing);
  EXPECT_THAT(DifferingFiles(Contents(In("undisturbed.dtr")), Contents(Work("set.dtr"))),
              IsEmpty());
}

TEST_F(LeftOver, ADynamicSetHalfJoined) {
  const std::vector<std::string> joining{"join", Shared("good.dtr"), Shared("good.dtr"), "-o",
                                         Work("moving.dtr")};
  Kill(joining, [&] { return fs::exists(Work("moving.dtr.partial")); });
  DtrOk(joining);
  EXPECT_THAT(NamesIn(work_), ElementsAre("moving.dtr"));
  DtrOk({"info", Work("moving.dtr"), "--verify"});
}

// A process that ended may wait for somebody to take note of it: a zombie, Z.
bool IsAtWork(int process) {
  std::ifstream file(fmt::format("/proc/{}/stat", process));
  std::string number, name, state;
  return file >> number >> name >> state && state != "Z";
}

// COLMAP ends with the command that started it, and what is finished is not done again.
TEST_F(LeftOver, ACalibrationThatWasKilledWhileColmapWorked) {
  colmap::testing::FakeColmap colmap;
  LeaveModel(colmap, colmap::ReadModel(Shared("courtyard/sparse")));
  colmap.Fail("mapper",
              "echo $$ > \"$here/pid\"; mv \"$here/pid\" \"$here/mapping\"; exec sleep 600");
  const std::vector<std::string> calibrating{"calibrate",   "photos", Photos(), "-o",
                                             Work("model"), "--sfm",  "colmap"};
  Kill(calibrating, [&] { return fs::exists(colmap / "mapping"); });
  const int sleeper = std::stoi(ReadFile(colmap / "mapping", 64));
  for (int i = 0; i < 100 && IsAtWork(sleeper); ++i) usleep(100'000);
  EXPECT_FALSE(IsAtWork(sleeper));
  colmap.Succeed("mapper");
  colmap.ForgetCalls();
  DtrOk(calibrating);
  ASSERT_EQ(colmap.Calls().size(), 1u);
  EXPECT_THAT(colmap.Calls()[0], ::testing::HasSubstr("mapper"));
  EXPECT_THAT(NamesIn(work_), ElementsAre("model"));
}

// A build that goes on tells what its calibration took, not what was left of it.
TEST_F(LeftOver, ABuildThatGoesOnCountsWhatColmapTookBefore) {
  colmap::testing::FakeColmap colmap;
  LeaveModel(colmap, colmap::ReadModel(Shared("courtyard/sparse")));
  colmap.Fail("feature_extractor", "sleep 3");
  colmap.Fail("mapper", "exit 3");
  const std::vector<std::string> building{"build",    Photos(), "--sfm", "colmap",
                                          "--engine", "none",   "-o",    Work("set.dtr")};
  ExpectRejected(Dtr(building), 1, "expected exit code 0, found 3");
  colmap.Succeed("mapper");
  DtrOk(building);
  const auto stages = io::ReadRunStages(Work("set.dtr"));
  ASSERT_GE(stages.size(), 2u);
  ASSERT_EQ(stages[1].name, "calibration");
  EXPECT_GE(stages[1].wall_s, 3);
}

bool HoldsASet(const fs::path& folder) {
  std::error_code gone;
  fs::recursive_directory_iterator entries(folder, gone);
  for (; !gone && entries != fs::recursive_directory_iterator(); entries.increment(gone)) {
    if (entries->path().filename() == "storage.dtr.partial") return true;
  }
  return false;
}

// One setting is measured where the system keeps what is temporary, a sweep beside its results.
TEST_F(LeftOver, SetsThatABenchMeasured) {
  setenv("TMPDIR", work_.c_str(), 1);
  const std::vector<std::string> point{"bench",   Shared("good.dtr"), "--stage",    "storage",
                                       "--point", "default",          "--renderer", "cpu"};
  Kill(point, [&] { return HoldsASet(work_); });
  EXPECT_EQ(NamesIn(work_).size(), 1u);
  DtrOk(point);
  EXPECT_THAT(NamesIn(work_), IsEmpty());
  unsetenv("TMPDIR");

  std::vector<std::string> sweep = point;
  sweep.erase(sweep.begin() + 4, sweep.begin() + 6);
  sweep.insert(sweep.end(), {"--max-points", "1", "-o", Work("out")});
  Kill(sweep, [&] { return HoldsASet(work_ / "out"); });
  DtrOk(sweep);
  for (const std::string& name : NamesIn(work_ / "out")) {
    EXPECT_NE(name.front(), '.') << name << " was left";
  }
}

}  // namespace
}  // namespace dtr::testing
