// tests/cli/small_batch.h -- a build of a few tiny photos, in parts.
#pragma once
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {

/// Photos with known cameras and no points: all stages but structure from motion's own mapping.
class Batch : public ::testing::Test {
 protected:
  void SetUp() override { MakeSmallCourtyard(folder_ / "courtyard"); }

  std::filesystem::path Set(const std::string& run) const {
    std::filesystem::create_directories(folder_ / run);
    return folder_ / run / "set.dtr";
  }
  std::vector<std::string> Words(const std::string& run,
                                 const std::vector<std::string>& more = {}) const {
    const std::filesystem::path courtyard = folder_ / "courtyard";
    std::vector<std::string> words = {(courtyard / "images").string(),
                                      "--poses",
                                      (courtyard / "cameras.json").string(),
                                      "--holdout",
                                      "every:4",
                                      "--neighbours",
                                      "2",
                                      "--pass-neighbours",
                                      "2",
                                      "--iterations",
                                      "1",
                                      "--passes",
                                      "1",
                                      "-o",
                                      Set(run).string()};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  Ran Stage(const std::string& run, const std::string& stage, const std::string& part = "",
            const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words = Words(run, more);
    words.insert(words.begin(), "build");
    words.insert(words.end(), {"--stage", stage});
    if (!part.empty()) words.insert(words.end(), {"--part", part});
    return Dtr(words);
  }
  Ran RunBatch(const std::string& run, const std::vector<std::string>& options,
               const Interruption& interruption = {}) const {
    std::vector<std::string> words = Words(run);
    words.insert(words.begin(), "batch");
    words.insert(words.end(), options.begin(), options.end());
    return DtrByItself(words, interruption);
  }
  std::map<std::string, std::string> Undisturbed() const {
    std::vector<std::string> words = Words("undisturbed");
    words.insert(words.begin(), "build");
    DtrOk(words);
    return Contents(Set("undisturbed"));
  }

  const TemporaryFolder folder_;
};

/// A batch, with the folder that it keeps beside its set.
class BatchFolder : public Batch {
 protected:
  std::filesystem::path Folder() const { return Set("a").string() + ".batch"; }
  std::filesystem::path Record() const { return Folder() / "batch.json"; }
  std::filesystem::path Done(const std::string& part) const {
    return Set("a").string() + ".partial/work/parts/" + part + ".done.json";
  }
  Ran Begin(const Interruption& interruption = {}, const std::string& parts = "1") const {
    return RunBatch("a", {"--local", "2", "--array-size", parts}, interruption);
  }
  Ran Resume() const { return DtrByItself({"batch", "resume", Set("a").string()}); }
  // Begins it, and ends it once something is there to go on with.
  void Stop(int signal = SIGTERM) const {
    Begin({signal, [&] { return std::filesystem::exists(Done("capture_1_of_1")); }});
    ASSERT_TRUE(std::filesystem::exists(Record()));
    ASSERT_FALSE(std::filesystem::exists(Set("a")));
  }
  void ExpectFinished() const {
    EXPECT_THAT(DifferingFiles(Undisturbed(), Contents(Set("a"))), ::testing::IsEmpty());
    EXPECT_FALSE(std::filesystem::exists(Set("a").string() + ".partial"));
  }
};

}  // namespace dtr::testing
