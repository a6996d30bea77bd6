// tests/viewer/web/in_browser.h -- exported pages in browsers of Debian, driven by modules of npm:
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
inline constexpr char kFirefox[] = "/usr/bin/firefox-esr";

/// With a set of true depth, `set.dtr`. `module`: of npm, which drives `browser`.
class InBrowser : public ::testing::Test {
 protected:
  InBrowser(std::string browser, std::string module)
      : browser_(std::move(browser)), module_(std::move(module)) {}
  void SetUp() override {
    const char* folder = std::getenv("DTR_PLAYWRIGHT");
    if (folder == nullptr ||
        !std::filesystem::exists(std::filesystem::path(folder) / "node_modules" / module_)) {
      GTEST_SKIP() << "needs DTR_PLAYWRIGHT, a folder with " << module_;
    }
    if (!std::filesystem::exists(browser_)) GTEST_SKIP() << "needs " << browser_;
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

 private:
  std::string browser_, module_;
};

class InChromium : public InBrowser {
 protected:
  InChromium() : InBrowser(kChromium, "playwright-core") {}
};

}  // namespace dtr::testing
