#include "dtr/simd/renderer.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "dtr/base/error.h"
#include "dtr/base/memory_budget.h"
#include "dtr/render/finish_image.h"
#include "dtr/render/frame.h"
#include "dtr/render/grid_placement.h"
#include "dtr/render/valid_views.h"
#include "dtr/simd/coarse_raster.h"
#include "dtr/simd/pixel_kernel.h"
#include "dtr/simd/prepared_views.h"
#include "dtr/simd/resolver.h"

namespace dtr::simd {
namespace {

void CheckOptions(const RenderOptions& options) {
  CheckRenderOptions(options);
  if (Renderer::Draws(options)) return;
  throw UsageError(
      "`renderer` simd: cannot draw by the two-pass method; use `method` deferred, or `renderer` "
      "auto, gl or cpu");
}

// What is drawn into, surface, image, depth and marks, stays below this beside the result; larger
// images are drawn in bands of rows.
constexpr size_t kBandBytes = size_t{256} << 20, kBandBytesPerPixel = 16;

int RowsOfBand(const PinholeCamera& novel) {
  const size_t rows = kBandBytes / (kBandBytesPerPixel * static_cast<size_t>(novel.width_px()));
  return static_cast<int>(std::clamp<size_t>(rows, 1, static_cast<size_t>(novel.height_px())));
}

/// SPEC 0.3: a view without a stored baseline has one by its depths.
bool ThresholdsNeedNoPixels(const std::vector<const View*>& views) {
  return std::all_of(views.begin(), views.end(),
                     [](const View* view) { return view->reference_baseline > 0; });
}

}  // namespace

class Renderer::Implementation {
 public:
  explicit Implementation(RendererSettings settings)
      : settings_(std::move(settings)), views_(settings_.view_bytes, settings_.warn) {}

  RenderResult Render(const RenderScene& scene, const PinholeCamera& novel,
                      const Pose& novel_from_world, const RenderOptions& options) {
    drawn_.reset();
    CheckNovelCamera(novel, novel_from_world);  // before anything of its size
    RenderResult result = EmptyResult(novel);
    PreparedFrame prepared = Prepare(scene, novel, novel_from_world, options);
    result.views_used = std::move(prepared.views_used);
    if (result.views_used.empty()) return result;
    const int rows = RowsOfBand(novel);
    for (Band band; band.first < novel.height_px(); band.first += band.count) {
      band.count = std::min(rows, novel.height_px() - band.first);
      DrawBand(prepared.frame, band, std::nullopt);
      resolver_.CopyTo(result);
    }
    result.coverage_share = CoverageShare(result.coverage);
    if (NeedsFinishing(options)) FinishImage(scene, novel, novel_from_world, options, result);
    return result;
  }

  DrawnImage Draw(const RenderScene& scene, const PinholeCamera& novel,
                  const Pose& novel_from_world, const RenderOptions& options,
                  const std::optional<WindowDepthMapping>& mapping) {
    drawn_.reset();
    PreparedFrame prepared = Prepare(scene, novel, novel_from_world, options);
    DrawBand(prepared.frame, {0, novel.height_px()}, mapping);
    DrawnImage drawn;
    drawn.views_held = prepared.held;
    drawn.views_used = std::move(prepared.views_used);
    drawn.width_px = novel.width_px(), drawn.height_px = novel.height_px();
    drawn.rgba = resolver_.rgba(), drawn.depth_z = resolver_.depth_z();
    if (mapping) drawn.window_z = resolver_.window_z(), drawn.mapping = *mapping;
    drawn_ = std::move(drawn);
    return *drawn_;
  }

  bool CanDraw(const RenderScene& scene, const PinholeCamera& novel, const Pose& novel_from_world,
               const RenderOptions& options) const {
    if (!Renderer::Draws(options)) return false;
    const ViewSelection selection = SelectViews(scene, novel_from_world, options);
    const RenderFrame frame = MakeFrame(scene, novel, novel_from_world, options, selection);
    const bool held = Holds(frame);
    return std::none_of(frame.views.begin(), frame.views.end(), [&](const View* view) {
      return view->image.empty() && !(held && views_.HoldsFor(options, *view));
    });
  }

  RenderResult ReadBack() const {
    if (!drawn_) throw std::logic_error("simd::Renderer::ReadBack: nothing was drawn before");
    RenderResult result = EmptyResult({drawn_->width_px, drawn_->height_px, 1, 1, 0, 0});
    result.views_used = drawn_->views_used;
    resolver_.CopyTo(result);
    result.coverage_share = CoverageShare(result.coverage);
    return result;
  }

  void Forget() { views_.Clear(); }
  size_t view_bytes() const { return views_.bytes(); }

