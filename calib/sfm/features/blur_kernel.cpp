#include "calib/sfm/features/blur_kernel.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "calib/sfm/features/row_store.h"

// The rest of this file is compiled once per instruction set; the best one is chosen at run time.
// Products are added one by one, never with FMA: every instruction set gives the same bits.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "calib/sfm/features/blur_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace dtr::sfm::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::CappedTag<float, 16>;
using VF = hn::Vec<DF>;

constexpr int kLanes = static_cast<int>(hn::MaxLanes(DF()));
constexpr int kGroup = 4 * kLanes;  // columns at a time: four sums hide the time an addition takes
constexpr int kTileColumns = 128;   // of kBlurRows + 2 * kMaxBlurRadius rows: fits the first cache
static_assert(RowStore::kRowUnit % kGroup == 0 && kTileColumns % kGroup == 0);

struct Sums {
  VF a, b, c, e;
};

HWY_INLINE Sums Centre(const float* p, VF weight) {
  const DF d;
  return {hn::Mul(weight, hn::LoadU(d, p)), hn::Mul(weight, hn::LoadU(d, p + kLanes)),
          hn::Mul(weight, hn::LoadU(d, p + 2 * kLanes)),
          hn::Mul(weight, hn::LoadU(d, p + 3 * kLanes))};
}

HWY_INLINE void AddPair(const float* p, const float* q, VF weight, Sums* sums) {
  const DF d;
  const auto pair = [&](int at) { return hn::Add(hn::LoadU(d, p + at), hn::LoadU(d, q + at)); };
  sums->a = hn::Add(sums->a, hn::Mul(weight, pair(0)));
  sums->b = hn::Add(sums->b, hn::Mul(weight, pair(kLanes)));
  sums->c = hn::Add(sums->c, hn::Mul(weight, pair(2 * kLanes)));
  sums->e = hn::Add(sums->e, hn::Mul(weight, pair(3 * kLanes)));
}

HWY_INLINE void StoreSums(const Sums& sums, float* out) {
  const DF d;
  hn::StoreU(sums.a, d, out);
  hn::StoreU(sums.b, d, out + kLanes);
  hn::StoreU(sums.c, d, out + 2 * kLanes);
  hn::StoreU(sums.e, d, out + 3 * kLanes);
}

/// A symmetric filter of odd length around `at(0)`; `at(i)` is where the values at distance i are.
template <typename At>
HWY_INLINE Sums FilterOdd(const Taps& taps, const At& at) {
  const DF d;
  Sums sums = Centre(at(0), hn::Set(d, taps.weight[0]));
  for (int i = 1; i <= taps.radius; ++i) {
    AddPair(at(-i), at(i), hn::Set(d, taps.weight[static_cast<size_t>(i)]), &sums);
  }
  return sums;
}

/// One of even length, around the middle of `at(0)` and `at(1)`.
template <typename At>
HWY_INLINE Sums FilterEven(const Taps& taps, const At& at) {
  const DF d;
  const VF zero = hn::Zero(d);
  Sums sums{zero, zero, zero, zero};
  for (int i = 0; i < taps.radius; ++i) {
    AddPair(at(-i), at(i + 1), hn::Set(d, taps.weight[static_cast<size_t>(i)]), &sums);
  }
  return sums;
}

HWY_INLINE void RepeatBorders(float* row, int width) {
  std::fill_n(row - BlurScratch::kPad, BlurScratch::kPad, row[0]);
  std::fill_n(row + width, BlurScratch::kPad, row[width - 1]);
}

void BlurRowsImpl(const float* const* rows, int count, int width, const Taps& taps,
                  BlurScratch* scratch, float* const* out) {
  for (int tile = 0; tile < width; tile += kTileColumns) {
    const int end = std::min(width, tile + kTileColumns);
    for (int r = 0; r < count; ++r) {
      const float* const* centre = rows + r + taps.radius;
      for (int x = tile; x < end; x += kGroup) {
        StoreSums(FilterOdd(taps, [&](int i) { return centre[i] + x; }), scratch->row(r) + x);
      }
    }
  }
  for (int r = 0; r < count; ++r) {
    float* row = scratch->row(r);
    RepeatBorders(row, width);
    for (int x = 0; x < width; x += kGroup) {
      StoreSums(FilterOdd(taps, [&](int i) { return row + x + i; }), out[r] + x);
    }
  }
}

