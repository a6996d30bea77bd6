// calib/boards/length.h -- lengths as people write them.
#pragma once
#include <optional>
#include <string_view>

namespace dtr::calib {

struct Length {
  double value = 0;
  bool has_unit = false;  ///< then in metres
};

/// "25mm", "2.5cm", "0.025m", or "25" without a unit. Empty for anything else,
/// and for lengths that are not positive and finite.
std::optional<Length> LengthFrom(std::string_view word);

}  // namespace dtr::calib
