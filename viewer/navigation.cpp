#include "viewer/navigation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "dtr/render/geometry.h"

namespace dtr::viewer {
namespace {

// Shorter sums of unit vectors have no direction worth the name.
constexpr double kNoCommonDirection = 0.2;

Pose FromCenter(const Eigen::Quaterniond& cam_from_world, const Eigen::Vector3d& center) {
  return {cam_from_world, -(cam_from_world * center)};
}

/// The pitch that leaves the axis kPoleRad away from the poles.
double AllowedPitch(const Pose& cam_from_world, const Eigen::Vector3d& up, double pitch_rad) {
  const double now = AngleBetween(AxisInWorld(cam_from_world, Eigen::Vector3d::UnitZ()), up);
  // Turning about the camera's x by +a moves the axis (z) away from y, which is down: upwards.
  const double low = std::min(now, kPoleRad), high = std::max(now, std::numbers::pi - kPoleRad);
  return now - std::clamp(now - pitch_rad, low, high);
}

}  // namespace

PinholeCamera FillLens(const PinholeCamera& camera, int width_px, int height_px) {
  const double scale = std::max(static_cast<double>(width_px) / camera.width_px(),
                                static_cast<double>(height_px) / camera.height_px());
  const double right = camera.cx_px() - 0.5 * camera.width_px();
  const double down = camera.cy_px() - 0.5 * camera.height_px();
  return {width_px,
          height_px,
          camera.fx_px() * scale,
          camera.fy_px() * scale,
          0.5 * width_px + right * scale,
          0.5 * height_px + down * scale};
}

Eigen::Vector3d AxisInWorld(const Pose& cam_from_world, const Eigen::Vector3d& axis_in_cam) {
  return cam_from_world.rotation.conjugate() * axis_in_cam;
}

Eigen::Vector3d CommonAxis(std::span<const Pose> cams_from_world,
                           const Eigen::Vector3d& axis_in_cam) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Pose& cam_from_world : cams_from_world)
    sum += AxisInWorld(cam_from_world, axis_in_cam);
  if (cams_from_world.empty()) return axis_in_cam;
  if (sum.norm() < kNoCommonDirection * static_cast<double>(cams_from_world.size())) {
    return AxisInWorld(cams_from_world.front(), axis_in_cam);
  }
  return sum.normalized();
}

Eigen::Vector3d WorldPoint(const NovelCamera& from, const Eigen::Vector2d& pixel, double depth_z) {
  return from.cam_from_world.Inverse() *
         from.camera.CamFromPixel(pixel, depth_z, DepthKind::kPlaneZ);
}

Pose Orbit(const Pose& cam_from_world, const Eigen::Vector3d& pivot, const Eigen::Vector3d& up,
           double yaw_rad, double pitch_rad) {
  const double pitch = AllowedPitch(cam_from_world, up, pitch_rad);
  const Eigen::AngleAxisd about_up(yaw_rad, up);
  const Eigen::AngleAxisd about_right(pitch, AxisInWorld(cam_from_world, Eigen::Vector3d::UnitX()));
  const Eigen::Quaterniond turn = Eigen::Quaterniond(about_up) * Eigen::Quaterniond(about_right);
  const Eigen::Vector3d center = pivot + turn * (cam_from_world.TargetOriginInSource() - pivot);
  return FromCenter((cam_from_world.rotation * turn.conjugate()).normalized(), center);
}

Pose Look(const Pose& cam_from_world, const Eigen::Vector3d& up, double yaw_rad, double pitch_rad) {
  return Orbit(cam_from_world, cam_from_world.TargetOriginInSource(), up, yaw_rad, pitch_rad);
}

Pose MoveInCam(const Pose& cam_from_world, const Eigen::Vector3d& offset) {
  return {cam_from_world.rotation, cam_from_world.translation - offset};
}

Pose Approach(const Pose& cam_from_world, const Eigen::Vector3d& point, double factor) {
  const Eigen::Vector3d center = cam_from_world.TargetOriginInSource();
  return FromCenter(cam_from_world.rotation, point + factor * (center - point));
}

Pose Pan(const NovelCamera& camera, const Eigen::Vector2d& from_px, const Eigen::Vector2d& to_px,
         double depth_z) {
  const Eigen::Vector3d from = camera.camera.CamFromPixel(from_px, depth_z, DepthKind::kPlaneZ);
  const Eigen::Vector3d to = camera.camera.CamFromPixel(to_px, depth_z, DepthKind::kPlaneZ);
  return MoveInCam(camera.cam_from_world, from - to);
}

