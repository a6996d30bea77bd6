// dtr/gl/compositor.h -- a drawn image among what a host draws itself; no GL header is needed to
// use it.
#pragma once
#include <memory>
#include <string>

#include "dtr/gl/renderer.h"
#include "dtr/render/result.h"

namespace dtr::gl {

/// The rectangle that is drawn to, in pixels of the framebuffer; y counts from the bottom.
struct Viewport {
  int x = 0, y = 0, width = 0, height = 0;
};
/// GL_VIEWPORT of the current context.
Viewport CurrentViewport();

/// How a host's perspective projection turns depth into z of normalised device coordinates:
/// device z = at_infinity + per_inverse_depth / z, z the plane z of an image in scene units.
/// For glFrustum's matrix P, column vectors and a modelview of scale s: -P(2,2) and P(2,3) / s.
struct DepthProjection {
  double at_infinity = 1, per_inverse_depth = 0;
};

/// How the current context's state (glDepthRange, glClipControl, GL_DEPTH_CLAMP) and a host's
/// projection map depth: for FittingRenderer::Draw, just before the image is composited.
simd::WindowDepthMapping CurrentMapping(const DepthProjection& projection);

/// Draws images into the framebuffer that the current context draws to, pixel for pixel over its
/// viewport, with depth: the host's depth test, its mask, blending, scissor, stencil and colour
/// mask hold for them as for anything else. Pixels of which the image has nothing are left as
/// they are. All state is left as it was. Belongs to the context it was made with, as gl::Renderer.
class Compositor {
 public:
  /// Empty `shader_folder`: the embedded shaders.
  explicit Compositor(std::string shader_folder = {});
  ~Compositor();
  Compositor(const Compositor&) = delete;
  Compositor& operator=(const Compositor&) = delete;

  /// `image` fills the viewport, whatever its size (nearest pixels). It is cut at the host's near
  /// and far planes as other surfaces are. Colours are written as they are: sRGB values, also where
  /// GL_FRAMEBUFFER_SRGB is on. One that is composited again is not brought to the GPU again.
  void Composite(const DrawnFrame& picture, const DepthProjection& projection);

  /// An image from memory, holding until the next one is taken.
  DrawnFrame Take(const RenderResult& result);
  /// The same of an image whose holes were filled; `depth` is what FillHoles gave. What is filled
  /// is never cut, so that no hole is left: beyond the host's near or far plane it lies just
  /// within it.
  DrawnFrame TakeFilled(const RenderResult& result, const Grid<float>& depth);

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace dtr::gl
