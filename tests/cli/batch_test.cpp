// Builds that several processes share: parts of stages by hand, and dtr batch on this machine.
#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>

#include "dtr/base/durable.h"
#include "tests/cli/small_batch.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;

TEST_F(Batch, ProcessesHereGiveTheBytesOfABuild) {
  const Ran ran = RunBatch("batch", {"--local", "2", "--array-size", "3"});
  ASSERT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(DifferingFiles(Undisturbed(), Contents(Set("batch"))), ::testing::IsEmpty());
  EXPECT_FALSE(fs::exists(Set("batch").string() + ".partial"));
  const Ran status = DtrOk({"batch", "status", Set("batch").string(), "--json", "-"});
  EXPECT_NE(status.out.find("\"finished\": true"), std::string::npos) << status.out;
  const Ran again = DtrByItself({"batch", "resume", Set("batch").string()});
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_FALSE(fs::exists(Set("batch").string() + ".partial")) << "nothing is begun again";
}

TEST_F(Batch, CamerasWithTheirPointsNeedNoStagesOfStructureFromMotion) {
  const auto words = [&](const std::string& command, const std::string& run,
                         const std::vector<std::string>& more) {
    const fs::path courtyard = folder_ / "courtyard";
    std::vector<std::string> all = {command,    (courtyard / "images").string(),
                                    "--poses",  (courtyard / "sparse").string(),
                                    "--preset", "fast",
                                    "-o",       Set(run).string()};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  };
  DtrOk(words("build", "plain", {}));
  DtrOk(words("build", "batch", {"--stage", "capture"}));
  EXPECT_FALSE(fs::exists(Set("batch"))) << "one stage is no build";
  const Ran ran = DtrByItself(words("batch", "batch", {"--local", "2", "--array-size", "1"}));
  ASSERT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(DifferingFiles(Contents(Set("plain")), Contents(Set("batch"))), ::testing::IsEmpty());
}

TEST_F(Batch, ASeedIsAmongTheWordsThatAreResumed) {
  ASSERT_NE(RunBatch("a", {"--local", "2", "--array-size", "2", "--seed", "5"},
                     {SIGTERM, [&] { return fs::exists(Set("a").string() + ".partial"); }})
                .code,
            0);
  const Ran dry = DtrByItself({"batch", "resume", Set("a").string(), "--dry-run"});
  EXPECT_EQ(dry.code, 0) << dry.err;
}

TEST_F(Batch, ForcedTheNewSetTakesThePlaceOfTheOld) {
  ImportSmallCourtyard(folder_ / "courtyard", Set("a"));
  ExpectRejected(RunBatch("a", {"--local", "1", "--array-size", "2"}), 2,
                 "choose another name or pass --force to replace it");
  const Ran ran = RunBatch("a", {"--force", "--local", "2", "--array-size", "1"});
  ASSERT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(DifferingFiles(Undisturbed(), Contents(Set("a"))), ::testing::IsEmpty());
}

TEST_F(Batch, AStoppedOneGoesOnWithWhatIsMissing) {
  const fs::path parts = Set("batch").string() + ".partial/work/parts";
  const auto done = [&](const char* name) {
    return fs::exists(parts / (std::string(name) + ".done.json"));
  };
  const Ran stopped = RunBatch("batch", {"--local", "2", "--array-size", "3"},
                               {SIGTERM, [&] { return done("undistortion_1_of_3"); }});
  EXPECT_NE(stopped.code, 0);
  const auto before = fs::last_write_time(parts / "matching_1_of_3.done.json");
  const Ran status = DtrOk({"batch", "status", Set("batch").string(), "--json", "-"});
  EXPECT_NE(status.out.find("\"finished\": false"), std::string::npos) << status.out;
  const auto first_part = [&] { return fs::last_write_time(parts / "matching_1_of_3.done.json"); };
  EXPECT_EQ(first_part(), before);
  const Ran resumed = DtrByItself({"batch", "resume", Set("batch").string()});
  ASSERT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_THAT(DifferingFiles(Undisturbed(), Contents(Set("batch"))), ::testing::IsEmpty());
}

TEST_F(Batch, AFailedPartIsNamedWithWhatItSaid) {
  ASSERT_EQ(Stage("batch", "capture").code, 0);
  fs::remove_all(Set("batch").string() + ".partial/work/calibration/photos");
  const Ran ran = RunBatch("batch", {"--local", "1", "--array-size", "2"});
  ExpectRejected(ran, 1, "ended with code");
  EXPECT_NE(ran.err.find("features, part 1 of 2: ended with code 1; it said: dtr: "),
            std::string::npos)
      << ran.err;
  EXPECT_NE(ran.err.find("0001.jpg: cannot be read"), std::string::npos) << ran.err;
  const fs::path work = Set("batch").string() + ".partial/work";
  EXPECT_FALSE(fs::exists(work / "calibration/conventions")) << "no part of a test of cameras";
}

TEST_F(Batch, AStageWhoseInputsNobodyMadeNamesTheStageThatDoes) {
  ExpectRejected(Stage("a", "features", "1/2"), 2, "run its stage capture first");
  ASSERT_EQ(Stage("a", "capture").code, 0);
  ExpectRejected(Stage("a", "matching", "1/2"), 1, "run the stage pairs first");
  ExpectRejected(Stage("a", "undistortion", "1/2"), 1, "that the stage calibration freezes");
  ASSERT_EQ(Stage("a", "calibration").code, 0);
  ExpectRejected(Stage("a", "search", "1/2"), 1, "run all parts of the stage undistortion first");
  ASSERT_EQ(Stage("a", "undistortion", "1/1").code, 0);
  ExpectRejected(Stage("a", "search", "1/2"), 1, "run the stage ranges first");
  ASSERT_EQ(Stage("a", "ranges").code, 0);
  ASSERT_EQ(Stage("a", "search", "1/2").code, 0);
  ExpectRejected(Stage("a", "pass-1", "1/2"), 1, "expected planes of the stage search");
  ASSERT_EQ(Stage("a", "search", "2/2").code, 0);
  ASSERT_EQ(Stage("a", "pass-1", "2/2").code, 0);
  ExpectRejected(Stage("a", "maps", "1/2"), 1, "expected planes of the stage pass-1");
}

