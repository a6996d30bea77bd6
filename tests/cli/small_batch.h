// tests/cli/small_batch.h -- a build of a few tiny photos, in parts.
#pragma once
#include <gtest/gtest.h>

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
                                      "--round-neighbours",
                                      "2",
                                      "--iterations",
                                      "1",
                                      "--rounds",
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

}  // namespace dtr::testing
