#include "dtr/render/guessed_colours.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "dtr/render/colour.h"
#include "dtr/render/frame.h"
#include "dtr/render/geometry.h"
#include "dtr/render/texture.h"

namespace dtr {
namespace {

// Depths that are tried for a hole, between its farthest and its nearest guess (SPEC 7.2).
constexpr int kTriedDepths = 8;

// SPEC 7.4.
constexpr double kExposureSamples = 20000, kNearWhite = 0.85, kMostExposure = 2,
                 kExposureNoise = 0.01;
constexpr int kFewestExposed = 200;
constexpr double kRimShare = 0.05,
                 kLeastFade = 1e-3;  // of the shorter side; a lone view answers too

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

/// From nearly 0 at the rim of a photo to 1 where it is farther in: no border of a photo shows in
/// what is filled.
double FadeAtRim(const PinholeCamera& camera, const Eigen::Vector2d& pixel) {
  const double to_rim = std::min(
      {pixel.x(), pixel.y(), camera.width_px() - pixel.x(), camera.height_px() - pixel.y()});
  const double width = kRimShare * std::min(camera.width_px(), camera.height_px());
  const double t = std::clamp(to_rim / width, kLeastFade, 1.0);
  return t * t * (3 - 2 * t);
}

/// What the view shows of a surface that the picture shows at a pixel; none where it measured
/// another.
std::optional<Eigen::Vector3d> ColourOfSurface(const GuessedColours::Placed& placed, int x, int y,
                                               double inverse_depth) {
  const Eigen::Vector3d p = placed.pixel_from_novel_pixel * Eigen::Vector3d(x + 0.5, y + 0.5, 1) +
                            inverse_depth * placed.pixel_per_inverse_depth;
  if (!(p.z() > 0)) return std::nullopt;
  const Eigen::Vector2d pixel = p.head<2>() / p.z();
  if (!placed.view->camera.Contains(pixel)) return std::nullopt;
  const float z = DepthAt(*placed.view, static_cast<int>(pixel.x()), static_cast<int>(pixel.y()));
  if (DepthImage::IsHole(z)) return std::nullopt;
  const double off = 1 / static_cast<double>(z) - inverse_depth / p.z();
  if (std::abs(off) > placed.delta_inverse_depth) return std::nullopt;
  return ColourAt(*placed.view, pixel, true);
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

void GuessedColours::MatchExposures(const Grid<float>& seen, const ImageRgb8& image) {
  const std::array<double, 256>& linear = LinearFromSrgb8();
  const double pixels = static_cast<double>(seen.width()) * seen.height();
  const int step = std::max(1, static_cast<int>(std::sqrt(pixels / kExposureSamples)));
  for (Placed& placed : views_) {
    Eigen::Vector3d in_picture = Eigen::Vector3d::Zero(), in_view = Eigen::Vector3d::Zero();
    int count = 0;
    for (int y = step / 2; y < seen.height(); y += step) {
      for (int x = step / 2; x < seen.width(); x += step) {
        if (!(seen(x, y) > 0)) continue;
        const auto colour = ColourOfSurface(placed, x, y, 1 / static_cast<double>(seen(x, y)));
        const std::uint8_t* rgb = &image(x, y);
        const Eigen::Vector3d shown(linear[rgb[0]], linear[rgb[1]], linear[rgb[2]]);
        if (!colour || std::max(colour->maxCoeff(), shown.maxCoeff()) > kNearWhite) continue;
        in_picture += shown;
        in_view += *colour;
        ++count;
      }
    }
    if (count < kFewestExposed) continue;
    for (int c = 0; c < 3; ++c) {
      if (!(in_view[c] > 0)) continue;
      const double exposure =
          std::clamp(in_picture[c] / in_view[c], 1 / kMostExposure, kMostExposure);
      if (std::abs(exposure - 1) > kExposureNoise) placed.exposure[c] = exposure;
    }
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
  fades_.clear();
  for (size_t i = 0; i < asked_.size(); ++i) {
    if (!asked_[i].answers) continue;
    const auto colour = ColourAt(*guesses_.views_[i].view, asked_[i].pixel, true);
    if (!colour) continue;
    const Eigen::Vector3d& exposure = guesses_.views_[i].exposure;
    colours_.emplace_back(Exposed(colour->x(), exposure.x()), Exposed(colour->y(), exposure.y()),
                          Exposed(colour->z(), exposure.z()));
    fades_.push_back(FadeAtRim(guesses_.views_[i].view->camera, asked_[i].pixel));
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
  double shares = 0;
  for (size_t i = 0; i < colours_.size(); ++i) {
    sum += shares_[i] * fades_[i] * colours_[i];
    shares += shares_[i] * fades_[i];
  }
  if (shares > 0) return sum / shares;
  return colours_.front();  // all shares are too small to be told from 0
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
