// dtr/types/camera.h -- needs Eigen and the standard library only.
#pragma once
#include <Eigen/Core>
#include <optional>

namespace dtr {

/// What one stored depth number measures. Nothing converts it silently.
enum class DepthKind {
  kPlaneZ,       ///< z in the camera frame: our sets, COLMAP maps, GL eye space (negated)
  kRayDistance,  ///< distance from the camera centre: MVE, AliceVision, Blender's old pass
};

/// Undistorted pinhole camera; images are undistorted before they enter dtr/.
/// Frame `cam`: x right, y down, z forward. All lengths on the image in pixels, origin at the outer
/// corner of the top-left pixel (its centre: 0.5, 0.5).
/// Model: Hartley & Zisserman, 2nd ed., sec. 6.1 (CCD camera, no skew).
class PinholeCamera {
 public:
  /// Throws std::invalid_argument unless sizes and focal lengths are positive and all is finite.
  PinholeCamera(int width_px, int height_px, double fx_px, double fy_px, double cx_px,
                double cy_px);

  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }
  double fx_px() const { return fx_px_; }
  double fy_px() const { return fy_px_; }
  double cx_px() const { return cx_px_; }
  double cy_px() const { return cy_px_; }

  /// Pixel where `p_in_cam` (scene units) is seen; may lie off the image.
  /// Empty if the point is not in front of the camera (z <= 0).
  std::optional<Eigen::Vector2d> PixelFromCam(const Eigen::Vector3d& p_in_cam) const {
    if (!(p_in_cam.z() > 0)) return std::nullopt;
    return Eigen::Vector2d(fx_px_ * (p_in_cam.x() / p_in_cam.z()) + cx_px_,
                           fy_px_ * (p_in_cam.y() / p_in_cam.z()) + cy_px_);
  }

  /// Direction of a pixel's ray with z = 1 in the camera frame.
  Eigen::Vector3d RayFromPixel(const Eigen::Vector2d& pixel) const {
    return {(pixel.x() - cx_px_) / fx_px_, (pixel.y() - cy_px_) / fy_px_, 1.0};
  }

  /// Inverse of PixelFromCam. Requires depth > 0; the result is in scene units.
  Eigen::Vector3d CamFromPixel(const Eigen::Vector2d& pixel, double depth, DepthKind kind) const;

  /// True inside [0, width) x [0, height).
  bool Contains(const Eigen::Vector2d& pixel) const {
    return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < width_px_ && pixel.y() < height_px_;
  }

  /// The same camera for an image resampled to another size: K is scaled per axis by the ratios of
  /// the sizes, so both images show exactly the same part of the world.
  PinholeCamera Resized(int new_width_px, int new_height_px) const;

  bool operator==(const PinholeCamera&) const = default;

 private:
  int width_px_, height_px_;
  double fx_px_, fy_px_, cx_px_, cy_px_;
};

}  // namespace dtr
