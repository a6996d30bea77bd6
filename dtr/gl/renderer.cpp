#include "dtr/gl/renderer.h"

#include <algorithm>
#include <optional>
#include <stdexcept>

#include "dtr/base/error.h"
#include "dtr/base/memory_budget.h"
#include "dtr/gl/deferred.h"
#include "dtr/gl/drawing.h"
#include "dtr/gl/driver.h"
#include "dtr/gl/gpu_views.h"
#include "dtr/gl/objects.h"
#include "dtr/gl/program.h"
#include "dtr/gl/read_back.h"
#include "dtr/gl/resolve.h"
#include "dtr/gl/two_pass.h"
#include "dtr/gl/view_store.h"
#include "dtr/render/finish_image.h"
#include "dtr/render/frame.h"
#include "dtr/render/valid_views.h"

namespace dtr::gl {
namespace {

constexpr int kOldestVersion = 43;

void CheckContext() {
  const int version = epoxy_gl_version();
  if (version < kOldestVersion || !epoxy_is_desktop_gl()) {
    throw Error("OpenGL: expected a current context of version 4.3 or newer, found " +
                std::to_string(version / 10) + "." + std::to_string(version % 10) +
                "; use `renderer` cpu or simd");
  }
}

void CheckImageSize(const PinholeCamera& novel) {
  GLint max_px = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &max_px);
  if (novel.width_px() > max_px || novel.height_px() > max_px) {
    throw Error("OpenGL: expected an image of at most " + std::to_string(max_px) +
                " pixels a side on this driver, found " + std::to_string(novel.width_px()) + "x" +
                std::to_string(novel.height_px()) + "; use `renderer` cpu or simd");
  }
}

void CheckViewCount(size_t views) {
  GLint max_layers = 0;
  glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &max_layers);
  if (views > static_cast<size_t>(max_layers)) {
    throw Error("OpenGL: expected at most " + std::to_string(max_layers) +
                " candidate views on this driver, found " + std::to_string(views) +
                "; use `renderer` cpu or simd, or `exclude`");
  }
}

void RequireAllLoaded(const RenderFrame& frame) {
  for (const View* view : frame.views) RequireLoaded(*view);
}

}  // namespace

class Renderer::Implementation {
 public:
  explicit Implementation(RendererSettings settings)
      : settings_(std::move(settings)),
        max_storage_bytes_(std::min(settings_.max_storage_bytes, MostStorageBytes())),
        views_(settings_.gpu_bytes, settings_.warn),
        programs_(settings_.shader_folder) {}

  RenderResult Render(const RenderScene& scene, const PinholeCamera& novel,
                      const Pose& novel_from_world, const RenderOptions& options) {
    CheckRenderOptions(options);
    CheckNovelCamera(novel, novel_from_world);
    RenderResult result = EmptyResult(novel);
    const ViewSelection selection = SelectViews(scene, novel_from_world, options);
    result.views_used = selection.views;
    if (selection.views.empty()) return result;
    CheckImageSize(novel);
    RenderFrame frame = MakeFrame(scene, novel, novel_from_world, options, selection);
    RequireAllLoaded(frame);
    DrawInBands(std::move(frame), selection, result);
    result.coverage_share = CoverageShare(result.coverage);
    if (NeedsFinishing(options)) FinishImage(scene, novel, novel_from_world, options, result);
    return result;
  }

  DrawnFrame Draw(const RenderScene& scene, const PinholeCamera& novel,
                  const Pose& novel_from_world, const RenderOptions& options) {
    CheckRenderOptions(options);
    CheckNovelCamera(novel, novel_from_world);
    CheckImageSize(novel);
    const ViewSelection selection = SelectViews(scene, novel_from_world, options);
    RenderFrame frame = MakeFrame(scene, novel, novel_from_world, options, selection);
    RequireAllLoaded(frame);
    drawn_ = DrawWhole(std::move(frame), selection);
    return *drawn_;
  }

  RenderResult ReadBack() {
    if (!drawn_) throw std::logic_error("gl::Renderer::ReadBack: nothing was drawn before");
    const StateGuard guard;
    RenderResult result = EmptyResult({drawn_->width_px, drawn_->height_px, 1, 1, 0, 0});
    gl::ReadBack(targets_, {0, drawn_->height_px}, result);
    result.coverage_share = CoverageShare(result.coverage);
    result.views_used = drawn_->views_used;
    return result;
  }

  void Forget() { views_.Clear(); }
  size_t gpu_bytes() const { return views_.bytes(); }

 private:
  /// Puts on the GPU what the frame's method draws of its views. Returns those that fit, nearest
  /// first: the frame's K.
  std::vector<int> Prepare(RenderFrame& frame, const ViewSelection& selection) {
    const size_t wanted = selection.views.size();
    const size_t fitting = views_.Prepare(frame, NearestFirst(frame.scene, selection));
    if (fitting < wanted) WarnOfRoom(fitting, wanted);
    SetCutFactors(selection, fitting, frame);
    if (frame.deferred()) {
      // What no sample is left of at this resolution shows nothing.
      frame.EraseIf([this](const View& view) { return !views_.store().DeferredOf(view); });
    }
    return {selection.views.begin(),
            selection.views.begin() + static_cast<std::ptrdiff_t>(fitting)};
  }

