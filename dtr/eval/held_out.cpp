#include "dtr/eval/held_out.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <stdexcept>

#include "dtr/base/batches.h"
#include "dtr/base/error.h"
#include "dtr/eval/metrics.h"

namespace dtr::eval {
namespace {

constexpr int kDifferenceGain = 4;  // an error of 2 levels of 255 is visible, 64 saturate
constexpr int kGapPx = 4;
constexpr std::uint8_t kGapGrey = 128;
constexpr double kResultBytesPerPixel = 16;
constexpr double kResultBytes = 256e6;  // at a time, beside a set that is in memory whole

std::vector<const View*> ViewsToCompare(const DtrSet& set, bool leave_one_out) {
  std::vector<const View*> views;
  if (set.frames.empty()) throw Error("evaluate: the set has no frame");
  int sources = 0;
  for (const View& view : set.frames.front().views) {
    sources += view.role == ViewRole::kSource;
    if (view.role != (leave_one_out ? ViewRole::kSource : ViewRole::kHeldOut)) continue;
    if (view.image.empty()) {
      throw Error("evaluate: view " + view.name +
                  " has no image in memory; load the set with its "
                  "held-out views");
    }
    views.push_back(&view);
  }
  if (leave_one_out && sources < 2) {
    throw UsageError("`leave_one_out`: expected at least 2 source views in the set, found " +
                     std::to_string(sources));
  }
  if (views.empty()) {
    throw UsageError(
        "evaluate: expected a held-out view in the set, found none; build it with `holdout` "
        "every:8, or use `leave_one_out`");
  }
  return views;
}

/// 255 where the view's own depth map has a value; a depth pixel stands for s x s image pixels.
Mask HasOwnDepth(const View& view) {
  Mask mask(view.camera.width_px(), view.camera.height_px());
  for (int y = 0; y < mask.height(); ++y) {
    for (int x = 0; x < mask.width(); ++x) {
      const int column = x / view.depth_scale, row = y / view.depth_scale;
      if (!view.depth_state.empty() && view.depth_state(column, row) != DepthState::kMeasured) {
        continue;
      }
      const float depth = view.depth(column, row);
      if (!DepthImage::IsHole(depth)) mask(x, y) = 255;
    }
  }
  return mask;
}

ViewScore Score(const View& view, const RenderResult& filled) {
  ViewScore score;
  score.name = view.name;
  score.psnr_db = Psnr(filled.image, view.image, view.mask);
  const Mask seen = Intersect(filled.coverage, view.mask);
  score.psnr_covered_db = Psnr(filled.image, view.image, seen);
  score.psnr_cc_db = ColourCorrectedPsnr(filled.image, view.image, view.mask);
  if (view.depth.width() > 0) {
    score.psnr_own_depth_db =
        Psnr(filled.image, view.image, Intersect(HasOwnDepth(view), view.mask));
  }
  score.ssim = Ssim(filled.image, view.image, view.mask);
  score.coverage = ShareOf(filled.coverage, view.mask);
  score.views_used = static_cast<int>(filled.views_used.size());
  return score;
}

struct Rendered {
  size_t index;  ///< among the views that are compared
  const View* view;
  RenderResult filled;
  double ms;
};

/// Mean of a figure over the views that have it.
std::optional<double> MeanOf(const std::vector<ViewScore>& views,
                             std::optional<double> ViewScore::*figure) {
  double sum = 0;
  int count = 0;
  for (const ViewScore& view : views) {
    if (!(view.*figure).has_value()) continue;
    sum += *(view.*figure);
    ++count;
  }
  if (count == 0) return std::nullopt;
  return sum / count;
}

}  // namespace

EvaluationReport EvaluateHeldOut(const DtrSet& set, const EvaluateOptions& options,
                                 const RenderFunction& render, Progress& progress) {
  const std::vector<const View*> views = ViewsToCompare(set, options.leave_one_out);
  RenderOptions render_options = options.render;
  // One rendering serves both figures: filling changes unseen pixels only.
  render_options.fill_holes = true;

  EvaluationReport report;
  report.leave_one_out = options.leave_one_out;
  report.not_registered = options.not_registered;
  progress.Stage("evaluate", static_cast<int>(views.size()));
  report.views.resize(views.size());
  double largest_px = 1;
  for (const View* view : views) {
    largest_px = std::max(largest_px, 1.0 * view->camera.width_px() * view->camera.height_px());
  }
  Batches<Rendered> rendered(kResultBytesPerPixel * largest_px, kResultBytes, [&](Rendered& frame) {
    ViewScore& score = report.views[frame.index];
    score = Score(*frame.view, frame.filled);
    score.render_ms = frame.ms;
    if (options.on_rendered) options.on_rendered(*frame.view, frame.filled);
  });
  for (size_t i = 0; i < views.size(); ++i) {
    const View* const view = views[i];
    progress.ThrowIfInterrupted();
    std::vector<std::string> excluded;
    if (options.leave_one_out) excluded.push_back(view->id);
    const RenderScene scene = MakeRenderScene(set, excluded);
    const auto start = std::chrono::steady_clock::now();
    RenderResult filled = render(scene, view->camera, view->cam_from_world, render_options);
    const std::chrono::duration<double, std::milli> elapsed =
        std::chrono::steady_clock::now() - start;
    rendered.Add({i, view, std::move(filled), elapsed.count()});
    progress.Update(static_cast<int>(i) + 1);
  }
  rendered.Finish();

  ViewScore& mean = report.mean;
  mean.name = "mean";
  mean.psnr_db = MeanOf(report.views, &ViewScore::psnr_db);
  mean.psnr_covered_db = MeanOf(report.views, &ViewScore::psnr_covered_db);
  mean.psnr_cc_db = MeanOf(report.views, &ViewScore::psnr_cc_db);
  mean.psnr_own_depth_db = MeanOf(report.views, &ViewScore::psnr_own_depth_db);
  mean.ssim = MeanOf(report.views, &ViewScore::ssim);
  for (const ViewScore& view : report.views) {
    mean.coverage += view.coverage / static_cast<double>(report.views.size());
    mean.render_ms += view.render_ms / static_cast<double>(report.views.size());
  }
  return report;
}

ImageRgb8 ComparisonImage(const ImageRgb8& rendered, const ImageRgb8& photo, const Mask& mask) {
  const auto fits = [&](const Grid<std::uint8_t>& other) {
    return other.width() == rendered.width() && other.height() == rendered.height();
  };
  if (rendered.empty() || rendered.channels() != 3 || photo.channels() != 3 || !fits(photo) ||
      !(mask.empty() || fits(mask))) {
    throw std::invalid_argument("ComparisonImage: the images must be RGB and of one size");
  }
  const int width = rendered.width(), stride = width + kGapPx;
  ImageRgb8 sheet(3 * width + 2 * kGapPx, rendered.height(), 3, kGapGrey);
  for (int y = 0; y < rendered.height(); ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) {
        const int a = rendered(x, y, c), b = photo(x, y, c);
        sheet(x, y, c) = rendered(x, y, c);
        if (!mask.empty() && mask(x, y) == 0) continue;
        sheet(stride + x, y, c) = photo(x, y, c);
        sheet(2 * stride + x, y, c) =
            static_cast<std::uint8_t>(std::min(255, kDifferenceGain * std::abs(a - b)));
      }
    }
  }
  return sheet;
}

}  // namespace dtr::eval
