// dtr/gl/processor_resolve.h -- the deferred method's pass over the pixels on the CPU, for drivers
// that draw on the CPU themselves. Only dtr/gl's own .cpp files include this.
#pragma once
#include <cstdint>
#include <vector>

#include "dtr/gl/drawing.h"
#include "dtr/gl/frame.h"
#include "dtr/gl/pixel_kernel.h"
#include "dtr/gl/sampled_views.h"

namespace dtr::gl {

/// What Resolver draws for most frames of the deferred method, several times as fast as a software
/// rasteriser runs Resolver's shader; both are held to the reference by the same tests.
class ProcessorResolver {
 public:
  /// False for frames that it does not draw: two passes, the per-pixel rule, linear light, the
  /// report's absolute Delta, weights out of float32's reach, more views than kMostPixelViews.
  static bool Draws(const Frame& frame);

  /// As Resolver::Draw; `surface`: SPEC 5.1, 1/z of the band's pixels. The views must have been
  /// sampled.
  void Draw(const Frame& frame, const Band& band, const SampledViews& sampled,
            const Targets& targets, const std::vector<float>& surface);

 private:
  std::vector<std::uint32_t> image_, marks_;
  std::vector<float> depth_;
};

}  // namespace dtr::gl
