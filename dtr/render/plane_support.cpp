#include "dtr/render/plane_support.h"

#include <cmath>

// The rest of this file is compiled once per instruction set; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "dtr/render/plane_support.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace dtr::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using DD = hn::ScalableTag<double>;

// Products and sums apart, never fused: a sample must not lie on a plane on one machine only.
size_t PlaneSupportImpl(const PlaneSamples& samples, double a, double b, double c,
                        double tolerance) {
  const DD d;
  const size_t lanes = hn::Lanes(d), whole = samples.size() / lanes * lanes;
  const double *x = samples.x.data(), *y = samples.y.data(), *w = samples.inverse_depth.data();
  const auto va = hn::Set(d, a), vb = hn::Set(d, b), vc = hn::Set(d, c);
  const auto vtolerance = hn::Set(d, tolerance);
  size_t count = 0;
  for (size_t i = 0; i < whole; i += lanes) {
    const auto ax = hn::Mul(va, hn::LoadU(d, x + i)), by = hn::Mul(vb, hn::LoadU(d, y + i));
    const auto off = hn::Sub(hn::Add(hn::Add(ax, by), vc), hn::LoadU(d, w + i));
    count += hn::CountTrue(d, hn::Le(hn::Abs(off), vtolerance));
  }
  for (size_t i = whole; i < samples.size(); ++i) {
    count += std::abs(a * x[i] + b * y[i] + c - w[i]) <= tolerance ? 1 : 0;
  }
  return count;
}

}  // namespace dtr::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace dtr {

HWY_EXPORT(PlaneSupportImpl);

size_t PlaneSupport(const PlaneSamples& samples, double a, double b, double c, double tolerance) {
  return HWY_DYNAMIC_DISPATCH(PlaneSupportImpl)(samples, a, b, c, tolerance);
}

}  // namespace dtr
#endif
