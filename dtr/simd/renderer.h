// dtr/simd/renderer.h -- RENDER_SPEC's deferred method with the processor's vector instructions:
// the fast renderer of machines without a GPU. Needs no OpenGL.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dtr/render/options.h"
#include "dtr/render/result.h"
#include "dtr/render/scene.h"
#include "dtr/simd/window_depth.h"
#include "dtr/types/camera.h"
#include "dtr/types/pose.h"

namespace dtr::simd {

struct RendererSettings {
  /// Memory for what is made of the views. Those drawn longest ago make room for others; where one
  /// frame's do not fit, it is drawn from the nearest that do, and `warn` is called once.
  size_t view_bytes = 4'000'000'000;
  /// Gets a line for whatever the rendered image goes without, on the thread that draws.
  std::function<void(const std::string&)> warn = [](const std::string&) {};
};

/// A rendered image in the renderer's memory, where it stays until the renderer draws again. Row 0
/// is the top row.
struct DrawnImage {
  const std::uint32_t* rgba = nullptr;  ///< sRGB, red the lowest byte; alpha 255 where seen, else 0
  const float* depth_z = nullptr;       ///< plane z in scene units; 0 where unseen
  /// What MapToWindow makes of depth_z by `mapping`, where Draw was given one; else null.
  const float* window_z = nullptr;
  WindowDepthMapping mapping;
  int width_px = 0, height_px = 0;
  std::vector<int> views_used;  ///< as RenderResult::views_used
  /// The renderer holds all that frames by these options need of these views: their pixels may go
  /// and need not come back for them (CanDraw).
  bool views_held = false;
};

/// What draws: the vector instructions that this machine offers, for reports: "simd (AVX2)".
std::string Description();

/// Draws scenes into memory. Means what cpu::Render means by the deferred method, in single
/// precision; how near the two are is tested (tests/simd/parity_test.cpp). Used by one thread at a
/// time; draws with RenderOptions::threads.
class Renderer {
 public:
  explicit Renderer(RendererSettings settings = {});
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  /// True for the deferred method.
  static bool Draws(const RenderOptions& options);

  /// As cpu::Render. Of views that are drawn, what is made of them stays within
  /// RendererSettings::view_bytes: they must not change or die as long as this renderer draws them
  /// (Forget() ends that); their pixels may go and be read again in between, as ViewStream does.
  /// The result does not depend on the order of the views or on the number of threads; equal calls
  /// give equal bytes. Throws dtr::UsageError for options without a meaning or that it does not
  /// draw, one line that says what to do, and for images beyond 2^28 pixels, and dtr::Error for a
  /// pose that is not finite.
  RenderResult Render(const RenderScene& scene, const PinholeCamera& novel,
                      const Pose& novel_from_world, const RenderOptions& options);

  /// The same, left where it is and not filled (options.fill_holes is ignored). Throws as Render.
  /// `mapping`: window_z is made, too, while depth is in the processor's cache.
  DrawnImage Draw(const RenderScene& scene, const PinholeCamera& novel,
                  const Pose& novel_from_world, const RenderOptions& options,
                  const std::optional<WindowDepthMapping>& mapping = std::nullopt);

  /// True when this frame can be drawn though the pixels of some of its views went: the renderer
  /// holds what it would make of them. (Of others it has what it needs: the pixels.)
  bool CanDraw(const RenderScene& scene, const PinholeCamera& novel, const Pose& novel_from_world,
               const RenderOptions& options) const;

  /// The image of the last Draw, which must be the last call that drew (std::logic_error): what
  /// Render gives without filling.
  RenderResult ReadBack() const;

  /// Frees what was made of every view.
  void Forget();

  /// What that takes now, of RendererSettings::view_bytes.
  size_t view_bytes() const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace dtr::simd
