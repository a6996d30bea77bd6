#include "dtr/gl/coarse_surface.h"

#include <algorithm>
#include <cmath>

#include "dtr/render/closed_cells.h"

namespace dtr::gl {
namespace {

// Blocks of 4 to 8 samples were the optimum in the survey of methods; 16 found too few flat ones.
constexpr int kLargestBlock = 8, kSmallestBlock = 4;

class SurfaceMaker {
 public:
  SurfaceMaker(const SampleGrid& samples, const BreakRule& rule, double tolerance)
      : samples_(samples),
        w_(samples.inverse_depth),
        rule_(rule),
        tolerance_(tolerance),
        single_(w_.width(), w_.height()) {}

  CoarseSurface Make() {
    for (int y = 0; y < w_.height(); y += kLargestBlock) {
      for (int x = 0; x < w_.width(); x += kLargestBlock) Cover(x, y, kLargestBlock);
    }
    // Blocks end at the centres of the outermost samples; their cells go on for half a sample.
    for (int x = 0; x < w_.width(); ++x) single_(x, 0) = single_(x, w_.height() - 1) = 1;
    for (int y = 0; y < w_.height(); ++y) single_(0, y) = single_(w_.width() - 1, y) = 1;
    for (int y = 0; y < w_.height(); ++y) {
      for (int x = 0; x < w_.width(); ++x) {
        if (single_(x, y) != 0 && w_(x, y) > 0) AddSplat(x, y);
      }
    }
    return std::move(surface_);
  }

 private:
  void Cover(int x, int y, int side) {
    if (x >= w_.width() || y >= w_.height()) return;
    if (IsFlat(x, y, side)) {
      for (const double value :
           {samples_.Centre(x), samples_.Centre(y), static_cast<double>(side) * samples_.step,
            w_(x, y), w_(x + side, y), w_(x, y + side), w_(x + side, y + side)}) {
        surface_.blocks.push_back(static_cast<float>(value));
      }
    } else if (side > kSmallestBlock) {
      const int half = side / 2;
      for (const int dy : {0, half}) {
        for (const int dx : {0, half}) Cover(x + dx, y + dy, half);
      }
    } else {
      // One row and column more: what lies between this block and the next belongs to one of them.
      for (int j = y; j <= std::min(y + side, w_.height() - 1); ++j) {
        for (int i = x; i <= std::min(x + side, w_.width() - 1); ++i) single_(i, j) = 1;
      }
    }
  }

  bool IsFlat(int x, int y, int side) const {
    if (x + side >= w_.width() || y + side >= w_.height()) return false;
    const double a = w_(x, y), b = w_(x + side, y), c = w_(x, y + side), d = w_(x + side, y + side);
    if (std::abs(a + d - b - c) > tolerance_) return false;
    for (int j = 0; j <= side; ++j) {
      const double v = static_cast<double>(j) / side;
      for (int i = 0; i <= side; ++i) {
        const double u = static_cast<double>(i) / side, here = w_(x + i, y + j);
        const double between = (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d);
        if (!(here > 0) || std::abs(here - between) > tolerance_) return false;
      }
    }
    return true;
  }

  void AddSplat(int x, int y) {
    for (const double value :
         {samples_.Centre(x), samples_.Centre(y), w_(x, y), LocalSlope(w_, x, y, 1, 0, rule_),
          LocalSlope(w_, x, y, 0, 1, rule_)}) {
      surface_.splats.push_back(static_cast<float>(value));
    }
  }

  const SampleGrid& samples_;
  const Grid<double>& w_;
  const BreakRule rule_;
  const double tolerance_;
  Grid<std::uint8_t> single_;
  CoarseSurface surface_;
};

}  // namespace

CoarseSurface MakeCoarseSurface(const SampleGrid& samples, const BreakRule& rule,
                                double tolerance) {
  if (samples.inverse_depth.empty()) return {};
  return SurfaceMaker(samples, rule, tolerance).Make();
}

}  // namespace dtr::gl
