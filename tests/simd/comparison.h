// tests/simd/comparison.h -- how two renderers of one scene are compared.
#pragma once
#include <algorithm>
#include <cstdio>
#include <string>

#include "dtr/render/scene.h"
#include "dtr/render/triangulation.h"
#include "tests/cpu/render_testing.h"

namespace dtr::testing {

/// What two renderers may differ by: 2 of 255 levels (rounding to 8 bits twice, single precision)
/// on all but a share of the pixels, those where rounding turns a decision. Those at the Delta
/// border are not evaluated, and must be few.
inline constexpr int kLevels = 2;
inline constexpr double kApartShare = 0.002, kCoverageShare = 0.002, kBorderShare = 0.01;

struct Comparison {
  long long compared = 0, apart = 0;  ///< seen by both and evaluated; more than kLevels apart
  long long judged = 0, coverage_apart = 0;  ///< neither at a break nor at the Delta border
  long long border = 0, total = 0;           ///< flagged by the reference: at the Delta border
  int largest = 0;

  double border_share() const { return Share(border, total); }
  double apart_share() const { return Share(apart, compared); }
  double coverage_share() const { return Share(coverage_apart, judged); }
  bool Holds() const {
    return apart_share() <= kApartShare && coverage_share() <= kCoverageShare &&
           border_share() <= kBorderShare;
  }
  void Add(const Comparison& o) {
    compared += o.compared, apart += o.apart, judged += o.judged;
    coverage_apart += o.coverage_apart, border += o.border, total += o.total;
    largest = std::max(largest, o.largest);
  }
  std::string Text() const {
    char text[200];
    std::snprintf(text, sizeof(text),
                  "%9lld px compared (%.0f %%), %.4f %% apart (largest %d), coverage %.4f %%, at "
                  "the border %.3f %%",
                  compared, 100 * Share(compared, total), 100 * apart_share(), largest,
                  100 * coverage_share(), 100 * border_share());
    return text;
  }

 private:
  static double Share(long long part, long long whole) {
    return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
  }
};

/// SPEC 2.3's threshold for the novel image: the strictest of the scene's views.
inline BreakRule StrictestBreaks(const RenderScene& scene, const RenderOptions& options) {
  BreakRule rule{1e300, options.absolute_depth_break};
  for (const View* view : scene.views) {
    rule.inverse_depth = std::min(rule.inverse_depth, ThresholdsOf(*view, options).depth_break);
  }
  return rule;
}

/// 255 at pixels within 2 of a depth break of the reference's depth (SPEC 2.3) or of the edge of
/// what it covers.
inline Mask NearBreaks(const RenderResult& reference, const BreakRule& rule) {
  constexpr int kReach = 2;
  const int width = reference.depth.width(), height = reference.depth.height();
  Grid<double> inverse_depth(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float z = reference.depth(x, y);
      inverse_depth(x, y) = z > 0 ? 1.0 / z : 0;
    }
  }
  Mask near(width, height);
  const auto mark_around = [&](int x, int y, int dx, int dy) {
    for (int j = y - kReach; j <= y + dy + kReach; ++j) {
      for (int i = x - kReach; i <= x + dx + kReach; ++i) {
        if (near.Contains(i, j)) near(i, j) = 255;
      }
    }
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (const auto& [dx, dy] : {std::pair(1, 0), std::pair(0, 1)}) {
        if (!near.Contains(x + dx, y + dy)) continue;
        const bool here = inverse_depth(x, y) > 0, there = inverse_depth(x + dx, y + dy) > 0;
        const bool breaks =
            here != there || (here && EdgeBreaks(inverse_depth, x, y, dx, dy, rule));
        if (breaks) mark_around(x, y, dx, dy);
      }
    }
  }
  return near;
}

/// The measure: pixels near breaks and at the Delta border are left out.
inline Comparison Compare(const RenderResult& reference, const RenderResult& other,
                          const BreakRule& rule) {
  Comparison c;
  const Mask breaks = NearBreaks(reference, rule);
  for (int y = 0; y < breaks.height(); ++y) {
    for (int x = 0; x < breaks.width(); ++x) {
      ++c.total;
      const bool border = reference.delta_border(x, y) != 0;
      c.border += border;
      if (border || breaks(x, y) != 0) continue;
      ++c.judged;
      const bool seen = reference.coverage(x, y) != 0;
      if (seen != (other.coverage(x, y) != 0)) ++c.coverage_apart;
      if (!seen || other.coverage(x, y) == 0) continue;
      ++c.compared;
      const int difference = PixelDifference(reference.image, other.image, x, y);
      c.apart += difference > kLevels;
      c.largest = std::max(c.largest, difference);
    }
  }
  return c;
}

}  // namespace dtr::testing
