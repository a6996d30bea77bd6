#include "dtr/gl/window_depth.h"

#include <algorithm>
#include <cassert>

// The rest of this file is compiled once per instruction set; the best one is chosen at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "dtr/gl/window_depth.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace dtr::gl::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using DF = hn::ScalableTag<float>;
using VF = hn::Vec<DF>;

// A depth buffer of 24 bits: the last step before the far plane. What is cleared to that plane must
// not hide a guess.
constexpr float kBeforeFar = 0.9999999f;

/// `farthest`: of what is seen 1; below that for guesses, which are never clipped.
HWY_INLINE VF Mapped(const WindowDepthMapping& m, VF z, VF farthest) {
  const DF d;
  const VF one = hn::Set(d, 1.0f), least = hn::Set(d, m.least);
  const VF device = hn::Add(hn::Set(d, m.at_infinity), hn::Div(hn::Set(d, m.per_inverse_depth), z));
  const VF inside = hn::Min(hn::Max(device, least), one);
  const VF share = hn::Min(hn::Mul(hn::Sub(inside, least), hn::Set(d, m.scale)), farthest);
  const VF window = hn::MulAdd(share, hn::Set(d, m.difference), hn::Set(d, m.near));
  auto drawn = hn::Gt(z, hn::Zero(d));
  if (!m.clamps) {
    drawn = hn::And(drawn, hn::Or(hn::Eq(inside, device), hn::Lt(farthest, one)));
  }
  return hn::IfThenElse(drawn, window, hn::Set(d, kNoWindowDepth));
}

void MapToWindowImpl(const WindowDepthMapping& mapping, const float* depth_z,
                     const std::uint8_t* guessed, size_t count, float* window_z) {
  const DF d;
  const size_t lanes = hn::Lanes(d);
  for (size_t p = 0; p < count; p += lanes) {
    const size_t some = std::min(lanes, count - p);
    HWY_ALIGN float z[hn::MaxLanes(d)] = {}, farthest[hn::MaxLanes(d)];
    VF most = hn::Set(d, 1.0f);
    if (guessed != nullptr) {
      std::fill_n(farthest, lanes, 1.0f);
      for (size_t i = 0; i < some; ++i) farthest[i] = guessed[p + i] != 0 ? kBeforeFar : 1.0f;
      most = hn::Load(d, farthest);
    }
    if (some == lanes) {
      hn::StoreU(Mapped(mapping, hn::LoadU(d, depth_z + p), most), d, window_z + p);
    } else {
      std::copy_n(depth_z + p, some, z);
      hn::Store(Mapped(mapping, hn::Load(d, z), most), d, z);
      std::copy_n(z, some, window_z + p);
    }
  }
}

}  // namespace dtr::gl::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace dtr::gl {

HWY_EXPORT(MapToWindowImpl);

void MapToWindow(const WindowDepthMapping& mapping, std::span<const float> depth_z,
                 std::span<const std::uint8_t> guessed, std::span<float> window_z) {
  assert(window_z.size() == depth_z.size());
  assert(guessed.empty() || guessed.size() == depth_z.size());
  HWY_DYNAMIC_DISPATCH(MapToWindowImpl)
  (mapping, depth_z.data(), guessed.empty() ? nullptr : guessed.data(), depth_z.size(),
   window_z.data());
}

}  // namespace dtr::gl
#endif
