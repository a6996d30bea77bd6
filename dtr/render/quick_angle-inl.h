// dtr/render/quick_angle-inl.h -- QuickAngle of geometry.h for several angles at once, to the same
// bits. Compiled per instruction set: include only from kernels of dtr/render.
#if defined(DTR_RENDER_QUICK_ANGLE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DTR_RENDER_QUICK_ANGLE_INL_H_
#undef DTR_RENDER_QUICK_ANGLE_INL_H_
#else
#define DTR_RENDER_QUICK_ANGLE_INL_H_
#endif

HWY_BEFORE_NAMESPACE();
namespace dtr::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using DD = hn::ScalableTag<double>;
using VD = hn::Vec<DD>;
using MD = hn::Mask<DD>;
constexpr size_t kLanes = hn::MaxLanes(DD());

HWY_INLINE VD QuickAngles(VD cross_length, VD dot) {
  const DD d;
  const VD zero = hn::Zero(d), side = hn::Abs(dot);
  const VD longer = hn::Max(cross_length, side);
  const VD x = hn::Div(hn::Min(cross_length, side), longer), q = hn::Mul(x, x);
  VD series = hn::Set(d, kQuickAngleSeries[0]);
  for (size_t i = 1; i < std::size(kQuickAngleSeries); ++i) {
    series = hn::Add(hn::Set(d, kQuickAngleSeries[i]), hn::Mul(q, series));
  }
  VD angle = hn::Mul(x, series);
  angle = hn::IfThenElse(hn::Gt(cross_length, side),
                         hn::Sub(hn::Set(d, std::numbers::pi / 2), angle), angle);
  angle = hn::IfThenElse(hn::Lt(dot, zero), hn::Sub(hn::Set(d, std::numbers::pi), angle), angle);
  return hn::IfThenElseZero(hn::Gt(longer, zero), angle);
}

}  // namespace dtr::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
