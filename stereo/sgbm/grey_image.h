// stereo/sgbm/grey_image.h -- grey images for matching: masks filled, resampled, shrunk.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "stereo/engine.h"

namespace dtr::stereo {

/// A view's grey values with what may be used of them.
struct GreyImage {
  PinholeCamera camera{1, 1, 1, 1, 0, 0};
  Grid<float> grey;  ///< 0..255, sRGB-coded luma
  Mask usable;       ///< 255 where the view's mask allows it
};

/// Grey image of a view. Masked pixels are bridged linearly along their row (or column, where a
/// whole row is masked), so that their content has no influence and they bring no edges of their
/// own. Throws Error when the image or mask has not the camera's size.
GreyImage MakeGreyImage(const StereoView& view);

/// Half the size per axis by averaging 2x2 pixels (a last odd row or column is dropped).
GreyImage Halved(const GreyImage& picture);

/// An image seen by a turned virtual camera.
struct WarpedImage {
  Grid<std::uint8_t> grey;
  Mask usable;  ///< 255 where the source has a usable pixel
};

/// Where the pixels of a virtual image look: ray in the source's camera frame (of any length) =
/// ray_from_pixel * (x, y, 1).
struct VirtualImage {
  int width_px = 0, height_px = 0;
  double focal_px = 0;  ///< its resolution
  Eigen::Matrix3d ray_from_pixel = Eigen::Matrix3d::Identity();
};

/// Resamples with Catmull-Rom weights; beyond the border the nearest pixel is repeated (an
/// artificial edge there would be matched). Uses a halved source where the target is that much
/// coarser.
WarpedImage Warp(const GreyImage& source, const VirtualImage& target);

}  // namespace dtr::stereo
