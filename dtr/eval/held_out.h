// dtr/eval/held_out.h -- how good a set is, by photos it was not made from.
#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/render/options.h"
#include "dtr/render/result.h"
#include "dtr/render/scene.h"
#include "dtr/types/dtr_set.h"

namespace dtr::eval {

/// Any renderer: cpu::Render, or one that draws with OpenGL. `novel_from_world` is the pose of the
/// camera in the scene's world.
using RenderFunction =
    std::function<RenderResult(const RenderScene& scene, const PinholeCamera& novel,
                               const Pose& novel_from_world, const RenderOptions& options)>;

struct EvaluateOptions {
  /// Instead of the held-out photos, every source view is left out of rendering in turn. Its photo
  /// still took part in calibration and stereo: this tests the renderer, not the whole chain.
  bool leave_one_out = false;
  RenderOptions render;  ///< fill_holes is set by the evaluation
  /// Held-out photos without a pose: counted in the report, as no view could be rendered for them.
  std::vector<std::string> not_registered;
  /// Called with every rendering, by several threads, for those who want to look at them.
  std::function<void(const View& view, const RenderResult& filled)> on_rendered;
};

/// Figures of one view; docs/ACCURACY.md. Empty: not defined, as no pixel is left to
/// compare (for SSIM: no window). Infinite PSNR: every pixel is equal.
struct ViewScore {
  std::string name;
  std::optional<double> psnr_db;          ///< usable pixels of the photo, after hole filling
  std::optional<double> psnr_covered_db;  ///< those of them that some view saw
  /// As psnr_db, after the best gain and offset per channel (ColourCorrectedPsnr).
  std::optional<double> psnr_cc_db;
  /// Usable pixels where the photo's own depth map has a value, after hole filling: what published
  /// comparisons of renderers call the valid area. Empty for a view without depth (a held-out one).
  std::optional<double> psnr_own_depth_db;
  std::optional<double> ssim;  ///< usable pixels, after hole filling
  double coverage = 0;         ///< share of the usable pixels that some view saw
  int views_used = 0;
  double render_ms = 0;  ///< wall clock, filling included
};

struct EvaluationReport {
  std::vector<ViewScore> views;
  ViewScore mean;  ///< arithmetic means over the views where a figure is defined
  std::vector<std::string> not_registered;
  bool leave_one_out = false;
};

/// Renders the camera of each held-out view (or of each source view left out in turn) of the set's
/// first frame and compares with its photo. A photo's masked pixels never count.
/// `set` must be loaded with images and depth, and with held-out views unless leave_one_out.
/// Throws UsageError when there is no view to compare with, Error when one is not loaded.
EvaluationReport EvaluateHeldOut(const DtrSet& set, const EvaluateOptions& options,
                                 const RenderFunction& render, Progress& progress);

/// Rendering | photo | absolute difference times 4, side by side with a grey line between, for
/// looking at. Pixels that the photo's mask excludes (empty: none) are grey in photo and
/// difference, as they count in no figure. Throws std::invalid_argument unless both are RGB and all
/// of one size.
ImageRgb8 ComparisonImage(const ImageRgb8& rendered, const ImageRgb8& photo, const Mask& mask = {});

}  // namespace dtr::eval
