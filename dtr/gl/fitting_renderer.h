// dtr/gl/fitting_renderer.h -- draws into a window's context with whatever is fast there: OpenGL on
// a GPU, dtr/simd where the context's driver draws on the processor itself.
#pragma once
#include <memory>
#include <optional>

#include "dtr/gl/renderer.h"
#include "dtr/simd/renderer.h"

namespace dtr::gl {

/// Who draws the deferred method; two passes are drawn by OpenGL.
enum class Drawer {
  kFitting,  ///< dtr/simd where the driver draws on the processor, else OpenGL
  kOpenGl,
  kSimd,
};

/// gl::Renderer and simd::Renderer in one. What the second drew lies in memory
/// (DrawnFrame::rgba), for gl::Compositor or for a texture of the caller's. Belongs to the
/// context it was made with.
class FittingRenderer {
 public:
  /// Throws as gl::Renderer. `settings.gpu_bytes` holds for both.
  explicit FittingRenderer(const RendererSettings& settings = {}, Drawer drawer = Drawer::kFitting);

  /// As gl::Renderer. `mapping`: images in memory get window_z, too.
  RenderResult Render(const RenderScene& scene, const PinholeCamera& novel,
                      const Pose& novel_from_world, const RenderOptions& options);
  DrawnFrame Draw(const RenderScene& scene, const PinholeCamera& novel,
                  const Pose& novel_from_world, const RenderOptions& options,
                  const std::optional<simd::WindowDepthMapping>& mapping = std::nullopt);
  RenderResult ReadBack();
  void Forget();

  /// As simd::Renderer; OpenGL needs the pixels of all views.
  bool CanDraw(const RenderScene& scene, const PinholeCamera& novel, const Pose& novel_from_world,
               const RenderOptions& options) const;

  /// What draws by OpenGL alone.
  Renderer& open_gl() { return open_gl_; }

 private:
  bool BySimd(const RenderOptions& options) const {
    return prefers_simd_ && simd::Renderer::Draws(options);
  }

  Renderer open_gl_;
  simd::Renderer simd_;
  const bool prefers_simd_;
  bool drawn_by_simd_ = false;
};

}  // namespace dtr::gl
