#include "dtr/cpu/resolve.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "dtr/render/colour.h"
#include "dtr/render/deferred_limits.h"
#include "dtr/render/exposure.h"
#include "dtr/render/geometry.h"
#include "dtr/render/texture.h"
#include "dtr/render/valid_views.h"

namespace dtr::cpu {
namespace {

struct Fragment {
  const ResolveView* view = nullptr;
  double inverse_depth = 0;
  Eigen::Vector3d point_in_novel = Eigen::Vector3d::Zero();
  Eigen::Vector2d source_pixel = Eigen::Vector2d::Zero();  ///< on the view's image
  Eigen::Vector3d colour = Eigen::Vector3d::Zero();        ///< SPEC 4.4
  double angle_rad = 0;                                    ///< SPEC 4.5, at the point
};

class RowResolver {
 public:
  RowResolver(const ResolveSettings& settings, std::span<const ResolveView> views,
              std::span<Grid<float>> shares_of_views)
      : settings_(settings), views_(views), shares_of_views_(shares_of_views) {}

  void Resolve(int x, int y, RenderResult& result) {
    Collect(x, y);
    if (fragments_.empty()) return;
    const double front = FrontInverseDepth();
    RestoreClipped(x, y, front);
    const double border = BorderInverseDepth();
    result.coverage(x, y) = 255;
    result.depth(x, y) = static_cast<float>(1 / front);
    if (NearBorder(front, border)) result.delta_border(x, y) = 255;
    // SPEC 4.3, pass 2: the same Delta as in pass 1.
    std::erase_if(fragments_, [&](const Fragment& f) { return f.inverse_depth < border; });
    if (settings_.per_pixel_rule) {
      KeepNearestByAngle();
    } else {
      for (Fragment& f : fragments_) f.angle_rad = AngleAt(f);
    }
    Blend(x, y, result);
  }

 private:
  /// SPEC 4.5.
  double AngleAt(const Fragment& f) const {
    const double w = std::max(f.inverse_depth, settings_.blend.least_inverse_depth);
    const Eigen::Vector3d point_in_novel = (f.inverse_depth / w) * f.point_in_novel;
    return AngleBetween(f.view->in_novel->translation - point_in_novel, -point_in_novel);
  }

  /// SPEC 4.2: one fragment per view; those without a colour are absent.
  void Collect(int x, int y) {
    fragments_.clear();
    const Eigen::Vector3d ray = settings_.novel.RayFromPixel({x + 0.5, y + 0.5});
    for (const ResolveView& view : views_) {
      const Band& band = view.layer->band;
      const size_t index =
          static_cast<size_t>(y - band.first_row) * static_cast<size_t>(band.width_px) +
          static_cast<size_t>(x);
      Fragment fragment{&view, view.layer->inverse_depth[index]};
      if (!(fragment.inverse_depth > 0)) continue;
      // SPEC 6.1: a depth that float32 cannot hold would be covered and have no depth.
      if (DepthImage::IsHole(static_cast<float>(1 / fragment.inverse_depth))) continue;
      fragment.point_in_novel = ray / fragment.inverse_depth;
      if (settings_.per_pixel_rule) {
        fragment.angle_rad = AngleAt(fragment);
        if (fragment.angle_rad > settings_.blend.max_angle_rad) continue;
      }
      if (!FindColour(fragment)) continue;
      fragments_.push_back(fragment);
    }
  }

  /// SPEC 4.4. False where the view has no colour to give.
  bool FindColour(Fragment& fragment) const {
    const View& source = *fragment.view->in_novel->view;
    const Eigen::Vector3d point_in_view =
        fragment.view->view_from_novel_rotation * fragment.point_in_novel +
        fragment.view->view_from_novel_translation;
    const auto pixel = source.camera.PixelFromCam(point_in_view);
    if (!pixel || !pixel->allFinite()) return false;
    fragment.source_pixel = *pixel;
    const auto colour = ColourAt(source, fragment.source_pixel, settings_.linear_light);
    fragment.colour = colour.value_or(Eigen::Vector3d::Zero());
    return colour.has_value();
  }

  double ClippedShareOf(const Fragment& f) const {
    return ClippedShare(f.view->clipped, f.colour.maxCoeff(), settings_.linear_light);
  }

  /// SPEC 4.4: the greatest value of each channel that a photo has at a point and did not clip.
  Eigen::Vector3d Unclipped(const Eigen::Vector3d& point_in_novel) const {
    Eigen::Vector3d greatest = Eigen::Vector3d::Zero();
    for (const ResolveView& view : views_) {
      Fragment at{&view, 0, point_in_novel};
      if (!FindColour(at) || !view.in_novel->view->camera.Contains(at.source_pixel)) continue;
      if (ClippedShareOf(at) < 0.5) greatest = greatest.cwiseMax(at.colour);
    }
    return greatest;
  }

