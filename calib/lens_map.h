// calib/lens_map.h -- the mapping of a LensCamera, prepared once for many pixels.
#pragma once
#include <Eigen/Core>
#include <optional>

#include "calib/lens_camera.h"
#include "calib/models/lens_formula.h"

namespace dtr::calib {

/// LensFormula with its derivatives, its guard and its inverse.
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
  std::optional<double> InverseOwnRadius(double distorted_radius) const;
  std::optional<Eigen::Vector2d> UndistortOwn(const Eigen::Vector2d& distorted) const;
  std::optional<Eigen::Vector2d> Undistort(const Eigen::Vector2d& distorted) const;
  std::optional<Eigen::Vector2d> PlaneFromCam(const Eigen::Vector3d& p_in_cam) const;

  LensFormula<double> formula_;
  bool decentred_ = false;  // any tangential or prism term
  double max_radius_ = 0;
};

}  // namespace dtr::calib
