// dtr/gl/renderer.h -- RENDER_SPEC with OpenGL 4.3; no GL header is needed to use it.
#pragma once
#include <cstddef>
#include <memory>
#include <string>

#include "dtr/render/options.h"
#include "dtr/render/result.h"
#include "dtr/render/scene.h"
#include "dtr/types/camera.h"
#include "dtr/types/pose.h"

namespace dtr::gl {

/// What does not change the picture.
struct RendererSettings {
  /// Where shaders come from, for development; empty: from the program itself.
  std::string shader_folder;
  /// Memory for the views' fragments; a picture that needs more is drawn in bands of rows.
  size_t layer_bytes = size_t{256} << 20;
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

  /// SPEC 1 to 4, 6 and 7 as cpu::Render, and SPEC 5, which cpu::Render does not know. Views that
  /// are drawn stay on the GPU: they must not change or die as long as this renderer draws them
  /// (Forget() ends that). The result does not depend on the order of the views; equal calls give
  /// equal bytes. Throws dtr::UsageError for options without a meaning and for pictures beyond 2^28
  /// pixels, and dtr::Error for a pose that is not finite, for what the driver cannot hold (naming
  /// its limit) and for a shader that does not compile (file and line).
  RenderResult Render(const RenderScene& scene, const PinholeCamera& novel,
                      const Pose& novel_from_world, const RenderOptions& options);

  /// Frees what lies on the GPU of every view.
  void Forget();

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace dtr::gl
