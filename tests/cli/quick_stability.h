// tests/cli/quick_stability.h -- cases of the stability table run one by one, and the page that
// holds them read back.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "cli/selftest/table.h"

namespace dtr::selftest {

/// A page of the table without the values, which differ a little from machine to machine: its
/// third column, and what follows "rejected with". Without the line that counts cases.
inline std::vector<std::string> LinesWithoutValues(std::istream& page) {
  std::vector<std::string> lines;
  for (std::string line; std::getline(page, line);) {
    if (const size_t rejection = line.find("rejected with:"); rejection != std::string::npos) {
      line.erase(rejection + std::string("rejected with:").size());
    } else if (line.starts_with("| ")) {
      const size_t what = line.find(" | "), value = line.find(" | ", what + 3);
      const size_t bound = line.find(" | ", value + 3);
      line.erase(value + 3, bound - value - 3);
    }
    if (line.find(" cases hold") == std::string::npos) lines.push_back(line);
  }
  return lines;
}

/// docs/STABILITY.md, line by line; tests run in the root of the sources.
inline std::vector<std::string> DocumentedLines() {
  std::ifstream page("docs/STABILITY.md");
  EXPECT_TRUE(page.good()) << "docs/STABILITY.md";
  return LinesWithoutValues(page);
}

/// Those of one stage, without its heading and the table's.
inline std::vector<std::string> DocumentedLines(const std::string& stage) {
  const std::vector<std::string> lines = DocumentedLines();
  auto at = std::find(lines.begin(), lines.end(), "## " + stage);
  const auto end = at == lines.end() ? at : std::find_if(at + 1, lines.end(), [](const auto& line) {
    return line.starts_with("## ");
  });
  std::vector<std::string> rows;
  for (; at != end; ++at) {
    if (at->starts_with("| ") && !at->starts_with("| case |")) rows.push_back(*at);
  }
  return rows;
}

/// A case's name as GoogleTest takes it.
inline std::string TestNameOf(const ::testing::TestParamInfo<Case>& info) {
  std::string name;
  for (const char c : info.param.stage + "_" + info.param.name) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) name += c;
  }
  return name + std::to_string(info.index);
}

inline std::vector<Case> QuickOnes(const std::vector<Case>& cases) {
  std::vector<Case> quick;
  std::ranges::copy_if(cases, std::back_inserter(quick), &Case::quick);
  return quick;
}

/// Runs the case, which must hold, and finds what it measured, its bounds and its reasons in the
/// documented table.
inline void ExpectHoldsAsDocumented(const Case& each) {
  SilentProgress progress;
  const Row row = RunCases({each}, true, progress).at(0);
  EXPECT_TRUE(row.passed()) << ToJson({row});
  std::istringstream page(ToMarkdown({row}));
  std::vector<std::string> found;
  for (const std::string& line : LinesWithoutValues(page)) {
    if (line.starts_with("| ") && !line.starts_with("| case |")) found.push_back(line);
  }
  ASSERT_FALSE(found.empty());
  const std::vector<std::string> documented = DocumentedLines(row.stage);
  const auto first = std::ranges::find(documented, found.front());
  ASSERT_NE(first, documented.end()) << "docs/STABILITY.md lacks: " << found.front();
  const auto length = std::min<std::ptrdiff_t>(std::ssize(found), documented.end() - first);
  EXPECT_EQ(std::vector<std::string>(first, first + length), found)
      << "dtr selftest --stability -o docs/STABILITY.md writes it again";
}

}  // namespace dtr::selftest
