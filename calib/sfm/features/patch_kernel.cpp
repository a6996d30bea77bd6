#include "calib/sfm/features/patch_kernel.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <numbers>

// The rest of this file is compiled once per instruction set; the best one is chosen at run time.
// No FMA and no approximate division or root: every instruction set gives the same bits. Vectors
// give the samples of a row; sums are made one sample after the other.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "calib/sfm/features/patch_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace dtr::sfm::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::CappedTag<float, 16>;
using DI = hn::RebindToSigned<DF>;
using VF = hn::Vec<DF>;
using VI = hn::Vec<DI>;
using DPair = hn::CappedTag<float, 2>;

constexpr int kLanes = static_cast<int>(hn::MaxLanes(DF()));
/// Samples of a row at most: the largest sigma of an octave, 1.6 * 2^(4.5 / 3), makes 102.
constexpr int kMaxRow = 128;
constexpr int kMaxRadius = kMaxRow / 2 - 2;

HWY_INLINE VF Constant(float value) { return hn::Set(DF(), value); }
HWY_INLINE VF Indices() { return hn::ConvertTo(DF(), hn::Iota(DI(), 0)); }

/// a + b c in two roundings.
HWY_INLINE VF AddProduct(VF a, VF b, VF c) { return hn::Add(a, hn::Mul(b, c)); }

template <size_t kTerms>
HWY_INLINE VF Polynomial(const float (&coefficients)[kTerms], VF x) {
  VF sum = Constant(coefficients[kTerms - 1]);
  for (size_t i = kTerms - 1; i-- > 0;) sum = AddProduct(Constant(coefficients[i]), sum, x);
  return sum;
}

/// Direction of (x, y) in turns, 0 to 1, from +x towards +y; (0, 0) has some direction.
/// Abramowitz & Stegun 4.4.49: the error is below 1e-5 rad.
HWY_INLINE VF Turns(VF x, VF y) {
  constexpr float kAtan[] = {0.1591336f, -0.0525688f, 0.0286703f, -0.0135493f, 0.0033160f};
  const VF ax = hn::Abs(x), ay = hn::Abs(y), zero = hn::Zero(DF());
  const VF ratio =
      hn::Div(hn::Min(ax, ay), hn::Max(hn::Max(ax, ay), Constant(1e-30f)));  // not 0 / 0
  VF turns = hn::Mul(ratio, Polynomial(kAtan, hn::Mul(ratio, ratio)));
  turns = hn::IfThenElse(hn::Gt(ay, ax), hn::Sub(Constant(0.25f), turns), turns);
  turns = hn::IfThenElse(hn::Lt(x, zero), hn::Sub(Constant(0.5f), turns), turns);
  return hn::IfThenElse(hn::Lt(y, zero), hn::Sub(Constant(1.0f), turns), turns);
}

/// exp(-x) for 0 <= x < 80. Abramowitz & Stegun 4.2.44 after the powers of 2: within 3e-5.
HWY_INLINE VF ExpOfMinus(VF x) {
  constexpr float kExp[] = {1.0f, -0.9998684f, 0.4982926f, -0.1595332f, 0.0293641f};
  const DI di;
  const VF power = hn::Floor(hn::Mul(x, Constant(std::numbers::log2e_v<float>)));
  const VF rest = hn::Sub(x, hn::Mul(power, Constant(std::numbers::ln2_v<float>)));
  const VI exponent = hn::Sub(hn::Set(di, 127), hn::ConvertTo(di, power));
  return hn::Mul(Polynomial(kExp, rest), hn::BitCast(DF(), hn::ShiftLeft<23>(exponent)));
}

/// A Gaussian at whole pixels around a position between them.
class GaussianTable {
 public:
  /// At `first`, `first` + 1, ... pixels from the position, `count` <= kMaxRow.
  GaussianTable(float first, int count, float sigma) {
    const DF d;
    const VF scale = Constant(0.5f / (sigma * sigma));
    for (int i = 0; i < count; i += kLanes) {
      const VF at = hn::Add(Constant(first + static_cast<float>(i)), Indices());
      hn::StoreU(ExpOfMinus(hn::Mul(hn::Mul(at, at), scale)), d, values_ + i);
    }
  }
  const float* from(int i) const { return values_ + i; }

