// dtr/io/formats/foreign_scene.h -- cameras as another program's file has them, before its photos
// are found.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "dtr/io/formats/cameras_json.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/photo_grid.h"
#include "dtr/types/pose.h"

namespace dtr::io {

/// Intrinsics in the words of Distortion, with two focal lengths. Formats that do not store the
/// size of the image give numbers that depend on it.
struct ForeignIntrinsics {
  Distortion lens;                  ///< fx, fy, cx, cy, then what the model has
  int width_px = 0, height_px = 0;  ///< 0: the file does not say; the photo's
  bool from_centre = false;         ///< cx and cy count from the middle of the image
  bool in_long_sides = false;       ///< lengths are shares of the image's longer side, else pixels
  bool even_size = false;           ///< a last odd column or row of the image was left out
};

/// Polynomial distortion and affinity, as most programs have it (calib/models/lens_formula.h):
/// d = q (1 + k1 s + ... + k6 s^6) + (2 p1 x y + p2 (s + 2 x^2), 2 p2 x y + p1 (s + 2 y^2))
/// (1 + p3 s + p4 s^2), s = |q|^2, pixel = (fx dx + skew dy + cx, fy dy + cy): OpenCV's order of p1
/// and p2. `fisheye`: q is the angle's.
struct BrownTerms {
  double fx = 0, fy = 0, cx = 0, cy = 0;
  std::array<double, 6> k{};
  std::array<double, 4> p{};
  double skew = 0;
  bool fisheye = false;
};

/// The simplest of COLMAP's models that is the same; BROWN_AFFINE or FISHEYE_AFFINE where none is.
Distortion LensFrom(const BrownTerms& terms);

/// A camera of a photo.
struct ForeignCamera {
  std::string path;   ///< of the photo as the file writes it; may be absolute or lack the extension
  std::string entry;  ///< "cameras[3]" and the like, for messages
  ForeignIntrinsics intrinsics;
  Pose cam_from_world;
};

/// A point and where photos show it, in pixels as the file's cameras have them (corner origin,
/// relative to the image's middle where `from_centre` is true).
struct ForeignPoint {
  Eigen::Vector3d p_in_world = Eigen::Vector3d::Zero();
  std::array<std::uint8_t, 3> rgb{};
  std::vector<std::pair<size_t, Eigen::Vector2d>> seen;  ///< index into cameras, pixel
};

/// What a file holds.
struct ForeignScene {
  LengthUnit unit = LengthUnit::kUnknown;
  Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();  ///< poses act on p_world - world_origin
  PhotoGrid photo_grid = PhotoGrid::kStored;
  std::vector<ForeignCamera> cameras;
  std::vector<ForeignPoint> points;
  /// The program of this format where others write it in ways of their own: the points decide in
  /// which (pipeline/core/cameras/point_conventions.h). Empty: the format has one meaning.
  std::string conventions_of;
  /// Photos that have no camera, and why: disabled, not aligned, ...
  std::vector<std::pair<std::string, std::string>> left_out;
  std::vector<std::string> notes;  ///< one line each: what the file holds and is not used
};

}  // namespace dtr::io
