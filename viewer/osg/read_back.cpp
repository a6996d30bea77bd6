#include "viewer/osg/read_back.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include "dtr/base/parallel_for.h"
#include "dtr/render/blend_weights.h"
#include "dtr/render/colour.h"
#include "dtr/render/frame.h"
#include "dtr/render/geometry.h"
#include "dtr/render/texture.h"
#include "dtr/render/valid_views.h"

namespace osgDTR {
namespace {

using namespace dtr;

/// A view as it came back, and what blending needs to know of it.
struct Projected {
  const View* view = nullptr;
  RenderResult picture;
  Pose view_from_novel;
  Grid<std::uint8_t> rim_factors;  ///< SPEC 4.8
  double delta = 0;                ///< SPEC 4.2, a difference of 1/z
  double cut_factor = 1;           ///< SPEC 1.4
};

/// What one view says at one pixel.
struct Fragment {
  const Projected* of = nullptr;
  double inverse_depth = 0, angle_rad = 0;
  Eigen::Vector3d p_in_novel = Eigen::Vector3d::Zero();
};

class PixelBlender {
 public:
  PixelBlender(const RenderScene& scene, const PinholeCamera& novel, const RenderOptions& options,
               bool per_pixel, std::span<const Projected> views)
      : novel_(novel),
        options_(options),
        per_pixel_(per_pixel),
        weights_(BlendParametersOf(options, novel.fx_px(), scene.bounds)),
        views_(views) {}

  void Blend(int x, int y, RenderResult& result) {
    Collect(x, y);
    if (fragments_.empty()) return;
    double front = 0, border = 0;
    for (const Fragment& f : fragments_) {
      front = std::max(front, f.inverse_depth);
      border = std::max(border, Pushed(f));
    }
    result.coverage(x, y) = 255;
    result.depth(x, y) = static_cast<float>(1 / front);
    std::erase_if(fragments_, [&](const Fragment& f) { return f.inverse_depth < border; });
    const double cut_rad = per_pixel_ ? KeepNearest() : 0;
    angles_.clear(), factors_.clear();
    for (const Fragment& f : fragments_) {
      angles_.push_back(f.angle_rad);
      factors_.push_back(FactorOf(f, cut_rad));
    }
    shares_.resize(angles_.size());
    result.view_count(x, y) =
        static_cast<std::uint8_t>(std::min(BlendShares(weights_, angles_, shares_), 255));
    FadeShares(factors_, shares_);
    WriteSum(x, y, result);
  }

 private:
  void Collect(int x, int y) {
    fragments_.clear();
    const Eigen::Vector3d ray = novel_.RayFromPixel({x + 0.5, y + 0.5});
    for (const Projected& view : views_) {
      const float z = view.picture.depth(x, y);
      if (view.picture.coverage(x, y) == 0 || DepthImage::IsHole(z)) continue;
      const Eigen::Vector3d p = ray * static_cast<double>(z);
      const double angle = AngleAt(view, p);
      if (per_pixel_ && angle > options_.max_angle_rad) continue;  // SPEC 1.3
      fragments_.push_back({&view, 1 / static_cast<double>(z), angle, p});
    }
  }

  /// SPEC 4.5.
  double AngleAt(const Projected& view, const Eigen::Vector3d& p_in_novel) const {
    const double nearer = p_in_novel.z() * weights_.least_inverse_depth;
    const Eigen::Vector3d at = p_in_novel / std::max(1.0, nearer);
    return AngleBetween(view.view_from_novel.TargetOriginInSource() - at, -at);
  }

  double Pushed(const Fragment& f) const {
    if (options_.absolute_delta) return 1 / (1 / f.inverse_depth + *options_.absolute_delta);
    return f.inverse_depth - f.of->delta;
  }

  /// SPEC 1.3; returns SPEC 1.4's cut.
  double KeepNearest() {
    const auto most = static_cast<size_t>(options_.views);
    if (fragments_.size() <= most) return options_.max_angle_rad;
    std::vector<double> sorted;
    for (const Fragment& f : fragments_) sorted.push_back(f.angle_rad);
    std::sort(sorted.begin(), sorted.end());
    std::erase_if(fragments_, [&](const Fragment& f) { return f.angle_rad > sorted[most - 1]; });
    return sorted[most];
  }

  double FactorOf(const Fragment& f, double cut_rad) const {
    const double cut = per_pixel_ ? CutFactor(f.angle_rad, cut_rad) : f.of->cut_factor;
    const auto pixel = f.of->view->camera.PixelFromCam(f.of->view_from_novel * f.p_in_novel);
    return pixel ? cut * RimFactorAt(f.of->rim_factors, *pixel) : cut;
  }

  void WriteSum(int x, int y, RenderResult& result) const {
    const bool linear = options_.blend_in_linear_light;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (size_t i = 0; i < fragments_.size(); ++i) {
      const ImageRgb8& image = fragments_[i].of->picture.image;
      for (int c = 0; c < 3; ++c) {
        const std::uint8_t value = image(x, y, c);
        sum[c] += shares_[i] * (linear ? LinearFromSrgb8()[value] : value / 255.0);
      }
    }
    for (int c = 0; c < 3; ++c) {
      result.image(x, y, c) = linear ? Srgb8FromLinear(sum[c]) : Srgb8FromSrgb(sum[c]);
    }
  }

  const PinholeCamera& novel_;
  const RenderOptions& options_;
  const bool per_pixel_;
  const BlendParameters weights_;
  const std::span<const Projected> views_;
  std::vector<Fragment> fragments_;
  std::vector<double> angles_, shares_, factors_;
};

Projected ProjectAndReadBack(gl::Renderer& renderer, const View& view, const PinholeCamera& novel,
                             const Pose& novel_from_world, RenderOptions options) {
  RenderScene alone;
  alone.views = {&view};
  alone.per_pixel = false;
  options.max_angle_rad = std::numbers::pi;  // which views are valid was decided among all of them
  options.fill_holes = options.smooth_edges = false;
  return {&view,
          renderer.Render(alone, novel, novel_from_world, options),
          view.cam_from_world * novel_from_world.Inverse(),
          RimFactors(view),
          ThresholdsOf(view, options).delta,
          1};
}

}  // namespace

RenderResult RenderByReadBack(gl::Renderer& renderer, const RenderScene& scene,
                              const PinholeCamera& novel, const Pose& novel_from_world,
                              const RenderOptions& options) {
  RenderOptions two_pass = options;
  two_pass.method = RenderMethod::kTwoPass;
  CheckNovelCamera(novel, novel_from_world);
  RenderResult result = EmptyResult(novel);
  const ViewSelection selection = SelectViews(scene, novel_from_world, two_pass);
  result.views_used = selection.views;
  const std::vector<double> cuts = CutFactors(selection, selection.views.size());
  std::vector<Projected> views;
  for (const int index : CanonicalOrder(scene, selection.views)) {
    const View& view = *scene.views[static_cast<size_t>(index)];
    views.push_back(ProjectAndReadBack(renderer, view, novel, novel_from_world, two_pass));
    const auto rank = std::find(selection.views.begin(), selection.views.end(), index);
    views.back().cut_factor = cuts[static_cast<size_t>(rank - selection.views.begin())];
  }
  ParallelFor(0, novel.height_px(), [&](int y) {
    PixelBlender blender(scene, novel, two_pass, selection.per_pixel, views);
    for (int x = 0; x < novel.width_px(); ++x) blender.Blend(x, y, result);
  });
  result.coverage_share = CoverageShare(result.coverage);
  return result;
}

}  // namespace osgDTR
