// dtr/base/order_statistics.h -- the element of a rank, found without sorting everything.
#pragma once
#include <algorithm>
#include <cstddef>
#include <vector>

namespace dtr {

/// The element of rank floor(share * (n - 1)), 0 the smallest; share in [0, 1]. Reorders `values`,
/// which must not be empty nor hold NaN.
template <typename T>
T QuantileOf(std::vector<T>& values, double share) {
  const auto place =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

/// The element of rank floor(n / 2): of an even number the larger of the two in the middle, so that
/// it is one of the values. Reorders `values`, which must not be empty nor hold NaN.
template <typename T>
T UpperMedian(std::vector<T>& values) {
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

}  // namespace dtr
