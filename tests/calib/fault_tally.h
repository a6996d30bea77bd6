// tests/calib/fault_tally.h -- what came of spoiled calibrations and of honest ones.
#pragma once
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "dtr/types/check.h"

namespace dtr::testing {

struct Tally {
  int caught = 0, missed = 0;  ///< of those that can be detected
  int not_detectable = 0;
  int honest = 0, honest_passed = 0;
  int faults() const { return caught + missed; }
};

/// What faults are drawn by: DTR_FAULT_SEED, or 1.
inline std::uint64_t FaultInjectionSeed() {
  const char* given = std::getenv("DTR_FAULT_SEED");
  return given ? std::strtoull(given, nullptr, 10) : 1;
}

/// The test of this name where it broke; null where it held or is not there.
inline const Check* BrokenTest(const std::vector<Check>& tests, const std::string& name) {
  const auto found = std::find_if(tests.begin(), tests.end(), [&](const Check& test) {
    return test.name == name && !test.passed;
  });
  return found == tests.end() ? nullptr : &*found;
}

/// The tests that broke, with their reasons; "none" where none did.
inline std::string BrokenTests(const std::vector<Check>& tests) {
  std::string names;
  for (const Check& test : tests) {
    if (!test.passed) names += (names.empty() ? "" : ", ") + test.name + " (" + test.reason + ")";
  }
  return names.empty() ? "none" : names;
}

}  // namespace dtr::testing
