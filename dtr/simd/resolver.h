// dtr/simd/resolver.h -- the deferred method's pass over the pixels. Only dtr/simd's own .cpp files
// include this.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "dtr/render/frame.h"
#include "dtr/render/result.h"
#include "dtr/simd/pixel_kernel.h"
#include "dtr/simd/sampled_views.h"
#include "dtr/simd/window_depth.h"

namespace dtr::simd {

/// SPEC 4.2 to 4.8, 5.2, 5.3 and 6 for the pixels of a band.
class Resolver {
 public:
  /// Into memory of its own, which holds the band until the next call; `surface`: SPEC 5.1, 1/z of
  /// the band's pixels. The views must have been sampled. With a
  /// `mapping` it makes window_z, too.
  void Draw(const RenderFrame& frame, const Band& band, const SampledViews& sampled,
            const std::vector<float>& surface, const std::optional<WindowDepthMapping>& mapping);

  /// SPEC 6: the band into its rows of `result`, which has the rendered image's size.
  void CopyTo(RenderResult& result) const;
  /// The band as it lies in memory: DrawnImage::rgba, depth_z and window_z.
  const std::uint32_t* rgba() const { return image_.data(); }
  const float* depth_z() const { return depth_.data(); }
  const float* window_z() const { return window_.data(); }

 private:
  int width_px_ = 0;
  Band band_;
  std::vector<std::uint32_t> image_, marks_;
  std::vector<float> depth_, window_;
};

}  // namespace dtr::simd
