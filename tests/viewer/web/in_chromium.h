// tests/viewer/web/in_chromium.h -- exported pages in Chromium, driven by playwright-core (npm):
// DTR_PLAYWRIGHT names a folder with its node_modules. SKIPPED without.
#pragma once
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "dtr/base/process.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {

inline constexpr char kChromium[] = "/usr/bin/chromium";

/// With a set of true depth, `set.dtr`.
class InChromium : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* folder = std::getenv("DTR_PLAYWRIGHT");
    if (folder == nullptr ||
        !std::filesystem::exists(std::filesystem::path(folder) / "node_modules/playwright-core")) {
      GTEST_SKIP() << "needs DTR_PLAYWRIGHT, a folder with playwright-core";
    }
    if (!std::filesystem::exists(kChromium)) GTEST_SKIP() << "needs Chromium";
    MakeSmallCourtyard(folder_ / "courtyard");
    ImportSmallCourtyard(folder_ / "courtyard", folder_ / "set.dtr");
  }
  /// What a script of node finds: its last line.
  nlohmann::json Found(std::vector<std::string> words) const {
    std::string lines, json = "{}";
    ProcessOptions options;
    options.on_line = [&](const std::string& line) {
      lines += line + "\n";
      if (line.starts_with("{\"messages\"")) json = line;
    };
    words.insert(words.begin(), "node");
    EXPECT_TRUE(RunProcess(words, options).Ok()) << lines;
    return nlohmann::json::parse(json);
  }

  TemporaryFolder folder_;
};

}  // namespace dtr::testing
