// calib/lens_map.h -- the mapping of a LensCamera, prepared once for many pixels.
#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>

#include "calib/lens_camera.h"

namespace dtr::calib {

/// The eleven lens models as one formula. A ray is first drawn as a point q of a plane:
///   perspective models  q = (x, y) / z                             |q| = tan(angle)
///   fisheye models      q = (x, y) / |(x, y)| * atan2(|(x, y)|, z)  |q| = angle
/// then distorted, with s = |q|^2 (Brown 1966; Kannala & Brandt 2006; Weng et al. 1992):
///   d = q * (1 + k1 s + k2 s^2 + k3 s^3 + k4 s^4) / (1 + d1 s + d2 s^2 + d3 s^3)
///     + (2 p1 qx qy + p2 (s + 2 qx^2) + sx s,  2 p2 qx qy + p1 (s + 2 qy^2) + sy s)
/// or, for FOV (Devernay & Faugeras 2001), d = q * atan(2 |q| tan(omega / 2)) / (omega |q|);
/// pixel = f * d + c. These are the models COLMAP documents.
///
/// A lens maps different rays to different pixels, a polynomial does not for ever: the mapping ends
/// at the smallest radius at which |d| stops growing with |q| (tangential and prism terms apart,
/// which are small), and wherever its Jacobian is not positive. Beyond there is no pixel.
class LensMap {
 public:
  /// Throws std::invalid_argument as LensCamera::Check does.
  explicit LensMap(const LensCamera& camera);

  /// As LensCamera::PixelFromCam. Fisheye models reach beyond 90 degrees, up to (not including)
  /// 180.
  std::optional<Eigen::Vector2d> PixelFromCam(const Eigen::Vector3d& p_in_cam) const;

  /// As LensCamera::RayFromPixel.
  std::optional<Eigen::Vector3d> RayFromPixel(const Eigen::Vector2d& pixel) const;

  /// Largest |q| the mapping takes; infinite where the model is monotone for ever.
  double max_radius() const { return max_radius_; }

 private:
  struct RadialValue {
    double factor, derivative_by_s;  // of the radial factor at s
  };
  struct Distorted {
    Eigen::Vector2d point;
    Eigen::Matrix2d jacobian;  // by q
  };

  double FindMaxRadius() const;
  RadialValue RadialFactor(double s) const;
  Distorted Distort(const Eigen::Vector2d& q) const;
  std::optional<double> InverseRadius(double distorted_radius) const;
  std::optional<Eigen::Vector2d> UndistortFov(const Eigen::Vector2d& distorted) const;
  std::optional<Eigen::Vector2d> Undistort(const Eigen::Vector2d& distorted) const;
  std::optional<Eigen::Vector2d> PlaneFromCam(const Eigen::Vector3d& p_in_cam) const;

  double fx_px_ = 1, fy_px_ = 1, cx_px_ = 0, cy_px_ = 0;
  bool fisheye_ = false;
  bool fov_ = false;
  double omega_ = 0;
  std::array<double, 4> numerator_{};    // k1..k4
  std::array<double, 3> denominator_{};  // d1..d3
  double p1_ = 0, p2_ = 0, sx_ = 0, sy_ = 0;
  bool decentred_ = false;  // any of p1, p2, sx, sy
  double max_radius_ = 0;
};

}  // namespace dtr::calib
