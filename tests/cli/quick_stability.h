// tests/cli/quick_stability.h -- cases of the stability table run one by one.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <iterator>
#include <string>
#include <vector>

#include "cli/selftest/table.h"

namespace dtr::selftest {

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

/// Runs the case, which must hold.
inline void ExpectHolds(const Case& each) {
  SilentProgress progress;
  const Row row = RunCases({each}, true, progress).at(0);
  EXPECT_TRUE(row.passed()) << ToJson({row});
}

}  // namespace dtr::selftest
