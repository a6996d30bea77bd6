#include "dtr/render/hole_cost.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <limits>
#include <numbers>

#include "dtr/render/geometry.h"

// The rest of this file is compiled once per instruction set; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "dtr/render/hole_cost.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
// After highway.h.
#include "dtr/render/quick_angle-inl.h"

HWY_BEFORE_NAMESPACE();
namespace dtr::HWY_NAMESPACE {

// Products and sums apart, never fused: images are the same on every processor.
using DF = hn::Rebind<float, DD>;
using DI = hn::Rebind<std::int32_t, DD>;

constexpr float kOneViewCost = 20;
constexpr size_t kViewsCompared = 4;
constexpr double kAngleFloor = 0.02;  // radians: nearer views are all alike
constexpr double kNoView = std::numeric_limits<double>::infinity();

/// What the views that look from nearest show, a slot per view; nearest first.
struct Answers {
  VD angle[kViewsCompared], rgb[kViewsCompared][3];
  VD count;

  Answers() : count(hn::Zero(DD())) {
    for (size_t s = 0; s < kViewsCompared; ++s) {
      angle[s] = hn::Set(DD(), kNoView);
      for (VD& level : rgb[s]) level = hn::Zero(DD());
    }
  }
  /// Views at equal angles stay in the order in which they came.
  HWY_INLINE void Add(MD answers, VD at_angle, const VD* shown) {
    const DD d;
    count = hn::Add(count, hn::IfThenElseZero(answers, hn::Set(d, 1)));
    VD a = hn::IfThenElse(answers, at_angle, hn::Set(d, kNoView));
    VD colour[3];
    for (size_t c = 0; c < 3; ++c) colour[c] = hn::IfThenElseZero(answers, shown[c]);
    for (size_t s = 0; s < kViewsCompared; ++s) {
      const MD before = hn::Lt(a, angle[s]);
      const VD later = hn::IfThenElse(before, angle[s], a);
      angle[s] = hn::IfThenElse(before, a, angle[s]);
      a = later;
      for (size_t c = 0; c < 3; ++c) {
        const VD kept = hn::IfThenElse(before, colour[c], rgb[s][c]);
        colour[c] = hn::IfThenElse(before, rgb[s][c], colour[c]);
        rgb[s][c] = kept;
      }
    }
  }

