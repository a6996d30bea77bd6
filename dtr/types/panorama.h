// dtr/types/panorama.h -- 360 degree panoramas (equirectangular) and the pinhole views they are
// split into.
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "dtr/types/camera.h"

namespace dtr {

/// A panorama as it is stored: the whole sphere on full_width_px x full_height_px (2:1, longitude
/// along x, latitude along y), of which the image may be a part that begins at (left_px, top_px).
/// Frame `panorama`: x right, y down, z towards the middle of the whole sphere's image.
struct Panorama {
  double full_width_px = 0, full_height_px = 0;
  double left_px = 0, top_px = 0;

  /// Pixel of a direction (not zero), origin at the outer corner of the top-left pixel; off the
  /// image where the panorama is a part.
  Eigen::Vector2d PixelFromDirection(const Eigen::Vector3d& direction) const;
  /// Inverse: a unit vector.
  Eigen::Vector3d DirectionFromPixel(const Eigen::Vector2d& pixel) const;
};

/// A view that a panorama is split into: 90 degrees in both axes, a face of a cube.
struct PanoramaFace {
  std::string name;                   ///< "front", "right", "back", "left", "up" or "down"
  Eigen::Matrix3d cam_from_panorama;  ///< rotation; all share the panorama's centre
};

/// The six of a cube, in a fixed order. They touch and do not overlap.
std::vector<PanoramaFace> PanoramaFaces();
/// The one called so; empty name: there is none.
PanoramaFace FaceCalled(const std::string& name);

/// The camera of a face of `size_px` x `size_px`: 90 degrees, principal point in the middle.
PinholeCamera FaceCamera(int size_px);

/// The size at which a face has in its middle the resolution that the panorama has at its
/// equator: full_width_px / pi, even.
int FaceSizePx(double full_width_px);

}  // namespace dtr
