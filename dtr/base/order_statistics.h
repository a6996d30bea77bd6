// dtr/base/order_statistics.h -- the element of a rank, found without sorting everything.
#pragma once
#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
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

/// QuantileOf the positive among `values` for each of `shares`; empty if none is positive. A count
/// of leading bits, which order positive floats as they order integers, leaves a few values to look
/// at: several times as fast on a million of them.
inline std::vector<float> QuantilesOfPositive(std::span<const float> values,
                                              std::span<const double> shares) {
  constexpr int kShift = 16;
  const auto bin_of = [](float value) { return std::bit_cast<std::uint32_t>(value) >> kShift; };
  std::vector<size_t> counts(size_t{1} << (31 - kShift));
  size_t positive = 0;
  for (const float value : values) {
    if (!(value > 0)) continue;
    ++counts[bin_of(value)];
    ++positive;
  }
  std::vector<float> found, candidates;
  if (positive == 0) return found;
  for (const double share : shares) {
    auto rank = static_cast<size_t>(share * static_cast<double>(positive - 1));
    std::uint32_t bin = 0;
    while (rank >= counts[bin]) rank -= counts[bin++];
    candidates.clear();
    for (const float value : values) {
      if (value > 0 && bin_of(value) == bin) candidates.push_back(value);
    }
    const auto place = candidates.begin() + static_cast<std::ptrdiff_t>(rank);
    std::nth_element(candidates.begin(), place, candidates.end());
    found.push_back(*place);
  }
  return found;
}

}  // namespace dtr
