// calib/lens_camera.h -- a camera as its lens draws it, distortion included.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dtr/types/camera.h"

namespace dtr::calib {

/// Camera models with COLMAP's names and ids (its sensor models 0 to 16); the parameter order is
/// COLMAP's too. Its model 17, EQUIRECTANGULAR, is rejected by the readers, by name. The last three
/// are ours, for cameras of other programs that no model of COLMAP describes; their ids stay out
/// of its range. Models 11 and above are not known to COLMAP 3.
enum class CameraModel : int {
  kSimplePinhole = 0,        ///< f, cx, cy
  kPinhole = 1,              ///< fx, fy, cx, cy
  kSimpleRadial = 2,         ///< f, cx, cy, k
  kRadial = 3,               ///< f, cx, cy, k1, k2
  kOpenCv = 4,               ///< fx, fy, cx, cy, k1, k2, p1, p2
  kOpenCvFisheye = 5,        ///< fx, fy, cx, cy, k1, k2, k3, k4 (Kannala & Brandt 2006)
  kFullOpenCv = 6,           ///< fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6
  kFov = 7,                  ///< fx, fy, cx, cy, omega (Devernay & Faugeras 2001)
  kSimpleRadialFisheye = 8,  ///< f, cx, cy, k
  kRadialFisheye = 9,        ///< f, cx, cy, k1, k2
  kThinPrismFisheye = 10,    ///< fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, sx1, sy1
  /// fx, fy, cx, cy, k0 to k5, p0, p1, s0 to s3 (Fisheye624 of Project Aria)
  kRadTanThinPrismFisheye = 11,
  kSimpleDivision = 12,  ///< f, cx, cy, k (Fitzgibbon 2001)
  kDivision = 13,        ///< fx, fy, cx, cy, k
  kSimpleFisheye = 14,   ///< f, cx, cy: equidistant
  kFisheye = 15,         ///< fx, fy, cx, cy: equidistant
  kEucm = 16,            ///< fx, fy, cx, cy, alpha, beta (Khomutenko, Garcia & Martinet 2016)
  /// fx, fy, cx, cy, k1 to k6, p1 to p4, skew: Metashape's and RealityScan's formula
  kBrownAffine = 100,
  kFisheyeAffine = 101,  ///< the same of the angle
  kInverseRadial = 102,  ///< fx, fy, cx, cy, r: VisualSFM's, q = d (1 + r |d|^2)
};

/// The largest number of parameters of any model.
inline constexpr int kMaxCameraParameters = 16;

/// Number of parameters of a model.
int ParameterCount(CameraModel model);
/// 1 or 2: focal lengths come first, the principal point follows, then the distortion.
int FocalCount(CameraModel model);
/// "OPENCV" and the like.
std::string NameOf(CameraModel model);
/// Inverse of NameOf; empty for names this version does not know.
std::optional<CameraModel> CameraModelFromName(const std::string& name);
/// The model with this number; empty for others.
std::optional<CameraModel> CameraModelFromId(int id);
/// False where bundle adjustment takes no camera of the model (FOV, and all above 10).
bool IsAdjustable(CameraModel model);

/// A camera with a lens. Pixels: origin at the outer corner of the top-left pixel.
struct LensCamera {
  CameraModel model = CameraModel::kPinhole;
  int width_px = 0, height_px = 0;
  std::vector<double> params;  ///< ParameterCount(model) values, COLMAP's order

  /// Throws std::invalid_argument unless sizes and focal lengths are positive, the number of
  /// parameters is the model's and all of them are finite.
  void Check() const;

  /// Focal lengths and principal point as a pinhole camera of the same size (distortion dropped).
  PinholeCamera Pinhole() const;

  /// True when every distortion parameter is zero, so undistortion would change nothing.
  bool IsUndistorted() const;

  /// Pixel of a point in the camera frame. Empty when it is behind the camera (or beyond the
  /// model's reach) or the distortion is not monotone at its angle.
  std::optional<Eigen::Vector2d> PixelFromCam(const Eigen::Vector3d& p_in_cam) const;

  /// Direction (unit length) of a pixel's ray: inverse of PixelFromCam, by safeguarded Newton.
  /// Empty where the model has no inverse.
  std::optional<Eigen::Vector3d> RayFromPixel(const Eigen::Vector2d& pixel) const;
};

/// The same lens, in COLMAP's model of two focal lengths where its own has one.
LensCamera WithTwoFocalLengths(LensCamera camera);

}  // namespace dtr::calib
