// calib/validation/conclusion.h -- what tests say together: one line each, and the sentence that
// ends them.
#pragma once
#include <span>
#include <string>

#include "dtr/types/check.h"

namespace dtr::calib {

/// What was validated; some tests of both have one name, and other remedies.
enum class Validated { kBoards, kPhotos };

/// "passed min_tilt_deg: 89.2 (at least 15): ...", as terminals show a test.
std::string LineOf(const Check& test);

/// "validation passed: all tests (19) are within their limits", or "validation FAILED: 2 of 19 tests:
/// min_views 5 (at least 8), ...; WHAT TO DO". The remedy is that of the failed test that explains
/// the others. One sentence without a full stop.
std::string Conclusion(std::span<const Check> tests, Validated what);

/// What to do where the test of this name failed; empty for names that no validation has.
std::string RemedyOf(const std::string& test, Validated what);

}  // namespace dtr::calib