void DoubleRowImpl(const float* const* rows, int phase, int width, const DoublingTaps& taps,
                   BlurScratch* scratch, float* out) {
  const DF d;
  float* row = scratch->row(0);
  const float* const* centre = rows + taps.even.radius;
  for (int x = 0; x < width; x += kGroup) {
    const auto at = [&](int i) { return centre[i] + x; };
    StoreSums(phase == 0 ? FilterOdd(taps.even, at) : FilterEven(taps.odd, at), row + x);
  }
  RepeatBorders(row, width);
  float* halves = scratch->row(1);
  for (int x = 0; x < width; x += kGroup) {
    const auto at = [&](int i) { return row + x + i; };
    StoreSums(FilterOdd(taps.even, at), halves);
    StoreSums(FilterEven(taps.odd, at), halves + kGroup);
    // The last group may hold more columns than the row has memory for.
    for (int i = 0; i < kGroup && x + i < width; i += kLanes) {
      hn::StoreInterleaved2(hn::LoadU(d, halves + i), hn::LoadU(d, halves + kGroup + i), d,
                            out + 2 * (x + i));
    }
  }
}

void SubtractRowImpl(const float* a, const float* b, int width, float* out) {
  const DF d;
  for (int x = 0; x < width; x += kLanes) {
    hn::StoreU(hn::Sub(hn::LoadU(d, b + x), hn::LoadU(d, a + x)), d, out + x);
  }
}

}  // namespace dtr::sfm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace dtr::sfm {

HWY_EXPORT(BlurRowsImpl);
HWY_EXPORT(DoubleRowImpl);
HWY_EXPORT(SubtractRowImpl);

namespace {

/// Standard deviations at which a Gaussian is cut off.
constexpr double kCutOff = 3.5;

}  // namespace

Taps GaussianTaps(double sigma) {
  Taps taps;
  taps.radius = static_cast<int>(std::ceil(kCutOff * sigma));
  assert(sigma > 0 && taps.radius <= kMaxBlurRadius);
  std::array<double, kMaxBlurRadius + 1> weight{};
  double sum = 0;
  for (int i = 0; i <= taps.radius; ++i) {
    const double w = std::exp(-0.5 * i * i / (sigma * sigma));
    weight[static_cast<size_t>(i)] = w;
    sum += i == 0 ? w : 2 * w;
  }
  for (size_t i = 0; i < weight.size(); ++i) taps.weight[i] = static_cast<float>(weight[i] / sum);
  return taps;
}

DoublingTaps LinearDoublingTaps(double sigma) {
  const Taps gaussian = GaussianTaps(sigma);
  const auto weight = [&](int i) {  // of the doubled image's sample at distance i
    return i < -gaussian.radius || i > gaussian.radius
               ? 0.0f
               : gaussian.weight[static_cast<size_t>(std::abs(i))];
  };
  // A pixel is in its own sample, and by half in both that lie between it and its neighbours.
  const auto share = [&](int i) { return weight(i) + 0.5f * (weight(i - 1) + weight(i + 1)); };
  DoublingTaps taps;
  taps.even.radius = taps.odd.radius = (gaussian.radius + 2) / 2;
  for (int i = 0; i <= taps.even.radius; ++i) {
    taps.even.weight[static_cast<size_t>(i)] = share(2 * i);
    taps.odd.weight[static_cast<size_t>(i)] = share(2 * i + 1);
  }
  return taps;
}

BlurScratch::BlurScratch(int width)
    : stride_(static_cast<size_t>((width + RowStore::kRowUnit - 1) / RowStore::kRowUnit *
                                      RowStore::kRowUnit +
                                  2 * kPad + RowStore::kRowUnit)),
      values_(stride_ * kBlurRows) {}

void BlurRows(const float* const* rows, int count, int width, const Taps& taps,
              BlurScratch* scratch, float* const* out) {
  HWY_DYNAMIC_DISPATCH(BlurRowsImpl)(rows, count, width, taps, scratch, out);
}
void DoubleRow(const float* const* rows, int phase, int width, const DoublingTaps& taps,
               BlurScratch* scratch, float* out) {
  HWY_DYNAMIC_DISPATCH(DoubleRowImpl)(rows, phase, width, taps, scratch, out);
}
void SubtractRow(const float* a, const float* b, int width, float* out) {
  HWY_DYNAMIC_DISPATCH(SubtractRowImpl)(a, b, width, out);
}

}  // namespace dtr::sfm
#endif
