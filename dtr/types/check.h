// dtr/types/check.h -- one thing that was tested, and how it went.
#pragma once
#include <algorithm>
#include <string>
#include <vector>

namespace dtr {

/// A figure held against its limit. `validate` prints a list of these; sets carry them as verdict.
struct Check {
  std::string name;  ///< unit in the name: "held_out_rms_px"
  double value = 0;  ///< what was measured; not a number where nothing could be measured
  double limit = 0;  ///< the largest value (for names in min_: the smallest) that passes
  bool passed = false;
  std::string reason;  ///< one line: what the figure says, or why the check failed
};

/// True when there is at least one check and all hold: no evidence is not a pass.
inline bool AllPassed(const std::vector<Check>& checks) {
  return !checks.empty() &&
         std::all_of(checks.begin(), checks.end(), [](const Check& c) { return c.passed; });
}

}  // namespace dtr
