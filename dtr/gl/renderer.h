// dtr/gl/renderer.h -- RENDER_SPEC with OpenGL 4.3; no GL header is needed to use it.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "dtr/render/options.h"
#include "dtr/render/result.h"
#include "dtr/render/scene.h"
#include "dtr/simd/window_depth.h"
#include "dtr/types/camera.h"
#include "dtr/types/pose.h"

namespace dtr::gl {

/// What does not change the image, beyond the last digits.
struct RendererSettings {
  /// Where shaders come from, for development; empty: from the program itself.
  std::string shader_folder;
  /// Memory for the views' fragments; an image that needs more is drawn in bands of rows.
  size_t layer_bytes = size_t{256} << 20;
  /// Memory for the views themselves. Those drawn longest ago make room for others; where one
  /// image's do not fit, it is drawn from the nearest that do, and `warn` gets one line.
  size_t gpu_bytes = 4'000'000'000;
  /// Told of what the image goes without, a line each, on the thread that draws.
  std::function<void(const std::string&)> warn = [](const std::string&) {};
  /// Leave unused what the driver has beyond OpenGL 4.3, as on one that has no more.
  bool only_opengl_43 = false;
  /// Take its storage blocks for no larger than this, as on one that has smaller ones.
  size_t max_storage_bytes = SIZE_MAX;
};

/// An image that was drawn and lies on the GPU: names of GL_TEXTURE_2D_ARRAY textures of one layer
/// that belong to the renderer and hold the image until its next call. Row 0 is the top row. A
/// FittingRenderer's may lie in its memory instead, as long: then there are no textures (0).
struct DrawnFrame {
  unsigned image = 0;  ///< RGBA8, sRGB values; alpha 1 where some view saw the pixel, else 0
  unsigned depth = 0;  ///< R32F, plane z in scene units; 0 where unseen
  unsigned marks = 0;  ///< RGBA8UI: views blended; 255 at the Delta border (SPEC 6.2)
  const std::uint32_t* rgba = nullptr;  ///< in memory: as image, red the lowest byte; else null
  const float* depth_z = nullptr;       ///< in memory: as depth
  /// In memory: what MapToWindow makes of depth_z by `mapping`, where Draw was given one; else
  /// null.
  const float* window_z = nullptr;
  simd::WindowDepthMapping mapping;
  /// No two images of a process have the same, whoever drew them.
  std::uint64_t number = 0;
  int width_px = 0, height_px = 0;
  std::vector<int> views_used;  ///< as RenderResult::views_used
  bool views_held = false;      ///< as simd::DrawnImage; never of textures
};

/// Draws scenes with the OpenGL context that is current, into targets of its own, and leaves the
/// context's state as it was. Means what cpu::Render means, in single precision; how near the two
/// are is tested (tests/gl/parity_test.cpp). Belongs to the context it was made with, which must be
/// current at every call and at the end.
class Renderer {
 public:
  /// Throws dtr::Error, one line that names --renderer cpu, where no context of version 4.3 is
  /// current.
  explicit Renderer(RendererSettings settings = {});
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// SPEC 1 to 4, 6 and 7 as cpu::Render, and SPEC 5. Views that are drawn stay on the GPU within
  /// RendererSettings::gpu_bytes: they must not change or die as long as this renderer draws them
  /// (Forget() ends that); their pixels may go and be read again in between, as ViewStream does.
  /// The result does not depend on the order of the views; equal calls give
  /// equal bytes. Throws dtr::UsageError for options without a meaning and for images beyond 2^28
  /// pixels, and dtr::Error for a pose that is not finite, for what the driver cannot hold (naming
  /// its limit) and for a shader that does not compile (file and line).
  RenderResult Render(const RenderScene& scene, const PinholeCamera& novel,
                      const Pose& novel_from_world, const RenderOptions& options);

  /// The same without leaving the GPU, for windows and for timing: nothing is read back and nothing
  /// filled (options.fill_holes is not looked at). Drawn at once, whatever layer_bytes says. May
  /// return before the GPU has finished. Throws as Render; also dtr::Error where the deferred
  /// method's depth (4 bytes a pixel) is more than one storage block of this driver.
  DrawnFrame Draw(const RenderScene& scene, const PinholeCamera& novel,
                  const Pose& novel_from_world, const RenderOptions& options);

  /// The image of the last Draw, which must be the last call that drew (std::logic_error): what
  /// Render gives without filling.
  RenderResult ReadBack();

  /// Frees what lies on the GPU of every view.
  void Forget();

  /// What the views on the GPU take now, of RendererSettings::gpu_bytes.
  size_t gpu_bytes() const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace dtr::gl
