#include "dtr/gl/renderer.h"

#include <algorithm>
#include <optional>
#include <stdexcept>

#include "dtr/base/error.h"
#include "dtr/gl/deferred.h"
#include "dtr/gl/drawing.h"
#include "dtr/gl/driver.h"
#include "dtr/gl/frame.h"
#include "dtr/gl/gpu_views.h"
#include "dtr/gl/objects.h"
#include "dtr/gl/processor_resolve.h"
#include "dtr/gl/program.h"
#include "dtr/gl/read_back.h"
#include "dtr/gl/resolve.h"
#include "dtr/gl/two_pass.h"
#include "dtr/gl/view_store.h"
#include "dtr/render/fill_holes.h"
#include "dtr/render/valid_views.h"

namespace dtr::gl {
namespace {

constexpr int kOldestVersion = 43;

void CheckContext() {
  const int version = epoxy_gl_version();
  if (version < kOldestVersion || !epoxy_is_desktop_gl()) {
    throw Error("OpenGL: expected a current context of version 4.3 or newer, found " +
                std::to_string(version / 10) + "." + std::to_string(version % 10) +
                "; use `renderer` cpu");
  }
}

bool CoarseByShaders(CoarseDrawer drawer) {
  return drawer == CoarseDrawer::kFitting ? !DrawsOnProcessor() : drawer == CoarseDrawer::kShaders;
}

void CheckPictureSize(const PinholeCamera& novel) {
  GLint max_px = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &max_px);
  if (novel.width_px() > max_px || novel.height_px() > max_px) {
    throw Error("OpenGL: expected an image of at most " + std::to_string(max_px) +
                " pixels a side on this driver, found " + std::to_string(novel.width_px()) + "x" +
                std::to_string(novel.height_px()) + "; use `renderer` cpu");
  }
}

void CheckViewCount(size_t views) {
  GLint max_layers = 0;
  glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &max_layers);
  if (views > static_cast<size_t>(max_layers)) {
    throw Error("OpenGL: expected at most " + std::to_string(max_layers) +
                " candidate views on this driver, found " + std::to_string(views) +
                "; use `renderer` cpu or `exclude`");
  }
}

Frame MakeFrame(const RenderScene& scene, const PinholeCamera& novel, const Pose& novel_from_world,
                const RenderOptions& options, const ViewSelection& selection, bool processor_fits) {
  Frame frame{scene, novel, options, selection.per_pixel, false, {}, {}, {}};
  for (const int index : CanonicalOrder(scene, selection.views)) {
    const View& view = *scene.views[static_cast<size_t>(index)];
    frame.views.push_back(&view);
    frame.placements.push_back(PlaceView(view, novel_from_world));
    frame.cut_factors.push_back(1);
  }
  frame.on_processor = processor_fits && ProcessorResolver::Draws(frame);
  return frame;
}

/// SPEC 0.3: a view without a stored baseline has one by its depths.
bool ThresholdsNeedNoPixels(const std::vector<const View*>& views) {
  return std::all_of(views.begin(), views.end(),
                     [](const View* view) { return view->reference_baseline > 0; });
}

/// SPEC 1.4, where the `count` nearest of the selection's views are drawn.
void SetCutFactors(const ViewSelection& selection, size_t count, Frame& frame) {
  const std::vector<double> factors = CutFactors(selection, count);
  for (size_t k = 0; k < count; ++k) {
    const View* view = frame.scene.views[static_cast<size_t>(selection.views[k])];
    const auto at = std::find(frame.views.begin(), frame.views.end(), view);
    frame.cut_factors[static_cast<size_t>(at - frame.views.begin())] = factors[k];
  }
}

}  // namespace

class Renderer::Implementation {
 public:
  explicit Implementation(RendererSettings settings)
      : settings_(std::move(settings)),
        max_storage_bytes_(std::min(settings_.max_storage_bytes, MostStorageBytes())),
        coarse_by_shaders_(CoarseByShaders(settings_.coarse_drawer)),
        views_(settings_.gpu_bytes, coarse_by_shaders_, settings_.warn),
        programs_(settings_.shader_folder),
        coarse_depth_(coarse_by_shaders_) {}

  RenderResult Render(const RenderScene& scene, const PinholeCamera& novel,
                      const Pose& novel_from_world, const RenderOptions& options) {
    CheckRenderOptions(options);
    CheckNovelCamera(novel, novel_from_world);
    RenderResult result = EmptyResult(novel);
    const ViewSelection selection = SelectViews(scene, novel_from_world, options);
    result.views_used = selection.views;
    if (selection.views.empty()) return result;
    CheckPictureSize(novel);
    Frame frame =
        MakeFrame(scene, novel, novel_from_world, options, selection, !coarse_by_shaders_);
    RequirePixels(frame);
    DrawInBands(std::move(frame), selection, result);
    result.coverage_share = CoverageShare(result.coverage);
    if (options.fill_holes) hole_filler_.Fill(scene, novel, novel_from_world, options, result);
    return result;
  }