  /// Twice the weighted mean distance of the colours from their weighted mean. Empty slots weigh
  /// nothing: their angle is infinite.
  HWY_INLINE VD Disagreement() const {
    const DD d;
    const VD floor = hn::Set(d, kAngleFloor), three = hn::Set(d, 3);
    VD weights = hn::Zero(d), mean[3] = {weights, weights, weights};
    for (size_t s = 0; s < kViewsCompared; ++s) {
      const VD weight = hn::Div(hn::Set(d, 1), hn::Add(angle[s], floor));
      weights = hn::Add(weights, weight);
      for (size_t c = 0; c < 3; ++c) mean[c] = hn::Add(mean[c], hn::Mul(weight, rgb[s][c]));
    }
    for (VD& level : mean) level = hn::Div(level, weights);
    VD distance = hn::Zero(d);
    for (size_t s = 0; s < kViewsCompared; ++s) {
      const VD away = hn::Add(angle[s], floor);
      for (size_t c = 0; c < 3; ++c) {
        const VD off = hn::Abs(hn::Sub(rgb[s][c], mean[c]));
        distance = hn::Add(distance, hn::Div(hn::Div(off, away), three));
      }
    }
    return hn::Div(hn::Mul(hn::Set(d, 2), distance), weights);
  }
};

/// Bilinear between the cells around the lanes' pixels. Of lanes whose cells are not all usable
/// nothing is known but that they are not.
HWY_INLINE MD ColoursAt(const CostView& view, int cell_px, VD x, VD y, MD asked, VD* rgb) {
  const DD d;
  const DI di;
  const VD half = hn::Set(d, 0.5), zero = hn::Zero(d), cell = hn::Set(d, cell_px);
  const VD u =
      hn::Min(hn::Max(hn::Sub(hn::Div(x, cell), half), zero), hn::Set(d, view.cell_columns - 1.0));
  const VD v =
      hn::Min(hn::Max(hn::Sub(hn::Div(y, cell), half), zero), hn::Set(d, view.cell_rows - 1.0));
  const auto left = hn::DemoteTo(di, u), above = hn::DemoteTo(di, v);
  HWY_ALIGN std::int32_t column[kLanes], row[kLanes];
  HWY_ALIGN float share_x[kLanes], share_y[kLanes], shown[3][kLanes] = {};
  float mixed[4];
  HWY_ALIGN double wanted[kLanes], usable[kLanes] = {};
  hn::Store(left, di, column);
  hn::Store(above, di, row);
  hn::Store(hn::DemoteTo(DF(), hn::Sub(u, hn::PromoteTo(d, left))), DF(), share_x);
  hn::Store(hn::DemoteTo(DF(), hn::Sub(v, hn::PromoteTo(d, above))), DF(), share_y);
  hn::Store(hn::IfThenElseZero(asked, hn::Set(d, 1)), d, wanted);
  for (size_t lane = 0; lane < kLanes; ++lane) {
    if (wanted[lane] == 0) continue;
    const int x0 = column[lane], y0 = row[lane];
    const int x1 = std::min(x0 + 1, view.cell_columns - 1);
    const int y1 = std::min(y0 + 1, view.cell_rows - 1);
    const auto at = [&](int i, int j) {
      return view.cells + 4 * (static_cast<std::ptrdiff_t>(j) * view.cell_columns + i);
    };
    const float *a = at(x0, y0), *b = at(x1, y0), *c = at(x0, y1), *e = at(x1, y1);
    if (a[3] == 0 || b[3] == 0 || c[3] == 0 || e[3] == 0) continue;
    usable[lane] = 1;
    const float fx = share_x[lane], fy = share_y[lane], gx = 1 - fx, gy = 1 - fy;
    for (size_t channel = 0; channel < 4; ++channel) {  // all of a cell's floats: one vector
      mixed[channel] =
          gy * (gx * a[channel] + fx * b[channel]) + fy * (gx * c[channel] + fx * e[channel]);
    }
    for (size_t channel = 0; channel < 3; ++channel) shown[channel][lane] = mixed[channel];
  }
  for (size_t channel = 0; channel < 3; ++channel) {
    rgb[channel] = hn::PromoteTo(d, hn::Load(DF(), shown[channel]));
  }
  return hn::Gt(hn::Load(d, usable), zero);
}

/// The depth that the view measured at the lanes' pixels.
HWY_INLINE VD DepthsAt(const CostView& view, VD x, VD y, MD asked) {
  const DD d;
  const DI di;
  VD column = hn::IfThenElseZero(asked, x), row = hn::IfThenElseZero(asked, y);
  if (view.depth_scale != 1) {
    const VD scale = hn::Set(d, view.depth_scale);
    column = hn::Div(hn::Floor(column), scale), row = hn::Div(hn::Floor(row), scale);
  }
  const auto index = hn::Add(hn::Mul(hn::DemoteTo(di, row), hn::Set(di, view.depth_columns)),
                             hn::DemoteTo(di, column));
  return hn::PromoteTo(d, hn::GatherIndex(DF(), view.depth, index));
}

HWY_INLINE void CostsOfLanes(const CostPlace& place, std::span<const CostView> views, VD w,
                             float* costs) {
  const DD d;
  const VD zero = hn::Zero(d), one = hn::Set(d, 1);
  const auto set = [d](double value) { return hn::Set(d, value); };
  const VD ray[3] = {set(place.ray[0]), set(place.ray[1]), set(place.ray[2])};
  Answers answers;
  VD asked = zero, through = zero;
  for (const CostView& view : views) {
    VD p[3], c[3];
    for (size_t i = 0; i < 3; ++i) {
      p[i] =
          hn::Add(set(view.pixel_at_infinity[i]), hn::Mul(w, set(view.pixel_per_inverse_depth[i])));
      c[i] = hn::Mul(w, set(view.centre[i]));
    }
    const VD x = hn::Div(p[0], p[2]), y = hn::Div(p[1], p[2]);
    const MD inside = hn::And(hn::And(hn::Ge(x, zero), hn::Lt(x, set(view.width_px))),
                              hn::And(hn::Ge(y, zero), hn::Lt(y, set(view.height_px))));
    const MD on = hn::And(hn::Gt(p[2], zero), inside);
    if (hn::AllFalse(d, on)) continue;
    VD across = zero, along = zero;
    for (size_t i = 0; i < 3; ++i) {
      const size_t j = (i + 1) % 3, k = (i + 2) % 3;
      const VD side = hn::Sub(hn::Mul(c[j], ray[k]), hn::Mul(c[k], ray[j]));
      const VD square = hn::Mul(side, side), product = hn::Mul(c[i], ray[i]);
      across = i == 0 ? square : hn::Add(across, square);
      along = i == 0 ? product : hn::Add(along, product);
    }
    const VD angle = QuickAngles(hn::Sqrt(across), hn::Sub(set(place.ray_squared), along));
    const VD say = hn::IfThenElseZero(on, hn::Div(one, hn::Add(angle, set(kAngleFloor))));
    asked = hn::Add(asked, say);
    const VD measured = DepthsAt(view, x, y, on);
    const MD surface = hn::Gt(measured, zero);
    const VD nearer = hn::Sub(hn::Div(one, measured), hn::Div(w, p[2]));
    const MD behind = hn::And(surface, hn::Lt(nearer, set(-view.tolerance)));
    through = hn::Add(through, hn::IfThenElseZero(behind, say));
    const MD other = hn::And(surface, hn::Gt(hn::Abs(nearer), set(view.tolerance)));
    const MD may_answer = hn::AndNot(other, on);
    if (hn::AllFalse(d, may_answer)) continue;
    VD rgb[3];
    const MD usable = ColoursAt(view, place.cell_px, x, y, may_answer, rgb);
    answers.Add(hn::And(may_answer, usable), angle, rgb);
  }
  HWY_ALIGN double counts[kLanes], differences[kLanes], seen_through[kLanes], says[kLanes];
  hn::Store(answers.count, d, counts);
  hn::Store(answers.Disagreement(), d, differences);
  hn::Store(hn::Div(through, asked), d, seen_through);
  hn::Store(asked, d, says);
  for (size_t lane = 0; lane < kLanes; ++lane) {
    float cost = kMaxHoleCost;
    if (counts[lane] == 1) cost = kOneViewCost;
    if (counts[lane] > 1) cost = std::min(kMaxHoleCost, static_cast<float>(differences[lane]));
    if (says[lane] > 0) cost += kMaxHoleCost * static_cast<float>(seen_through[lane]);
    costs[lane] = cost;
  }
}

void HoleCostsImpl(const CostPlace& place, std::span<const CostView> views,
                   std::span<const double> inverse_depths, float* costs) {
  const DD d;
  for (size_t i = 0; i < inverse_depths.size(); i += kLanes) {
    HWY_ALIGN double w[kLanes];
    HWY_ALIGN float found[kLanes];
    const size_t count = std::min(kLanes, inverse_depths.size() - i);
    std::fill_n(w, kLanes, inverse_depths[i]);
    std::copy_n(inverse_depths.begin() + static_cast<std::ptrdiff_t>(i), count, w);
    CostsOfLanes(place, views, hn::Load(d, w), found);
    std::copy_n(found, count, costs + i);
  }
}

}  // namespace dtr::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace dtr {

HWY_EXPORT(HoleCostsImpl);

void HoleCosts(const CostPlace& place, std::span<const CostView> views,
               std::span<const double> inverse_depths, float* costs) {
  HWY_DYNAMIC_DISPATCH(HoleCostsImpl)(place, views, inverse_depths, costs);
}

}  // namespace dtr
#endif
