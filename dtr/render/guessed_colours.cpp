#include "dtr/render/guessed_colours.h"

#include <algorithm>

#include "dtr/render/frame.h"
#include "dtr/render/geometry.h"
#include "dtr/render/texture.h"

namespace dtr {
namespace {

// Depths that are tried for a hole, between its farthest and its nearest guess (SPEC 7.2).
constexpr int kTriedDepths = 8;

Eigen::Matrix3d CalibrationOf(const PinholeCamera& camera) {
  Eigen::Matrix3d k;
  k << camera.fx_px(), 0, camera.cx_px(), 0, camera.fy_px(), camera.cy_px(), 0, 0, 1;
  return k;
}

/// Depth that the view measured at an image pixel. Dividing costs as much as all the rest.
float DepthAt(const View& view, int x, int y) {
  if (view.depth_scale == 1) return view.depth(x, y);
  return view.depth(x / view.depth_scale, y / view.depth_scale);
}

}  // namespace

GuessedColours::GuessedColours(const RenderScene& scene, const std::vector<int>& views_used,
                               const PinholeCamera& novel, const Pose& novel_from_world,
                               const RenderOptions& options)
    : novel_(novel), blend_(BlendParametersOf(options, novel.fx_px())) {
  const size_t count = std::min(views_used.size(), static_cast<size_t>(options.views));
  const std::vector<int> nearest(views_used.begin(),
                                 views_used.begin() + static_cast<std::ptrdiff_t>(count));
  const Eigen::Matrix3d ray_from_pixel = CalibrationOf(novel).inverse();
  for (const int index : CanonicalOrder(scene, nearest)) {
    const View& view = *scene.views[static_cast<size_t>(index)];
    const ViewPlacement placed = PlaceView(view, novel_from_world);
    const Eigen::Matrix3d pixel_from_novel =
        CalibrationOf(view.camera) * placed.rotation.transpose();
    views_.push_back({&view, pixel_from_novel * ray_from_pixel,
                      -(pixel_from_novel * placed.translation), placed.translation,
                      ThresholdsOf(view, options).delta});
  }
}

GuessedColours::Row::Row(const GuessedColours& guesses, int y)
    : guesses_(guesses), y_(y), asked_(guesses.views_.size()) {
  for (size_t i = 0; i < asked_.size(); ++i) {
    const Eigen::Matrix3d& from_novel = guesses.views_[i].pixel_from_novel_pixel;
    asked_[i].pixel_per_x = from_novel.col(0);
    asked_[i].pixel_at_0 = from_novel * Eigen::Vector3d(0.5, y + 0.5, 1);
  }
}

/// Puts the point before every view. False as soon as one measured something behind it, unless
/// that shall not matter; then asked_ is not complete.
bool GuessedColours::Row::Ask(int x, double inverse_depth, bool despite_what_is_seen) {
  for (size_t n = 0; n < asked_.size(); ++n) {
    // The last sceptic first, then in turn: order decides nothing but the time.
    const size_t i = n == 0 ? sceptic_ : n - (n <= sceptic_ ? 1 : 0);
    const Placed& placed = guesses_.views_[i];
    Asked& asked = asked_[i];
    asked.answers = false;
    const Eigen::Vector3d p =
        asked.pixel_at_0 + x * asked.pixel_per_x + inverse_depth * placed.pixel_per_inverse_depth;
    if (!(p.z() > 0)) continue;
    const double per_z = 1 / p.z();
    asked.pixel = p.head<2>() * per_z;
    const View& view = *placed.view;
    if (!view.camera.Contains(asked.pixel)) continue;
    asked.answers = true;
    const double measured = static_cast<double>(
        DepthAt(view, static_cast<int>(asked.pixel.x()), static_cast<int>(asked.pixel.y())));
    if (!(measured > 0)) continue;
    const double inverse_depth_in_view = inverse_depth * per_z, delta = placed.delta_inverse_depth;
    asked.answers = measured * (inverse_depth_in_view + delta) >= 1;
    if (!despite_what_is_seen && measured * (inverse_depth_in_view - delta) > 1) {
      sceptic_ = i;
      return false;
    }
  }
  return true;
}

std::optional<Eigen::Vector3d> GuessedColours::Row::Blend(int x, double inverse_depth) {
  const Eigen::Vector3d ray = guesses_.novel_.RayFromPixel({x + 0.5, y_ + 0.5});
  const double ray_squared = ray.squaredNorm();
  dots_.clear();
  angles_.clear();
  colours_.clear();
  for (size_t i = 0; i < asked_.size(); ++i) {
    if (!asked_[i].answers) continue;
    const auto colour = ColourAt(*guesses_.views_[i].view, asked_[i].pixel, true);
    if (!colour) continue;
    colours_.push_back(*colour);
    // Angle at the point ray / w between c - ray / w and -ray / w, both times w.
    const Eigen::Vector3d c = inverse_depth * guesses_.views_[i].center_in_novel;
    angles_.push_back(c.cross(ray).norm());
    dots_.push_back(ray_squared - c.dot(ray));
  }
  if (colours_.empty()) return std::nullopt;
  if (colours_.size() == 1) return colours_.front();
  for (size_t i = 0; i < angles_.size(); ++i) angles_[i] = QuickAngle(angles_[i], dots_[i]);
  shares_.resize(angles_.size());
  BlendShares(guesses_.blend_, angles_, shares_);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < colours_.size(); ++i) sum += shares_[i] * colours_[i];
  return sum;
}

std::optional<GuessedColour> GuessedColours::Row::At(int x, double farthest, double nearest) {
  double tried = farthest;
  bool possible = false;
  for (int k = kTriedDepths - 1; k > 0 && nearest > farthest && !possible; --k) {
    tried = farthest + (nearest - farthest) * k / (kTriedDepths - 1);
    possible = Ask(x, tried, false);
  }
  if (!possible) {
    tried = farthest;
    Ask(x, tried, true);
  }
  const auto colour = Blend(x, tried);
  if (!colour) return std::nullopt;
  return GuessedColour{*colour, tried};
}

}  // namespace dtr