 private:
  struct PreparedFrame {
    RenderFrame frame;
    std::vector<int> views_used;  ///< those that fit, nearest first: the frame's K
    bool held = false;
  };

  PreparedFrame Prepare(const RenderScene& scene, const PinholeCamera& novel,
                        const Pose& novel_from_world, const RenderOptions& options) {
    CheckOptions(options);
    CheckNovelCamera(novel, novel_from_world);
    const ViewSelection selection = SelectViews(scene, novel_from_world, options);
    PreparedFrame prepared{MakeFrame(scene, novel, novel_from_world, options, selection), {}};
    RenderFrame& frame = prepared.frame;
    prepared.held = Holds(frame);
    RequirePixels(frame, prepared.held);
    const size_t wanted = selection.views.size();
    const size_t fitting = views_.Prepare(frame, NearestFirst(scene, selection));
    if (fitting < wanted) WarnOfRoom(fitting, wanted);
    SetCutFactors(selection, fitting, frame);
    // What no sample is left of at this resolution shows nothing.
    frame.EraseIf([this](const View& view) { return !views_.HasSamples(view); });
    prepared.views_used.assign(selection.views.begin(),
                               selection.views.begin() + static_cast<std::ptrdiff_t>(fitting));
    return prepared;
  }

  void DrawBand(const RenderFrame& frame, const Band& band,
                const std::optional<WindowDepthMapping>& mapping) {
    DrawSurface(frame, band);
    resolver_.Draw(frame, band, views_.sampled(), surface_.nearest(), mapping);
  }

  /// SPEC 5.1.
  void DrawSurface(const RenderFrame& frame, const Band& band) {
    std::vector<PlacedMesh> placed;
    for (size_t i = 0; i < frame.views.size(); ++i) {
      const AdaptiveMesh& mesh = views_.meshes().MeshOf(*frame.views[i]);
      placed.push_back({&mesh, PlaceGrid(*frame.views[i], mesh, frame.placements[i], frame.novel)});
    }
    surface_.Draw(placed, frame.novel.width_px(), band);
  }

  /// True when frames like this one, once drawn, need no pixels of their views any more.
  bool Holds(const RenderFrame& frame) const {
    return ThresholdsNeedNoPixels(frame.views) && views_.AllFit(frame);
  }

  /// Of views whose pixels went nothing else is needed than what was made of them.
  void RequirePixels(const RenderFrame& frame, bool held) const {
    for (const View* view : frame.views) {
      const bool needed = !view->image.empty() || !held || !views_.HoldsFor(frame.options, *view);
      if (needed) RequireLoaded(*view);
    }
  }

  void WarnOfRoom(size_t fitting, size_t wanted) {
    if (std::exchange(warned_of_room_, true)) return;
    settings_.warn("WARNING: drawn from the nearest " + std::to_string(fitting) + " of " +
                   std::to_string(wanted) + " views: more do not fit into " +
                   GigabytesText(settings_.view_bytes) +
                   " GB of memory for views; give `gpu_memory`");
  }

  const RendererSettings settings_;
  PreparedViews views_;
  bool warned_of_room_ = false;
  CoarseRaster surface_;
  Resolver resolver_;
  std::optional<DrawnImage> drawn_;
};

std::string Description() { return std::string("simd (") + InstructionSet() + ")"; }

Renderer::Renderer(RendererSettings settings)
    : implementation_(std::make_unique<Implementation>(std::move(settings))) {}
Renderer::~Renderer() = default;

bool Renderer::Draws(const RenderOptions& options) {
  return options.method == RenderMethod::kDeferred;
}

RenderResult Renderer::Render(const RenderScene& scene, const PinholeCamera& novel,
                              const Pose& novel_from_world, const RenderOptions& options) {
  return implementation_->Render(scene, novel, novel_from_world, options);
}

DrawnImage Renderer::Draw(const RenderScene& scene, const PinholeCamera& novel,
                          const Pose& novel_from_world, const RenderOptions& options,
                          const std::optional<WindowDepthMapping>& mapping) {
  return implementation_->Draw(scene, novel, novel_from_world, options, mapping);
}

bool Renderer::CanDraw(const RenderScene& scene, const PinholeCamera& novel,
                       const Pose& novel_from_world, const RenderOptions& options) const {
  return implementation_->CanDraw(scene, novel, novel_from_world, options);
}

RenderResult Renderer::ReadBack() const { return implementation_->ReadBack(); }

void Renderer::Forget() { implementation_->Forget(); }

size_t Renderer::view_bytes() const { return implementation_->view_bytes(); }

}  // namespace dtr::simd
