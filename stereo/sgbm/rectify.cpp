#include "stereo/sgbm/rectify.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace dtr::stereo {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Smallest z of a corner's unit ray in the rectified frame: beyond 75 deg from the common axis the
/// image is stretched so much (1 / cos^2 > 14) that block matching means nothing.
constexpr double kMinCornerCosine = 0.26;
/// A baseline shorter than this share of the near depth gives less than a disparity of one pixel
/// over any range at any usual focal length.
constexpr double kMinBaselineToDepth = 1e-4;
/// Room for matches just outside the range, which are then discarded instead of misplaced.
constexpr double kDisparityMarginPx = 8;
/// The search goes on to infinity when that costs no more than this (sky then finds its true place,
/// out of range, instead of a wrong one in it).
constexpr double kInfinityCostPx = 32;
constexpr double kInfinityCostShare = 0.3;
/// Smaller common areas than this many pixels in either direction are not worth matching.
constexpr int kMinSize = 32;
/// The rectified image has at most so many times the pixels of the reference.
constexpr double kMaxGrowth = 2.0;

/// A plane seen by the neighbour that much narrower (or wider) than by the reference is not
/// matched.
constexpr double kMinCompression = 0.3;

/// Extent of an image in the rectified frame, on the plane z = 1.
struct Extent {
  double x0 = std::numeric_limits<double>::infinity(), x1 = -x0;
  double y0 = x0, y1 = -x0;
  double min_z = x0, max_z = 0;  ///< of the corners' rays with z = 1 in their own camera
  bool in_front = true;
};

Extent ExtentOf(const PinholeCamera& camera, const Matrix3d& rect_from_cam) {
  Extent e;
  const double w = camera.width_px(), h = camera.height_px();
  const std::array<Eigen::Vector2d, 4> corners{{{0, 0}, {w, 0}, {0, h}, {w, h}}};
  for (const auto& corner : corners) {
    const Vector3d ray = rect_from_cam * camera.RayFromPixel(corner);
    e.in_front = e.in_front && ray.z() > kMinCornerCosine * ray.norm();
    if (!(ray.z() > 0)) continue;
    e.x0 = std::min(e.x0, ray.x() / ray.z()), e.x1 = std::max(e.x1, ray.x() / ray.z());
    e.y0 = std::min(e.y0, ray.y() / ray.z()), e.y1 = std::max(e.y1, ray.y() / ray.z());
    e.min_z = std::min(e.min_z, ray.z()), e.max_z = std::max(e.max_z, ray.z());
  }
  return e;
}

/// Disparities to search per unit of focal length (so also: differences of x on the plane z = 1).
struct Search {
  double low = 0, high = 0;
};

Search SearchOf(double baseline, const DepthRange& range, const Extent& reference) {
  // Z of a point at depth z is z times the rectified z of its pixel's ray, linear over the image.
  return {baseline / (range.far_z * reference.max_z), baseline / (range.near_z * reference.min_z)};
}

/// Focal length that keeps the area of a pixel at the centre of the reference image.
double FocalKeepingArea(const PinholeCamera& camera, const Matrix3d& rect_from_cam) {
  const Vector3d ray =
      rect_from_cam *
      camera.RayFromPixel({0.5 * camera.width_px(), 0.5 * camera.height_px()}).normalized();
  return std::sqrt(camera.fx_px() * camera.fy_px()) * std::pow(ray.z(), 1.5);
}

/// Disparity span, with margins, at a focal length.
void FitDisparities(const Search& search, double focal_px, RectifiedPair* pair) {
  const double infinity_px = 0;
  pair->low_px = search.low * focal_px - kDisparityMarginPx;
  pair->high_px = search.high * focal_px + kDisparityMarginPx;
  const double to_infinity = pair->low_px - infinity_px;
  const double span = pair->high_px - pair->low_px;
  if (to_infinity <= std::max(kInfinityCostPx, kInfinityCostShare * span)) {
    pair->low_px = std::min(pair->low_px, infinity_px - kDisparityMarginPx);
  }
}

/// Whole pixels that cover a length. Poses far from the origin carry rounding errors; without the
/// slack they would decide between two sizes.
int Cover(double length_px) {
  constexpr double kSlackPx = 1e-5;
  return static_cast<int>(std::ceil(length_px - kSlackPx));
}

/// A multiple of 16, as the matcher wants it.
int RoundedSteps(double span_px) { return 16 * Cover(span_px / 16.0); }

struct Window {
  double x0, x1, y0, y1;  // on the plane z = 1, part of the reference to match
};