  void WarnOfRoom(size_t fitting, size_t wanted) {
    if (std::exchange(warned_of_room_, true)) return;
    settings_.warn("WARNING: drawn from the nearest " + std::to_string(fitting) + " of " +
                   std::to_string(wanted) + " views: more do not fit into " +
                   GigabytesText(settings_.gpu_bytes) + " GB of GPU memory; give `gpu_memory`");
  }

  /// Band by band, so that the views' fragments stay within the memory for them.
  void DrawInBands(RenderFrame frame, const ViewSelection& selection, RenderResult& result) {
    drawn_.reset();
    ForgetErrors();
    const StateGuard guard;
    CheckViewCount(frame.views.size());
    result.views_used = Prepare(frame, selection);
    if (frame.views.empty()) return;
    resolver_.SetViews(frame, views_.store());
    const int rows = RowsWithinMemory(frame);
    FitTargets(frame, rows);
    for (Band band; band.first < frame.novel.height_px(); band.first += band.count) {
      band.count = std::min(rows, frame.novel.height_px() - band.first);
      DrawBand(frame, band);
      gl::ReadBack(targets_, band, result);
    }
    ThrowOnError("drawing");
  }

  /// The whole image at once.
  DrawnFrame DrawWhole(RenderFrame frame, const ViewSelection& selection) {
    drawn_.reset();
    ForgetErrors();
    const StateGuard guard;
    CheckViewCount(frame.views.size());
    DrawnFrame drawn;
    drawn.width_px = frame.novel.width_px(), drawn.height_px = frame.novel.height_px();
    if (!frame.views.empty()) drawn.views_used = Prepare(frame, selection);
    CheckStorage(frame);
    drawn.number = NextFrameNumber();
    FitTargets(frame, drawn.height_px);
    if (frame.views.empty()) {
      targets_.ClearResults();
    } else {
      resolver_.SetViews(frame, views_.store());
      DrawBand(frame, {0, drawn.height_px});
    }
    drawn.image = targets_.image.name();
    drawn.depth = targets_.depth.name();
    drawn.marks = targets_.marks.name();
    ThrowOnError("drawing");
    return drawn;
  }

  void DrawBand(const RenderFrame& frame, const Band& band) {
    if (frame.deferred()) {
      coarse_depth_.Draw(frame, band, views_.meshes(), programs_, targets_);
    } else {
      DrawViewLayers(frame, band, views_.store(), programs_, targets_,
                     HasClipControl() && !settings_.only_opengl_43);
    }
    resolver_.Draw(frame, band, views_.store(), programs_, targets_, coarse_depth_.buffer());
  }

  static int LayersOf(const RenderFrame& frame) {
    return frame.deferred() ? 1 : std::max(1, static_cast<int>(frame.views.size()));
  }

  static size_t LayerRowBytes(const RenderFrame& frame) {
    return sizeof(float) * static_cast<size_t>(frame.novel.width_px());
  }

  /// Rows of a band: as many as the memory for layers allows and, for the deferred method's depth,
  /// a storage block holds.
  int RowsWithinMemory(const RenderFrame& frame) const {
    const size_t row_bytes = LayerRowBytes(frame);
    size_t rows = settings_.layer_bytes / (row_bytes * static_cast<size_t>(LayersOf(frame)));
    if (frame.deferred()) rows = std::min(rows, max_storage_bytes_ / row_bytes);
    return static_cast<int>(
        std::clamp<size_t>(rows, 1, static_cast<size_t>(frame.novel.height_px())));
  }

  void CheckStorage(const RenderFrame& frame) const {
    const size_t bytes = LayerRowBytes(frame) * static_cast<size_t>(frame.novel.height_px());
    if (!frame.deferred() || bytes <= max_storage_bytes_) return;
    throw Error(
        "OpenGL: expected an image whose depth is within this driver's storage block of " +
        std::to_string(max_storage_bytes_) + " bytes, found " +
        std::to_string(frame.novel.width_px()) + "x" + std::to_string(frame.novel.height_px()) +
        " pixels of 4 bytes; use `renderer` cpu or simd, `method` two-pass or a smaller `size`");
  }

  void FitTargets(const RenderFrame& frame, int rows) {
    targets_.Fit(frame.novel.width_px(), rows, LayersOf(frame));
  }

  const RendererSettings settings_;
  const size_t max_storage_bytes_;
  GpuViews views_;
  bool warned_of_room_ = false;
  ProgramCache programs_;
  Targets targets_;
  CoarseDepth coarse_depth_;
  Resolver resolver_;
  std::optional<DrawnFrame> drawn_;  ///< while it can be read back
};

Renderer::Renderer(RendererSettings settings) {
  CheckContext();
  implementation_ = std::make_unique<Implementation>(std::move(settings));
}
Renderer::~Renderer() = default;

RenderResult Renderer::Render(const RenderScene& scene, const PinholeCamera& novel,
                              const Pose& novel_from_world, const RenderOptions& options) {
  return implementation_->Render(scene, novel, novel_from_world, options);
}

DrawnFrame Renderer::Draw(const RenderScene& scene, const PinholeCamera& novel,
                          const Pose& novel_from_world, const RenderOptions& options) {
  return implementation_->Draw(scene, novel, novel_from_world, options);
}

RenderResult Renderer::ReadBack() { return implementation_->ReadBack(); }

void Renderer::Forget() { implementation_->Forget(); }

size_t Renderer::gpu_bytes() const { return implementation_->gpu_bytes(); }

}  // namespace dtr::gl
