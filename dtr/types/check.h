// dtr/types/check.h -- one thing that was tested, and how it went.
#pragma once
#include <algorithm>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace dtr {

/// A figure held against its limit. `validate` prints a list of these; sets carry them as
/// validation result.
struct Check {
  std::string name;  ///< unit in the name: "held_out_rms_px"
  double value = 0;  ///< what was measured; not a number where nothing could be measured
  double limit = 0;  ///< the largest value (LimitIsLeast: the smallest) that passes
  bool passed = false;
  std::string reason;  ///< one line: what the figure says, or why the check failed
};

/// Passes up to the limit, and never for NaN: nothing measured is not a pass.
inline Check AtMost(std::string name, double value, double limit, std::string reason) {
  return {std::move(name), value, limit, value <= limit, std::move(reason)};
}

/// Passes from the limit on, and never for NaN.
inline Check AtLeast(std::string name, double value, double limit, std::string reason) {
  return {std::move(name), value, limit, value >= limit, std::move(reason)};
}

/// What could not be measured does not pass; `reason` says why.
inline Check NotTested(std::string name, double limit, std::string reason) {
  return {std::move(name), std::numeric_limits<double>::quiet_NaN(), limit, false,
          std::move(reason)};
}

/// Whether values from the limit on pass, not those up to it: the name says it.
inline bool LimitIsLeast(const Check& check) { return check.name.starts_with("min_"); }

/// "at least" or "at most", which goes before the limit.
inline const char* LimitWords(const Check& check) {
  return LimitIsLeast(check) ? "at least" : "at most";
}

/// The word of a result in terminals, pages and JSON alike.
inline const char* ResultWord(bool passed) { return passed ? "passed" : "FAILED"; }

/// True when there is at least one check and all hold: no evidence is not a pass.
inline bool AllPassed(const std::vector<Check>& checks) {
  return !checks.empty() &&
         std::all_of(checks.begin(), checks.end(), [](const Check& c) { return c.passed; });
}

}  // namespace dtr