 private:
  HWY_ALIGN float values_[kMaxRow + 2 * kLanes];
};

struct Gradients {
  VF magnitude, turns;
};

/// Central differences at the pixels from `pixel` on.
HWY_INLINE Gradients GradientsAt(const float* pixel, std::ptrdiff_t stride) {
  const DF d;
  const VF x = hn::Sub(hn::LoadU(d, pixel + 1), hn::LoadU(d, pixel - 1));
  const VF y = hn::Sub(hn::LoadU(d, pixel + stride), hn::LoadU(d, pixel - stride));
  return {hn::Sqrt(hn::Add(hn::Mul(x, x), hn::Mul(y, y))), Turns(x, y)};
}

/// Adds to two neighbouring sums.
HWY_INLINE void AddPair(const float* pair, float* sums) {
  const DPair d;  // of one lane without vectors
  for (size_t i = 0; i < 2; i += hn::MaxLanes(d)) {
    hn::StoreU(hn::Add(hn::LoadU(d, sums + i), hn::LoadU(d, pair + i)), d, sums + i);
  }
}

/// The pixels of an image that are at most `radius` away in x and y, and have neighbours.
struct Square {
  Square(const PatchPosition& at, float radius)
      : x(static_cast<int>(std::floor(at.x + 0.5f))),
        y(static_cast<int>(std::floor(at.y + 0.5f))),
        left(std::max(x - Whole(radius), 1)),
        right(std::min(x + Whole(radius), at.width - 2)),
        top(std::max(y - Whole(radius), 1)),
        bottom(std::min(y + Whole(radius), at.height - 2)) {}
  static int Whole(float radius) { return std::min(static_cast<int>(radius + 0.5f), kMaxRadius); }

  int x, y;                      ///< the middle
  int left, right, top, bottom;  ///< inclusive
};

/// Two tables of sums: samples go to one and the other in turn, for an addition need not wait for
/// the one before it where both are to the same bin.
template <int kCount>
struct TwoTables {
  HWY_ALIGN float sums[2][kCount] = {};
  float Sum(int i) const { return sums[0][i] + sums[1][i]; }
};

void DirectionHistogramImpl(const PatchPosition& at, std::array<float, kDirections>* out) {
  const DF d;
  const DI di;
  const float sigma = 1.5f * at.sigma, radius = 3 * sigma;
  const Square square(at, radius);
  const GaussianTable across(static_cast<float>(square.left) - at.x, square.right - square.left + 1,
                             sigma);
  const GaussianTable down(static_cast<float>(square.top) - at.y, square.bottom - square.top + 1,
                           sigma);
  TwoTables<kDirections + 2> table;  // bin i at i + 1
  HWY_ALIGN float pairs[2 * (kMaxRow + kLanes)];
  HWY_ALIGN std::int32_t bins[kMaxRow + kLanes];
  for (int y = square.top; y <= square.bottom; ++y) {
    const float dy = static_cast<float>(y) - at.y;
    const float half = std::sqrt(std::max(radius * radius - dy * dy, 0.0f));
    const int left = std::max(square.left, static_cast<int>(std::ceil(at.x - half)));
    const int right = std::min(square.right, static_cast<int>(std::floor(at.x + half)));
    const float* row = at.pixels + static_cast<size_t>(y) * at.stride;
    const VF weight = Constant(*down.from(y - square.top));
    const int count = right - left + 1;
    for (int i = 0; i < count; i += kLanes) {
      const Gradients g = GradientsAt(row + left + i, static_cast<std::ptrdiff_t>(at.stride));
      const VF value =
          hn::Mul(g.magnitude, hn::Mul(weight, hn::LoadU(d, across.from(left - square.left + i))));
      const VF position = hn::Add(hn::Mul(g.turns, Constant(kDirections)), Constant(0.5f));
      const VI bin =
          hn::Min(hn::Max(hn::ConvertTo(di, position), hn::Zero(di)), hn::Set(di, kDirections));
      const VF upper = hn::Mul(value, hn::Sub(position, hn::ConvertTo(d, bin)));
      hn::StoreU(bin, di, bins + i);
      hn::StoreInterleaved2(hn::Sub(value, upper), upper, d, pairs + 2 * i);
    }
    for (int i = 0; i < count; ++i) AddPair(pairs + 2 * i, table.sums[i % 2] + bins[i]);
  }
  for (int i = 0; i < kDirections; ++i) (*out)[static_cast<size_t>(i)] = table.Sum(i + 1);
  (*out)[kDirections - 1] += table.Sum(0);
  (*out)[0] += table.Sum(kDirections + 1);
}

