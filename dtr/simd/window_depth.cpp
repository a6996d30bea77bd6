#include "dtr/simd/window_depth.h"

#include <algorithm>
#include <cassert>

// The rest of this file is compiled once per instruction set; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "dtr/simd/window_depth.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace dtr::simd::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::ScalableTag<float>;
using VF = hn::Vec<DF>;

// More than one step of a depth buffer of 24 bits. What is cleared to the far plane, which a
// reversed projection has at 0, must not hide a filled pixel.
constexpr float kLastStep = 1.2e-7f;

/// `inset`: how far from window z 0 and 1 a depth must lie; of what is seen 0, above that for
/// filled pixels, which are never clipped.
HWY_INLINE VF Mapped(const WindowDepthMapping& m, VF z, VF inset) {
  const DF d;
  const VF zero = hn::Zero(d), one = hn::Set(d, 1.0f), least = hn::Set(d, m.least);
  const VF device = hn::Add(hn::Set(d, m.at_infinity), hn::Div(hn::Set(d, m.per_inverse_depth), z));
  const VF inside = hn::Min(hn::Max(device, least), one);
  const VF linear = hn::Mul(hn::Sub(inside, least), hn::Set(d, m.scale));
  const VF share = hn::Min(hn::Max(linear, inset), hn::Sub(one, inset));
  const VF window = hn::MulAdd(share, hn::Set(d, m.difference), hn::Set(d, m.near));
  auto drawn = hn::Gt(z, zero);
  if (!m.clamps) drawn = hn::And(drawn, hn::Or(hn::Eq(inside, device), hn::Gt(inset, zero)));
  return hn::IfThenElse(drawn, window, hn::Set(d, kNoWindowDepth));
}

void MapToWindowImpl(const WindowDepthMapping& mapping, const float* depth_z,
                     const std::uint8_t* filled, size_t count, float* window_z) {
  const DF d;
  const size_t lanes = hn::Lanes(d);
  for (size_t p = 0; p < count; p += lanes) {
    const size_t some = std::min(lanes, count - p);
    HWY_ALIGN float z[hn::MaxLanes(d)] = {}, insets[hn::MaxLanes(d)] = {};
    VF inset = hn::Zero(d);
    if (filled != nullptr) {
      for (size_t i = 0; i < some; ++i) insets[i] = filled[p + i] != 0 ? kLastStep : 0.0f;
      inset = hn::Load(d, insets);
    }
    if (some == lanes) {
      hn::StoreU(Mapped(mapping, hn::LoadU(d, depth_z + p), inset), d, window_z + p);
    } else {
      std::copy_n(depth_z + p, some, z);
      hn::Store(Mapped(mapping, hn::Load(d, z), inset), d, z);
      std::copy_n(z, some, window_z + p);
    }
  }
}

}  // namespace dtr::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace dtr::simd {

HWY_EXPORT(MapToWindowImpl);

void MapToWindow(const WindowDepthMapping& mapping, std::span<const float> depth_z,
                 std::span<const std::uint8_t> filled, std::span<float> window_z) {
  assert(window_z.size() == depth_z.size());
  assert(filled.empty() || filled.size() == depth_z.size());
  HWY_DYNAMIC_DISPATCH(MapToWindowImpl)
  (mapping, depth_z.data(), filled.empty() ? nullptr : filled.data(), depth_z.size(),
   window_z.data());
}

}  // namespace dtr::simd
#endif
