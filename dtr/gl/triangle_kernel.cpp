#include "dtr/gl/triangle_kernel.h"

#include <algorithm>

// The rest of this file is compiled once per instruction set; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "dtr/gl/triangle_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace dtr::gl::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::ScalableTag<float>;
using VF = hn::Vec<DF>;

int LaneCount() { return static_cast<int>(hn::Lanes(DF())); }

void DrawImpl(const SmallTriangle& t, float* row, int width_px) {
  const DF d;
  // Within the row, so that nothing of another thread's rows is read and written back.
  const int first = std::min(t.left, width_px - LaneCount());
  const VF x = hn::Iota(d, static_cast<float>(first) + 0.5f);
  const auto constant = [d](float value) { return hn::Set(d, value); };
  const auto asked = hn::And(hn::Gt(x, constant(static_cast<float>(t.left))),
                             hn::Lt(x, constant(static_cast<float>(t.right + 1))));
  VF across[3];  // what a pixel's column adds to a side's distance
  for (int k = 0; k < 3; ++k) {
    const SmallTriangle::Side& side = t.sides[k];
    across[k] =
        hn::MulAdd(constant(side.along_y), hn::Sub(x, constant(side.x)), constant(side.reach));
  }
  const VF w_across = hn::MulAdd(constant(t.along_x), hn::Sub(x, constant(t.x)), constant(t.w));
  float* pixels = row + first;
  for (int y = t.top; y <= t.bottom; ++y, pixels += width_px) {
    const float centre = static_cast<float>(y) + 0.5f;
    auto inside = asked;
    for (int k = 0; k < 3; ++k) {
      const SmallTriangle::Side& side = t.sides[k];
      inside = hn::And(inside, hn::Ge(constant(side.along_x * (centre - side.y)), across[k]));
    }
    const VF w = hn::Add(w_across, constant(t.along_y * (centre - t.y)));
    const VF kept = hn::Min(hn::Max(w, constant(t.farther)), constant(t.nearer));
    hn::StoreU(hn::Max(hn::LoadU(d, pixels), hn::IfThenElseZero(inside, kept)), d, pixels);
  }
}

}  // namespace dtr::gl::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace dtr::gl {

HWY_EXPORT(DrawImpl);
HWY_EXPORT(LaneCount);

int SmallTriangleWidth() { return HWY_DYNAMIC_DISPATCH(LaneCount)(); }

void DrawSmallTriangle(const SmallTriangle& triangle, float* row, int width_px) {
  HWY_DYNAMIC_DISPATCH(DrawImpl)(triangle, row, width_px);
}

}  // namespace dtr::gl
#endif
