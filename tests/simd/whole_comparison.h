// tests/simd/whole_comparison.h -- how far two renderers are apart, every pixel counted.
#pragma once
#include <cstdio>
#include <string>

#include "dtr/render/result.h"
#include "tests/cpu/render_testing.h"

namespace dtr::testing {

/// Two renderers of a set that stereo made: what may differ, depth edges included.
inline constexpr double kWholeCoverageShare = 0.003, kWholeApartShare = 0.005;
inline constexpr int kWholeLevels = 2;  // of 255

struct WholeComparison {
  long long pixels = 0, coverage_apart = 0;
  long long both = 0, apart = 0;  ///< seen by both; more than kWholeLevels apart

  double coverage_share() const { return Share(coverage_apart, pixels); }
  double apart_share() const { return Share(apart, both); }
  bool Holds() const {
    return coverage_share() <= kWholeCoverageShare && apart_share() <= kWholeApartShare;
  }
  void Add(const WholeComparison& o) {
    pixels += o.pixels, coverage_apart += o.coverage_apart, both += o.both, apart += o.apart;
  }
  std::string Text() const {
    char text[120];
    std::snprintf(text, sizeof(text), "coverage differs on %.4f %%, %.4f %% of %lld are apart",
                  100 * coverage_share(), 100 * apart_share(), both);
    return text;
  }

 private:
  static double Share(long long part, long long whole) {
    return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
  }
};

inline WholeComparison CompareWhole(const RenderResult& reference, const RenderResult& other) {
  WholeComparison c;
  for (int y = 0; y < reference.coverage.height(); ++y) {
    for (int x = 0; x < reference.coverage.width(); ++x) {
      const bool seen = reference.coverage(x, y) != 0, seen_by_other = other.coverage(x, y) != 0;
      ++c.pixels;
      c.coverage_apart += seen != seen_by_other;
      if (!seen || !seen_by_other) continue;
      ++c.both;
      c.apart += PixelDifference(reference.image, other.image, x, y) > kWholeLevels;
    }
  }
  return c;
}

}  // namespace dtr::testing