TEST_F(Batch, WhatIsNoPartOfThisBuildIsRejected) {
  ExpectRejected(Stage("a", "capture", "1/2"), 2, "is for one process");
  ExpectRejected(Stage("a", "capture", "3/2"), 2, "expected K/N with K from 1 to N");
  ExpectRejected(Stage("a", "capture", "one"), 2, "expected K/N with K from 1 to N");
  ExpectRejected(Stage("a", "pass-2"), 2, "expected one of capture");
  ExpectRejected(Stage("a", "capture", "", {"--time-budget", "5"}), 2,
                 "measures how much one machine does");
  ExpectRejected(Stage("a", "capture", "", {"--force-stage", "depth"}), 2,
                 "delete the partial set to begin again");
  EXPECT_FALSE(fs::exists(Set("a").string() + ".partial"));
  ASSERT_EQ(Stage("a", "capture").code, 0);
  ExpectRejected(Stage("a", "features", "1/2", {"--max-size", "96"}), 2, "(options differ)");
}

TEST_F(Batch, TwoProcessesDoNotWorkOnOnePart) {
  ASSERT_EQ(Stage("a", "capture").code, 0);
  const fs::path work = Set("a").string() + ".partial/work";
  fs::create_directories(work / "parts");
  {
    const auto lock = FileLock::Try(work / "parts/features_1_of_2.lock");
    ASSERT_TRUE(lock);
    ExpectRejected(Stage("a", "features", "1/2"), 2, "another process works on features, part 1");
  }
  {
    // Who has a part keeps those away that need the set for themselves.
    const auto lock = FileLock::Try(work / "lock", FileLock::Kind::kShared);
    ASSERT_TRUE(lock);
    EXPECT_EQ(Stage("a", "features", "2/2").code, 0);
    ExpectRejected(Stage("a", "pairs"), 2, "another process is writing this set");
  }
  const auto alone = FileLock::Try(work / "lock");
  ASSERT_TRUE(alone);
  ExpectRejected(Stage("a", "features", "1/2"), 2,
                 "another process is writing the whole of this set");
}

TEST_F(Batch, WordsThatCannotBeMeantAreRejectedBeforeAnyWork) {
  ExpectRejected(RunBatch("a", {}), 2, "expected --slurm or --local N, found neither");
  ExpectRejected(RunBatch("a", {"--local", "2", "--stage", "capture"}), 2,
                 "runs all stages; leave out --stage and --part");
  ExpectRejected(RunBatch("a", {"--local", "2", "--dynamic"}), 2, "time steps of a dynamic set");
  ExpectRejected(RunBatch("a", {"--local", "2", "--no-such-option"}), 2, "`dtr build` of these");
  ExpectRejected(Dtr({"batch", "status", Set("a").string()}), 1, "expected a batch of that set");
  EXPECT_TRUE(fs::is_empty(folder_ / "a"));
  {
    const std::string path = getenv("PATH");
    setenv("PATH", "", 1);
    const Ran without = RunBatch("a", {"--slurm", "--dry-run"});
    setenv("PATH", path.c_str(), 1);
    ExpectRejected(without, 1, "expected Slurm's program on the PATH, found none");
  }
  const Ran dry = RunBatch("a", {"--local", "2", "--dry-run"});
  EXPECT_EQ(dry.code, 0);
  EXPECT_NE((dry.out + dry.err).find("matching: "), std::string::npos);
  EXPECT_TRUE(fs::is_empty(folder_ / "a"));
}

std::string WithoutStages(std::string record) {
  const size_t begin = record.find("\"stages\": [") + 11, end = record.find("\"local\"");
  return record.replace(begin, end - begin, "], ");
}

TEST_F(Batch, ADamagedRecordIsOneLine) {
  ASSERT_NE(RunBatch("a", {"--local", "2", "--array-size", "2"},
                     {SIGTERM, [&] { return fs::exists(Set("a").string() + ".partial"); }})
                .code,
            0);
  const fs::path record = Set("a").string() + ".batch/batch.json";
  const std::string whole = Text(record);
  const size_t parts = whole.find("\"parts\": 1");
  ASSERT_NE(parts, std::string::npos);
  for (const std::string& damaged :
       {whole.substr(0, whole.size() / 2), std::string("[]"), WithoutStages(whole),
        std::string(whole).replace(parts, 10, "\"parts\": -1")}) {
    std::ofstream(record) << damaged;
    ExpectRejected(Dtr({"batch", "status", Set("a").string()}), 1,
                   "expected what dtr batch writes, found something else");
  }
}

TEST_F(Batch, AnotherBatchOfTheSameSetIsNotReplaced) {
  ASSERT_EQ(
      RunBatch(
          "a", {"--local", "2", "--array-size", "2"},
          {SIGTERM,
           [&] {
             return fs::exists(Set("a").string() + ".partial/work/parts/capture_1_of_1.done.json");
           }}).code != 0,
      true);
  std::vector<std::string> other = Words("a", {"--max-size", "96"});
  other.insert(other.begin(), "batch");
  other.insert(other.end(), {"--local", "2"});
  ExpectRejected(DtrByItself(other), 2, "expected a batch of the same words");
}

}  // namespace
}  // namespace dtr::testing
