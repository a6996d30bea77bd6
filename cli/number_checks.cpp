#include "cli/number_checks.h"

#include <cstdlib>
#include <string>

namespace dtr::cli {
namespace {

CLI::Validator Number(const char* name, const char* expected, bool zero) {
  const auto check = [expected, zero](const std::string& text) -> std::string {
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    const bool number = !text.empty() && *end == '\0';
    if (number && (value > 0 || (zero && value == 0))) return "";
    return std::string("expected ") + expected + ", found " + text;
  };
  return CLI::Validator(check, name);
}

}  // namespace

const CLI::Validator kPositive = Number("POSITIVE", "a number above 0", false);
const CLI::Validator kNonNegative = Number("NONNEGATIVE", "a number of 0 or above", true);

}  // namespace dtr::cli
