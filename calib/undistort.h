// calib/undistort.h -- photos on the grid of a pinhole camera.
#pragma once
#include <Eigen/Core>
#include <optional>

#include "calib/lens_camera.h"
#include "calib/lens_map.h"
#include "dtr/types/camera.h"
#include "dtr/types/grid.h"

namespace dtr::calib {

/// A photo as a pinhole camera would have taken it.
struct UndistortedPhoto {
  ImageRgb8 image;                         ///< black where masked
  Mask mask;                               ///< 255 where the photo has a source; empty: everywhere
  PinholeCamera camera{1, 1, 1, 1, 0, 0};  ///< size of `image`
};

/// Undistorts a photo taken by `lens`: same size, focal lengths and principal point, pixels without
/// a source masked; then shrinks it by area averages so that its long side is at most `max_size_px`
/// (0: full size), K scaled per axis. A photo without distortion is only shrunk; at equal size its
/// bytes stay as they are.
///
/// Resampling is a normalised Lanczos kernel of 6x6 pixels (Turkowski 1990): half a pixel off the
/// grid it keeps 91 % of a pattern of 3 pixels per period, where cubic convolution (Keys 1981)
/// keeps 69 % and bilinear 50 %; stereo matches and held-out figures would both see that loss. A
/// lens keeps its scale within a few tens of per cent over the image, so no wider kernel is
/// needed against aliasing. Works on stored sRGB values. The same bytes for any number of threads
/// (0: all cores). Throws Error when the photo has not the size the lens was calibrated for,
/// std::invalid_argument when the lens is impossible.
UndistortedPhoto Undistort(const ImageRgb8& photo, const LensCamera& lens, int max_size_px);
/// The same for a photo of which only part may be used (`usable` not 0; empty: all): pixels whose
/// value lies between others that may not be used are masked too.
UndistortedPhoto Undistort(const ImageRgb8& photo, const Mask& usable, const LensCamera& lens,
                           int max_size_px);
/// The same, drawn as the camera `onto` would have taken it, which has the photo's size: photos
/// that a stabiliser shifted against each other become those of one camera.
UndistortedPhoto Undistort(const ImageRgb8& photo, const Mask& usable, const LensCamera& lens,
                           const PinholeCamera& onto, int max_size_px);

/// The camera that Undistort gives a photo drawn as `onto` would have taken it, without a photo.
PinholeCamera ShrunkCamera(const PinholeCamera& onto, int max_size_px);

/// Where a pixel of the photo lies on the undistorted (and possibly shrunk) grid; may be off the
/// image. Empty where the lens has no ray or the ray does not point forward.
std::optional<Eigen::Vector2d> UndistortedPixel(const LensMap& lens,
                                                const PinholeCamera& undistorted_camera,
                                                const Eigen::Vector2d& distorted_pixel);
std::optional<Eigen::Vector2d> UndistortedPixel(const LensCamera& lens,
                                                const PinholeCamera& undistorted_camera,
                                                const Eigen::Vector2d& distorted_pixel);

}  // namespace dtr::calib
