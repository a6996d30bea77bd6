// pipeline/core/cameras/camera_distortion.h -- undistortion by cameras of other programs.
#pragma once
#include <memory>
#include <optional>

#include "calib/lens_camera.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/types/grid.h"

namespace dtr::pipeline {

/// The distortion of one camera's photos; dtr/io itself knows no camera models.
class CameraDistortion {
 public:
  virtual ~CameraDistortion() = default;
  /// Undistorts an image onto the grid of io::NamedCamera::camera, of the same size; `mask` (may be
  /// empty: all is usable) becomes 0 where the image has no source.
  virtual void Undistort(ImageRgb8& image, Mask& mask) const = 0;
  /// Where a pixel of the undistorted image lies in the photo; empty: nowhere.
  virtual std::optional<Eigen::Vector2d> DistortedPixel(const Eigen::Vector2d& pixel) const = 0;
  /// Direction of a pixel of the photo, in the camera's frame; empty: it has none.
  virtual std::optional<Eigen::Vector3d> RayFromDistorted(const Eigen::Vector2d& pixel) const = 0;
};

/// The camera with its distortion. Throws Error for a model that is not known, or parameters that
/// cannot be.
calib::LensCamera CameraModelOf(const io::NamedCamera& named);

/// The reverse: gives `named` this camera.
void SetCameraModel(io::NamedCamera& named, const calib::LensCamera& lens);

/// For ImportOptions::distortion_of. Throws as CameraModelOf.
std::unique_ptr<CameraDistortion> DistortionOf(const io::NamedCamera& named);

}  // namespace dtr::pipeline
