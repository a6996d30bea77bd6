// dtr/gl/processor_resolve.h -- the deferred method's pass over the pixels on the CPU, for drivers
// that draw on the CPU themselves. Only dtr/gl's own .cpp files include this.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "dtr/gl/drawing.h"
#include "dtr/gl/frame.h"
#include "dtr/gl/pixel_kernel.h"
#include "dtr/gl/sampled_views.h"
#include "dtr/gl/window_depth.h"
#include "dtr/render/result.h"

namespace dtr::gl {

/// What Resolver draws for most frames of the deferred method, several times as fast as a software
/// rasteriser runs Resolver's shader; both are held to the reference by the same tests.
class ProcessorResolver {
 public:
  /// False for frames that it does not draw: two passes, the per-pixel rule, linear light, the
  /// report's absolute Delta, weights out of float32's reach, more views than kMaxPixelViews.
  static bool Draws(const Frame& frame);

  /// As Resolver::Draw, but into memory of its own, which holds the band until the next call;
  /// `surface`: SPEC 5.1, 1/z of the band's pixels. The views must have been sampled. With a
  /// `mapping` it makes window_z, too.
  void Draw(const Frame& frame, const Band& band, const SampledViews& sampled,
            const std::vector<float>& surface, const std::optional<WindowDepthMapping>& mapping);

  /// SPEC 6: the band into its rows of `result`, which has the image's size.
  void CopyTo(RenderResult& result) const;
  /// The band into the textures of `targets`, which fit it.
  void Upload(const Targets& targets) const;
  /// The band as it lies in memory: DrawnPicture::rgba, depth_z and window_z.
  const std::uint32_t* rgba() const { return image_.data(); }
  const float* depth_z() const { return depth_.data(); }
  const float* window_z() const { return window_.data(); }

 private:
  int width_px_ = 0;
  Band band_;
  std::vector<std::uint32_t> image_, marks_;
  std::vector<float> depth_, window_;
};

}  // namespace dtr::gl