/// A descriptor's cells with one more on each side, for what is shared with cells that are not
/// there, and directions with one more, which is the first.
constexpr int kPaddedCells = kCells + 2, kPaddedDirections = kCellDirections + 2;
constexpr float kCellSigmas = 3;                     // side of a cell
constexpr float kReachCells = 0.5f * kCells + 0.5f;  // from the middle, where shares end

/// Position of samples in the rotated grid of cells, linear in x.
struct CellGrid {
  float cos, sin;  ///< per pixel, in cells
  float turns;     ///< of the feature's orientation

  /// The columns of the row at `dy` that are in reach, as distances from the feature.
  std::pair<float, float> Reach(float dy) const {
    float from = -1e9f, to = 1e9f;
    Clip(cos, sin * dy, &from, &to);
    Clip(-sin, cos * dy, &from, &to);
    return {from, to};
  }

 private:
  /// |slope * dx + offset| <= kReachCells.
  static void Clip(float slope, float offset, float* from, float* to) {
    if (std::abs(slope) < 1e-6f) {
      if (std::abs(offset) > kReachCells) *to = *from - 1;
      return;
    }
    const float a = (-kReachCells - offset) / slope, b = (kReachCells - offset) / slope;
    *from = std::max(*from, std::min(a, b));
    *to = std::min(*to, std::max(a, b));
  }
};

/// Shares of the samples of a row in the bins of their four cells, two directions each.
struct CellShares {
  HWY_ALIGN std::int32_t bins[kMaxRow + kLanes];  ///< of the first cell
  HWY_ALIGN float pairs[4][2 * (kMaxRow + kLanes)];
};

/// Cell below a position and how far it is beyond its centre.
HWY_INLINE VF SplitCell(VF position, VF* beyond) {
  const VF shifted = hn::Add(position, Constant(kReachCells));  // of the padding's first: 0
  const VF cell = hn::Min(hn::Max(hn::Floor(shifted), hn::Zero(DF())), Constant(kPaddedCells - 2));
  *beyond = hn::Min(hn::Max(hn::Sub(shifted, cell), hn::Zero(DF())), Constant(1));
  return cell;
}

/// Of the pixels from `pixel` on, the first of them at (dx, dy) from the feature.
HWY_INLINE void ShareSamples(const CellGrid& grid, const float* pixel, std::ptrdiff_t stride,
                             float dx, float dy, VF weight, int i, CellShares* shares) {
  const DF d;
  const DI di;
  const Gradients g = GradientsAt(pixel, stride);
  const VF x = hn::Add(Constant(dx), Indices());
  VF beyond_x, beyond_y;
  const VF column =
      SplitCell(AddProduct(Constant(grid.sin * dy), Constant(grid.cos), x), &beyond_x);
  const VF row = SplitCell(AddProduct(Constant(grid.cos * dy), Constant(-grid.sin), x), &beyond_y);
  VF turns = hn::Sub(g.turns, Constant(grid.turns));
  turns = hn::Mul(hn::Sub(turns, hn::Floor(turns)), Constant(kCellDirections));
  const VF direction = hn::Min(hn::Floor(turns), Constant(kCellDirections - 1));
  const VF beyond = hn::Sub(turns, direction);
  const VF bin = hn::Add(
      hn::Mul(hn::Add(hn::Mul(row, Constant(kPaddedCells)), column), Constant(kPaddedDirections)),
      direction);
  hn::StoreU(hn::ConvertTo(di, bin), di, shares->bins + i);
  const VF value = hn::Mul(g.magnitude, weight);
  const VF below = hn::Mul(value, beyond_y), above = hn::Sub(value, below);
  const VF below_right = hn::Mul(below, beyond_x), above_right = hn::Mul(above, beyond_x);
  const VF cells[4] = {hn::Sub(above, above_right), above_right, hn::Sub(below, below_right),
                       below_right};
  for (size_t c = 0; c < 4; ++c) {
    const VF next = hn::Mul(cells[c], beyond);
    hn::StoreInterleaved2(hn::Sub(cells[c], next), next, d, shares->pairs[c] + 2 * i);
  }
}