/// Focal length reduced until disparities, volume and growth stay within their limits.
double FitFocal(double focal_px, const Search& search, const Window& window, double max_pixels,
                const PairLimits& limits, RectifiedPair* pair) {
  constexpr double kStep = 0.95;
  for (;; focal_px *= kStep) {
    FitDisparities(search, focal_px, pair);
    const double width = (window.x1 - window.x0) * focal_px;
    const double height = (window.y1 - window.y0) * focal_px;
    const double disparities = RoundedSteps(pair->high_px - pair->low_px);
    if (width * height <= max_pixels && disparities <= limits.max_disparities &&
        width * height * disparities <= static_cast<double>(limits.max_volume)) {
      return focal_px;
    }
    if (focal_px < kMinSize) return focal_px;  // hopeless; the caller finds the image too small
  }
}

/// Rotation whose x axis is the baseline and whose z axis is as near as may be to both views'.
std::optional<Matrix3d> RectFromWorld(const StereoView& a, const StereoView& b,
                                      const Vector3d& direction) {
  const Vector3d axis_a = a.cam_from_world.rotation.conjugate() * Vector3d::UnitZ();
  const Vector3d axis_b = b.cam_from_world.rotation.conjugate() * Vector3d::UnitZ();
  const Vector3d mean = axis_a + axis_b;
  const Vector3d across = mean - direction * direction.dot(mean);
  if (axis_a.dot(axis_b) <= 0 || across.norm() < kMinCornerCosine) return std::nullopt;
  Matrix3d rect_from_world;
  rect_from_world.row(0) = direction;
  rect_from_world.row(2) = across.normalized();
  rect_from_world.row(1) = across.normalized().cross(direction);
  return rect_from_world;
}

}  // namespace

Sweep RectifiedPair::FullSweep(double slope_px_per_row) const {
  const double rise = slope_px_per_row * camera.height_px();
  const double low = low_px - std::max(rise, 0.0), high = high_px - std::min(rise, 0.0);
  return {{0, slope_px_per_row, low}, RoundedSteps(high - low)};
}

std::optional<Sweep> RectifiedPair::SweepAround(const Eigen::Vector3d& n_in_reference,
                                                int steps) const {
  // 1/Z = n . ray and disparity = focal * baseline / Z, linear in the pixel.
  const Vector3d n = baseline * (rect_from_reference * n_in_reference);
  const double compression = 1 - n.x();
  if (compression < kMinCompression || compression > 1 / kMinCompression) return std::nullopt;
  const double at_origin = n.z() * camera.fx_px() - n.x() * camera.cx_px() - n.y() * camera.cy_px();
  return Sweep{{n.x(), n.y(), at_origin - compression * steps / 2}, steps};
}

std::optional<RectifiedPair> RectifyPair(const StereoView& reference, const StereoView& neighbour,
                                         const DepthRange& range, const PairLimits& limits,
                                         std::string* rejection) {
  const auto reject = [&](const char* why) {
    *rejection = why;
    return std::nullopt;
  };
  RectifiedPair pair;
  // Relative first: differences of large world coordinates keep their digits this way.
  const Vector3d offset = neighbour.cam_from_world.TargetOriginInSource() -
                          reference.cam_from_world.TargetOriginInSource();
  pair.baseline = offset.norm();
  if (!(pair.baseline > kMinBaselineToDepth * range.near_z)) return reject("no baseline");
  const auto rect_from_world = RectFromWorld(reference, neighbour, offset / pair.baseline);
  if (!rect_from_world) return reject("viewing directions along the baseline or apart");
  pair.rect_from_reference =
      *rect_from_world * reference.cam_from_world.rotation.conjugate().toRotationMatrix();
  pair.rect_from_neighbour =
      *rect_from_world * neighbour.cam_from_world.rotation.conjugate().toRotationMatrix();

  const Extent left = ExtentOf(reference.camera, pair.rect_from_reference);
  const Extent right = ExtentOf(neighbour.camera, pair.rect_from_neighbour);
  if (!left.in_front || !right.in_front) return reject("an epipole lies in or near an image");
  const Search search = SearchOf(pair.baseline, range, left);
  const Window window{std::max(left.x0, right.x0 + search.low),
                      std::min(left.x1, right.x1 + search.high), std::max(left.y0, right.y0),
                      std::min(left.y1, right.y1)};
  if (window.x0 >= window.x1 || window.y0 >= window.y1) return reject("the images do not overlap");

  const double max_pixels = kMaxGrowth * reference.camera.width_px() * reference.camera.height_px();
  const double focal_px =
      FitFocal(limits.scale * FocalKeepingArea(reference.camera, pair.rect_from_reference), search,
               window, max_pixels, limits, &pair);
  const int width = Cover((window.x1 - window.x0) * focal_px);
  const int height = Cover((window.y1 - window.y0) * focal_px);
  if (width < kMinSize || height < kMinSize) return reject("the common area is too small");

  pair.camera = PinholeCamera(width, height, focal_px, focal_px, -window.x0 * focal_px,
                              -window.y0 * focal_px);
  return pair;
}

}  // namespace dtr::stereo
