// cli/number_checks.h -- what the values of options are held to, said in our words: CLI11 would
// print the largest number there is.
#pragma once
#include <CLI/CLI.hpp>

namespace dtr::cli {

/// A number above 0; a number of 0 or above. Their names stand in the help, and by them
/// AddCommand knows options that take numbers.
extern const CLI::Validator kPositive, kNonNegative;

/// A bound on memory that no machine reaches and no size overflows at.
inline constexpr double kMaxGigabytes = 1e6;

}  // namespace dtr::cli
