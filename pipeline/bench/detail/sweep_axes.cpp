#include "pipeline/bench/detail/sweep_axes.h"

#include <algorithm>
#include <cmath>

namespace dtr::pipeline {

std::vector<std::string> SizeValues(const std::vector<int>& given_px, int own_px) {
  constexpr double kLess = 0.7, kHalf = 0.5;
  const auto share = [&](double factor) { return static_cast<int>(std::lround(factor * own_px)); };
  std::vector<std::string> values;
  for (const int size :
       given_px.empty() ? std::vector{own_px, share(kLess), share(kHalf)} : given_px) {
    const std::string name = std::to_string(size == 0 ? own_px : std::min(size, own_px));
    if (std::find(values.begin(), values.end(), name) == values.end()) values.push_back(name);
  }
  return values;
}

}  // namespace dtr::pipeline
