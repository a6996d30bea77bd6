#include "datasets/layout.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "dtr/base/error.h"

namespace dtr::datasets {
namespace {

using Eigen::Vector3d;

constexpr double kArcStepDeg = 6;        // neighbours on the arc: matchable, and a useful baseline
constexpr double kStepOfDistance = 0.1;  // baseline / distance of neighbours on grid and line
// Cameras in a perfect circle or row are a critical motion for self-calibration, and nobody walks
// so: they bob by this share of the distance. The three frequencies do not fit a full turn.
constexpr double kBob = 0.02;

double Radians(double deg) { return deg * std::numbers::pi / 180; }

Vector3d Bob(int i, double size) {
  return size * Vector3d(std::sin(2.3 * i + 0.5), std::cos(1.7 * i), std::sin(3.1 * i + 1.0));
}

std::vector<Pose> Arc(const Framing& f, int views) {
  const double span = std::min(f.max_arc_deg, kArcStepDeg * (views - 1));
  std::vector<Pose> poses;
  for (int i = 0; i < views; ++i) {
    const double angle = Radians(span * (static_cast<double>(i) / (views - 1) - 0.5));
    const Vector3d eye =
        f.focus + Vector3d(f.distance * std::sin(angle), -f.distance * std::cos(angle), f.height) +
        Bob(i, kBob * f.distance);
    poses.push_back(LookAt(eye, f.focus + Bob(i + 100, kBob * f.distance)));
  }
  return poses;
}

std::vector<Pose> GridOf(const Framing& f, int views, int columns) {
  const int rows = (views + columns - 1) / columns;
  const double step = kStepOfDistance * f.distance;
  std::vector<Pose> poses;
  for (int i = 0; i < views; ++i) {
    const double x = (i % columns - (columns - 1) / 2.0) * step;
    const double z = ((rows - 1) / 2.0 - i / columns) * step;
    const Vector3d bob = Bob(i, 0.2 * kBob * f.distance);
    const Vector3d eye = f.focus + Vector3d(x, -f.distance, f.height + z) + bob;
    // Parallel axes: every camera looks at the point as far aside as it stands itself.
    poses.push_back(LookAt(eye, f.focus + Vector3d(x, 0, z) - bob));
  }
  return poses;
}

std::vector<Pose> Ring(const Framing& f, int views) {
  std::vector<Pose> poses;
  for (int i = 0; i < views; ++i) {
    const double angle = 2 * std::numbers::pi * i / views;
    const Vector3d eye = f.focus + f.ring_radius * Vector3d(std::sin(angle), -std::cos(angle), 0) +
                         f.height * Vector3d::UnitZ() + Bob(i, kBob * f.ring_radius);
    poses.push_back(LookAt(eye, f.focus));
  }
  return poses;
}

std::vector<Pose> InsideOut(const Framing& f, int views) {
  std::vector<Pose> poses;
  for (int i = 0; i < views; ++i) {
    const double angle = 2 * std::numbers::pi * i / views;
    const Vector3d outwards(std::sin(angle), std::cos(angle), 0);
    const Vector3d eye = f.inside + f.inside_radius * outwards + Bob(i, 0.06 * f.inside_radius);
    const double down = 0.08 + 0.06 * std::sin(1.9 * i);
    poses.push_back(LookAt(eye, eye + outwards - down * Vector3d::UnitZ()));
  }
  return poses;
}

}  // namespace

Pose LookAt(const Vector3d& eye, const Vector3d& target) {
  const Vector3d forward = (target - eye).normalized();
  const Vector3d right = forward.cross(Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d cam_from_world;
  cam_from_world.row(0) = right;
  cam_from_world.row(1) = forward.cross(right);
  cam_from_world.row(2) = forward;
  const Eigen::Quaterniond rotation = Eigen::Quaterniond(cam_from_world).normalized();
  return {rotation, -(rotation * eye)};
}

std::vector<Pose> MakeLayout(const Scene& scene, const std::string& layout, int views) {
  if (views < 2) {
    throw UsageError("views: expected 2 or more, found " + std::to_string(views));
  }
  const Framing& f = scene.framing();
  if (std::find(f.layouts.begin(), f.layouts.end(), layout) == f.layouts.end()) {
    std::string known;
    for (const std::string& name : f.layouts) known += (known.empty() ? "" : ", ") + name;
    throw UsageError("layout: expected one of " + known + " for scene '" + scene.name() +
                     "', found '" + layout + "'");
  }
  if (layout == "arc") return Arc(f, views);
  if (layout == "grid") {
    return GridOf(f, views, static_cast<int>(std::ceil(std::sqrt(static_cast<double>(views)))));
  }
  if (layout == "line") return GridOf(f, views, views);
  if (layout == "ring") return Ring(f, views);
  return InsideOut(f, views);
}

PinholeCamera MakeCamera(int width_px, int height_px, double focal_35mm) {
  const double focal_px = focal_35mm / 36.0 * width_px;
  return PinholeCamera(width_px, height_px, focal_px, focal_px, width_px / 2.0, height_px / 2.0);
}

}  // namespace dtr::datasets
