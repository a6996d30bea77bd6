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

/// "validation passed: all tests (19) are within their limits", or "validation FAILED: 2 of 19
/// tests: min_views 5 (at least 8), ...; WHAT TO DO". The remedy is that of the failed test that
/// explains the others. One sentence without a full stop.
std::string Conclusion(std::span<const Check> tests, Validated what);

/// Answer of the tests of cameras from elsewhere. Undecided: nothing contradicts the cameras, but the
/// photos do not show all that the tests need.
enum class Answer { kRight, kWrong, kUndecided };
Answer AnswerOf(std::span<const Check> tests);

/// "right: 95 % of ...", "wrong: WHY; WHAT TO DO", "not decidable: WHY; WHAT TO DO". `within_px`:
/// 95 % of the distances between observations and what other photos predict.
std::string AnswerLine(std::span<const Check> tests, size_t photos, double within_px);

/// What to do where the test of this name failed; empty for names that no validation has.
std::string RemedyOf(const std::string& test, Validated what);

}  // namespace dtr::calib