  DrawnPicture Draw(const RenderScene& scene, const PinholeCamera& novel,
                    const Pose& novel_from_world, const RenderOptions& options,
                    const std::optional<WindowDepthMapping>& mapping) {
    CheckRenderOptions(options);
    CheckNovelCamera(novel, novel_from_world);
    CheckPictureSize(novel);
    const ViewSelection selection = SelectViews(scene, novel_from_world, options);
    Frame frame =
        MakeFrame(scene, novel, novel_from_world, options, selection, !coarse_by_shaders_);
    RequirePixels(frame);
    const bool held = Holds(frame);
    DrawnPicture drawn = DrawWhole(std::move(frame), selection, mapping);
    drawn.views_held = held;
    drawn_ = std::move(drawn);
    return *drawn_;
  }

  bool CanDraw(const RenderScene& scene, const PinholeCamera& novel, const Pose& novel_from_world,
               const RenderOptions& options) const {
    const ViewSelection selection = SelectViews(scene, novel_from_world, options);
    const Frame frame =
        MakeFrame(scene, novel, novel_from_world, options, selection, !coarse_by_shaders_);
    return std::none_of(frame.views.begin(), frame.views.end(), [&](const View* view) {
      return view->image.empty() && !HoldsOf(frame, *view);
    });
  }

  RenderResult ReadBack() {
    if (!drawn_) throw std::logic_error("gl::Renderer::ReadBack: nothing was drawn before");
    const StateGuard guard;
    RenderResult result = EmptyResult({drawn_->width_px, drawn_->height_px, 1, 1, 0, 0});
    TakeBand({0, drawn_->height_px}, drawn_in_memory_, result);
    result.coverage_share = CoverageShare(result.coverage);
    result.views_used = drawn_->views_used;
    return result;
  }

  void Forget() {
    views_.Clear();
    hole_filler_.Forget();
  }
  size_t gpu_bytes() const { return views_.bytes(); }

 private:
  /// Puts on the GPU what the frame's method draws of its views. Returns those that fit, nearest
  /// first: the frame's K.
  std::vector<int> Prepare(Frame& frame, const ViewSelection& selection) {
    std::vector<const View*> nearest_first;
    for (const int index : selection.views) {
      nearest_first.push_back(frame.scene.views[static_cast<size_t>(index)]);
    }
    const size_t wanted = selection.views.size();
    const size_t fitting = views_.Prepare(frame, nearest_first);
    if (fitting < wanted) WarnOfRoom(fitting, wanted);
    SetCutFactors(selection, fitting, frame);
    if (frame.deferred()) {
      // What no sample is left of at this resolution shows nothing.
      for (size_t i = frame.views.size(); i-- > 0;) {
        if (!views_.HasSamples(frame, *frame.views[i])) frame.Erase(i);
      }
    }
    return {selection.views.begin(),
            selection.views.begin() + static_cast<std::ptrdiff_t>(fitting)};
  }

  /// True when images like this one, once drawn, need no pixels of its views any more.
  bool Holds(const Frame& frame) const {
    return frame.on_processor && ThresholdsNeedNoPixels(frame.views) && views_.AllFit(frame);
  }

  bool HoldsOf(const Frame& frame, const View& view) const {
    return Holds(frame) && views_.HoldsFor(frame.options, view);
  }

  /// Of views whose pixels went nothing else is needed than what was made of them.
  void RequirePixels(const Frame& frame) const {
    for (const View* view : frame.views) {
      if (!view->image.empty() || !HoldsOf(frame, *view)) RequireLoaded(*view);
    }
  }

  void WarnOfRoom(size_t fitting, size_t wanted) {
    if (std::exchange(warned_of_room_, true)) return;
    settings_.warn("WARNING: drawn from the nearest " + std::to_string(fitting) + " of " +
                   std::to_string(wanted) + " views: more do not fit into " +
                   std::to_string(settings_.gpu_bytes >> 20) +
                   " MiB of GPU memory; give `gpu_memory`");
  }

  /// Band by band, so that the views' fragments stay within the memory for them.
  void DrawInBands(Frame frame, const ViewSelection& selection, RenderResult& result) {
    drawn_.reset();
    ForgetErrors();
    const StateGuard guard;
    CheckViewCount(frame.views.size());
    result.views_used = Prepare(frame, selection);
    if (frame.views.empty()) return;
    if (!frame.on_processor) resolver_.SetViews(frame, views_.store());
    const int rows = RowsWithinMemory(frame);
    if (!frame.on_processor) FitTargets(frame, rows);
    for (Band band; band.first < frame.novel.height_px(); band.first += band.count) {
      band.count = std::min(rows, frame.novel.height_px() - band.first);
      DrawBand(frame, band);
      TakeBand(band, frame.on_processor, result);
    }
    ThrowOnError("drawing");
  }