  /// SPEC 4.4: clipped colours as others measured them, where they measured one.
  void RestoreClipped(int x, int y, double front) {
    const auto clipped = [](const Fragment& f) { return f.view->clipped > 0; };
    if (std::none_of(fragments_.begin(), fragments_.end(), clipped)) return;
    const Eigen::Vector3d unclipped =
        Unclipped(settings_.novel.RayFromPixel({x + 0.5, y + 0.5}) / front);
    const double least = settings_.linear_light ? kSameSurfaceInLinearLight : kSameSurface;
    for (Fragment& f : fragments_) {
      const bool same = (unclipped.array() >= least * f.colour.array()).all();
      if (same) f.colour += ClippedShareOf(f) * (unclipped - f.colour);
    }
  }

  /// SPEC 4.2, pass 1: where Delta pushes a fragment; only the compared depth moves.
  double Pushed(const Fragment& fragment) const {
    if (settings_.absolute_delta) {
      return 1 / (1 / fragment.inverse_depth + *settings_.absolute_delta);
    }
    return fragment.inverse_depth - fragment.view->delta_inverse_depth;
  }

  double FrontInverseDepth() const {
    double front = 0;
    for (const Fragment& f : fragments_) front = std::max(front, f.inverse_depth);
    return front;
  }

  double BorderInverseDepth() const {
    double border = Pushed(fragments_.front());
    for (const Fragment& f : fragments_) border = std::max(border, Pushed(f));
    return border;
  }

  bool NearBorder(double front, double border) const {
    const double margin = kBorderShare * (front - border);
    return std::any_of(fragments_.begin(), fragments_.end(), [&](const Fragment& f) {
      return std::abs(f.inverse_depth - border) <= margin;
    });
  }

  /// SPEC 1.3: per pixel the K nearest by angle; views tied with the K-th stay.
  void KeepNearestByAngle() {
    const auto count = static_cast<size_t>(settings_.views);
    cut_rad_ = settings_.blend.max_angle_rad;
    if (fragments_.size() <= count) return;
    std::vector<double> angles;
    for (const Fragment& f : fragments_) angles.push_back(f.angle_rad);
    std::sort(angles.begin(), angles.end());
    const double limit = angles[count - 1];
    cut_rad_ = angles[count];
    std::erase_if(fragments_, [&](const Fragment& f) { return f.angle_rad > limit; });
  }

  /// SPEC 1.4 and 4.8.
  double FactorOf(const Fragment& f) const {
    const double cut =
        settings_.per_pixel_rule ? CutFactor(f.angle_rad, cut_rad_) : f.view->cut_factor;
    return cut * f.view->fading.Of(RimFactorAt(f.view->rim_factors, f.source_pixel));
  }

  /// SPEC 4.5 to 4.8: weights, one sum, one division.
  void Blend(int x, int y, RenderResult& result) {
    angles_.clear();
    for (const Fragment& f : fragments_) angles_.push_back(f.angle_rad);
    shares_.resize(angles_.size());
    const int blended = BlendShares(settings_.blend, angles_, shares_);
    factors_.clear();
    for (const Fragment& f : fragments_) factors_.push_back(FactorOf(f));
    FadeShares(factors_, shares_);
    for (size_t i = 0; i < fragments_.size() && !shares_of_views_.empty(); ++i) {
      const auto view = static_cast<size_t>(fragments_[i].view - views_.data());
      shares_of_views_[view](x, y) = static_cast<float>(shares_[i]);
    }
    result.view_count(x, y) = static_cast<std::uint8_t>(std::min(blended, 255));
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (size_t i = 0; i < fragments_.size(); ++i) sum += shares_[i] * fragments_[i].colour;
    for (int channel = 0; channel < 3; ++channel) {
      result.image(x, y, channel) =
          settings_.linear_light ? Srgb8FromLinear(sum[channel]) : Srgb8FromSrgb(sum[channel]);
    }
  }

  const ResolveSettings& settings_;
  const std::span<const ResolveView> views_;
  const std::span<Grid<float>> shares_of_views_;  ///< empty: unset
  std::vector<Fragment> fragments_;
  std::vector<double> angles_, shares_, factors_;
  double cut_rad_ = 0;  ///< SPEC 1.4, with the per-pixel rule
};

}  // namespace

void ResolveRow(const ResolveSettings& settings, std::span<const ResolveView> views, int y,
                RenderResult& result, std::span<Grid<float>> shares) {
  RowResolver resolver(settings, views, shares);
  for (int x = 0; x < settings.novel.width_px(); ++x) resolver.Resolve(x, y, result);
}

}  // namespace dtr::cpu