NovelCamera InMovedWorld(NovelCamera camera, const Eigen::Vector3d& origin_shift) {
  camera.cam_from_world.translation += camera.cam_from_world.rotation * origin_shift;
  return camera;
}

NovelCamera Between(const NovelCamera& from, const NovelCamera& to, double share) {
  const auto mix = [share](double a, double b) { return a + share * (b - a); };
  const PinholeCamera &a = from.camera, &b = to.camera;
  const PinholeCamera lens(b.width_px(), b.height_px(), mix(a.fx_px(), b.fx_px()),
                           mix(a.fy_px(), b.fy_px()), mix(a.cx_px(), b.cx_px()),
                           mix(a.cy_px(), b.cy_px()));
  const Eigen::Vector3d center_a = from.cam_from_world.TargetOriginInSource();
  const Eigen::Vector3d center_b = to.cam_from_world.TargetOriginInSource();
  const Eigen::Quaterniond rotation =
      from.cam_from_world.rotation.slerp(share, to.cam_from_world.rotation).normalized();
  return {lens, FromCenter(rotation, center_a + share * (center_b - center_a))};
}

std::optional<size_t> NearestView(std::span<const View* const> views, const Pose& cam_from_world,
                                  double scene_size) {
  const Eigen::Vector3d center = cam_from_world.TargetOriginInSource();
  const Eigen::Vector3d axis = AxisInWorld(cam_from_world, Eigen::Vector3d::UnitZ());
  std::optional<size_t> nearest;
  double least = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < views.size(); ++i) {
    const Pose& view = views[i]->cam_from_world;
    const double distance = (view.TargetOriginInSource() - center).norm();
    const double apart = distance / (scene_size > 0 ? scene_size : 1) +
                         AngleBetween(AxisInWorld(view, Eigen::Vector3d::UnitZ()), axis);
    if (apart < least) {
      least = apart;
      nearest = i;
    }
  }
  return nearest;
}

Pose LookAlong(const Eigen::Vector3d& center, const Eigen::Vector3d& forward,
               const Eigen::Vector3d& up) {
  const Eigen::Vector3d z = forward.normalized();
  Eigen::Vector3d x = (-up).cross(z);
  // Straight up or down, any direction will do for right.
  if (x.norm() < 1e-9) x = z.unitOrthogonal();
  x.normalize();
  Eigen::Matrix3d rotation;
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  return FromCenter(Eigen::Quaterniond(rotation).normalized(), center);
}

Pose ViewAll(const Bounds& bounds, std::span<const Pose> cams_from_world, const Eigen::Vector3d& up,
             const PinholeCamera& lens) {
  const Eigen::Vector3d middle =
      bounds.empty() ? Eigen::Vector3d::Zero() : Eigen::Vector3d(0.5 * (bounds.min + bounds.max));
  const Eigen::Vector3d half =
      bounds.empty() ? Eigen::Vector3d::Ones() : Eigen::Vector3d(0.5 * (bounds.max - bounds.min));
  const Eigen::Vector3d forward = CommonAxis(cams_from_world, Eigen::Vector3d::UnitZ());
  const bool steep = forward.cross(up).norm() < std::sin(kPoleRad);
  const Pose at_middle = LookAlong(
      middle, forward, steep ? CommonAxis(cams_from_world, -Eigen::Vector3d::UnitY()) : up);
  // How far back each corner asks the camera to go, on each side of the image.
  double back = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d sign(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    const Eigen::Vector3d p = at_middle * (middle + sign.cwiseProduct(half));
    const double left = lens.cx_px(), right = lens.width_px() - lens.cx_px();
    const double top = lens.cy_px(), bottom = lens.height_px() - lens.cy_px();
    const double across = p.x() < 0 ? -p.x() * lens.fx_px() / std::max(left, 1.0)
                                    : p.x() * lens.fx_px() / std::max(right, 1.0);
    const double down = p.y() < 0 ? -p.y() * lens.fy_px() / std::max(top, 1.0)
                                  : p.y() * lens.fy_px() / std::max(bottom, 1.0);
    back = std::max({back, across - p.z(), down - p.z()});
  }
  return MoveInCam(at_middle, {0, 0, -back});
}

}  // namespace dtr::viewer