  /// The whole image at once.
  DrawnPicture DrawWhole(Frame frame, const ViewSelection& selection,
                         const std::optional<WindowDepthMapping>& mapping) {
    drawn_.reset();
    ForgetErrors();
    const StateGuard guard;
    CheckViewCount(frame.views.size());
    DrawnPicture drawn;
    drawn.width_px = frame.novel.width_px(), drawn.height_px = frame.novel.height_px();
    if (!frame.views.empty()) drawn.views_used = Prepare(frame, selection);
    CheckStorage(frame);
    drawn_in_memory_ = frame.on_processor && !frame.views.empty();
    drawn.number = NextPictureNumber();
    if (drawn_in_memory_ && settings_.in_memory) {
      DrawBand(frame, {0, drawn.height_px}, mapping);
      drawn.rgba = processor_resolver_.rgba();
      drawn.depth_z = processor_resolver_.depth_z();
      if (mapping) drawn.window_z = processor_resolver_.window_z(), drawn.mapping = *mapping;
    } else {
      FitTargets(frame, drawn.height_px);
      DrawIntoTargets(frame);
      drawn.image = targets_.image.name();
      drawn.depth = targets_.depth.name();
      drawn.marks = targets_.marks.name();
    }
    ThrowOnError("drawing");
    return drawn;
  }

  void DrawIntoTargets(const Frame& frame) {
    if (frame.views.empty()) return targets_.ClearResults();
    if (!frame.on_processor) resolver_.SetViews(frame, views_.store());
    DrawBand(frame, {0, frame.novel.height_px()});
    if (frame.on_processor) processor_resolver_.Upload(targets_);
  }

  /// The band that was drawn last: from the processor's memory, or from the targets.
  void TakeBand(const Band& band, bool from_memory, RenderResult& result) const {
    if (from_memory) {
      processor_resolver_.CopyTo(result);
    } else {
      gl::ReadBack(targets_, band, result);
    }
  }

  void DrawBand(const Frame& frame, const Band& band,
                const std::optional<WindowDepthMapping>& mapping = std::nullopt) {
    if (frame.deferred()) {
      coarse_depth_.Draw(frame, band, views_.meshes(), programs_, targets_);
    } else {
      DrawViewLayers(frame, band, views_.store(), programs_, targets_,
                     HasClipControl() && !settings_.only_opengl_43);
    }
    if (frame.on_processor) {
      processor_resolver_.Draw(frame, band, views_.sampled(), coarse_depth_.nearest(), mapping);
    } else {
      resolver_.Draw(frame, band, views_.store(), programs_, targets_, coarse_depth_.buffer());
    }
  }

  static int LayersOf(const Frame& frame) {
    return frame.deferred() ? 1 : std::max(1, static_cast<int>(frame.views.size()));
  }

  static size_t LayerRowBytes(const Frame& frame) {
    return sizeof(float) * static_cast<size_t>(frame.novel.width_px());
  }

  /// Rows of a band: as many as the memory for layers allows and, for the deferred method's depth,
  /// a storage block holds.
  int RowsWithinMemory(const Frame& frame) const {
    const size_t row_bytes = LayerRowBytes(frame);
    size_t rows = settings_.layer_bytes / (row_bytes * static_cast<size_t>(LayersOf(frame)));
    if (frame.deferred()) rows = std::min(rows, max_storage_bytes_ / row_bytes);
    return static_cast<int>(
        std::clamp<size_t>(rows, 1, static_cast<size_t>(frame.novel.height_px())));
  }

  void CheckStorage(const Frame& frame) const {
    const size_t bytes = LayerRowBytes(frame) * static_cast<size_t>(frame.novel.height_px());
    if (!frame.deferred() || bytes <= max_storage_bytes_) return;
    throw Error("OpenGL: expected an image whose depth is within this driver's storage block of " +
                std::to_string(max_storage_bytes_) + " bytes, found " +
                std::to_string(frame.novel.width_px()) + "x" +
                std::to_string(frame.novel.height_px()) +
                " pixels of 4 bytes; use `renderer` cpu, `method` two-pass or a smaller `size`");
  }

  void FitTargets(const Frame& frame, int rows) {
    targets_.Fit(frame.novel.width_px(), rows, LayersOf(frame));
  }

  const RendererSettings settings_;
  const size_t max_storage_bytes_;
  const bool coarse_by_shaders_;
  GpuViews views_;
  bool warned_of_room_ = false;
  ProgramCache programs_;
  Targets targets_;
  CoarseDepth coarse_depth_;
  Resolver resolver_;
  ProcessorResolver processor_resolver_;
  HoleFiller hole_filler_;
  std::optional<DrawnPicture> drawn_;  ///< while it can be read back
  bool drawn_in_memory_ = false;       ///< it lies in processor_resolver_, else in targets_
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

DrawnPicture Renderer::Draw(const RenderScene& scene, const PinholeCamera& novel,
                            const Pose& novel_from_world, const RenderOptions& options,
                            const std::optional<WindowDepthMapping>& mapping) {
  return implementation_->Draw(scene, novel, novel_from_world, options, mapping);
}

bool Renderer::CanDraw(const RenderScene& scene, const PinholeCamera& novel,
                       const Pose& novel_from_world, const RenderOptions& options) const {
  return implementation_->CanDraw(scene, novel, novel_from_world, options);
}

RenderResult Renderer::ReadBack() { return implementation_->ReadBack(); }

void Renderer::Forget() { implementation_->Forget(); }

size_t Renderer::gpu_bytes() const { return implementation_->gpu_bytes(); }

}  // namespace dtr::gl