void GradientCellsImpl(const PatchPosition& at, float orientation_rad, float* out) {
  const DF d;
  constexpr int kRowOfCells = kPaddedCells * kPaddedDirections;
  constexpr int kOffsets[4] = {0, kPaddedDirections, kRowOfCells, kRowOfCells + kPaddedDirections};
  const float cell = kCellSigmas * at.sigma, gaussian = 0.5f * kCells * cell;
  const CellGrid grid{std::cos(orientation_rad) / cell, std::sin(orientation_rad) / cell,
                      orientation_rad / (2 * std::numbers::pi_v<float>)};
  const Square square(at, std::numbers::sqrt2_v<float> * kReachCells * cell);
  const GaussianTable across(static_cast<float>(square.left) - at.x, square.right - square.left + 1,
                             gaussian);
  const GaussianTable down(static_cast<float>(square.top) - at.y, square.bottom - square.top + 1,
                           gaussian);
  TwoTables<kPaddedCells * kRowOfCells> table;
  CellShares shares;
  const int first = square.top + std::abs(square.y - square.top) % kDescriptorRowStep;
  for (int y = first; y <= square.bottom; y += kDescriptorRowStep) {
    const float dy = static_cast<float>(y) - at.y;
    const auto [from, to] = grid.Reach(dy);
    if (!(from <= to)) continue;
    const int left = std::max(square.left, static_cast<int>(std::ceil(at.x + from)));
    const int right = std::min(square.right, static_cast<int>(std::floor(at.x + to)));
    const float* row = at.pixels + static_cast<size_t>(y) * at.stride;
    const VF weight = Constant(*down.from(y - square.top));
    const int count = right - left + 1;
    for (int i = 0; i < count; i += kLanes) {
      ShareSamples(grid, row + left + i, static_cast<std::ptrdiff_t>(at.stride),
                   static_cast<float>(left + i) - at.x, dy,
                   hn::Mul(weight, hn::LoadU(d, across.from(left - square.left + i))), i, &shares);
    }
    for (int i = 0; i < count; ++i) {
      float* sums = table.sums[i % 2] + shares.bins[i];
      for (size_t c = 0; c < 4; ++c) AddPair(shares.pairs[c] + 2 * i, sums + kOffsets[c]);
    }
  }
  for (int r = 0; r < kCells; ++r) {
    for (int c = 0; c < kCells; ++c) {
      const int bin = (r + 1) * kRowOfCells + (c + 1) * kPaddedDirections;
      for (int o = 0; o < kCellDirections; ++o) *out++ = table.Sum(bin + o);
      out[-kCellDirections] += table.Sum(bin + kCellDirections);
    }
  }
}

const char* TargetName() { return hwy::TargetName(HWY_TARGET); }

}  // namespace dtr::sfm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "calib/sfm/features/sift.h"

namespace dtr::sfm {

HWY_EXPORT(DirectionHistogramImpl);
HWY_EXPORT(GradientCellsImpl);
HWY_EXPORT(TargetName);

std::array<float, kDirections> DirectionHistogram(const PatchPosition& at) {
  std::array<float, kDirections> histogram;
  HWY_DYNAMIC_DISPATCH(DirectionHistogramImpl)(at, &histogram);
  return histogram;
}

std::array<float, kCells * kCells * kCellDirections> GradientCells(const PatchPosition& at,
                                                                   float orientation_rad) {
  std::array<float, kCells * kCells * kCellDirections> cells;
  HWY_DYNAMIC_DISPATCH(GradientCellsImpl)(at, orientation_rad, cells.data());
  return cells;
}

const char* SiftInstructionSet() { return HWY_DYNAMIC_DISPATCH(TargetName)(); }

}  // namespace dtr::sfm
#endif
