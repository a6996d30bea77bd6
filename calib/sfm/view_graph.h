// calib/sfm/view_graph.h -- what structure from motion passes from stage to stage: features of
// photos, matches of pairs with their geometry.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "calib/lens_camera.h"

namespace dtr::sfm {

/// A SIFT descriptor as COLMAP stores it: the square roots of the L1-normalised histogram, times
/// 512, in the order of bins of COLMAP's database (Lowe's: directions run against VLFeat's).
using Descriptor = std::array<std::uint8_t, 128>;

/// Where a feature lies, in pixels of its photo (centre of the first pixel at 0.5), and how it was
/// seen.
struct Keypoint {
  float x_px = 0, y_px = 0;
  float scale_px = 0;         ///< standard deviation of the blur at which it was found
  float orientation_rad = 0;  ///< from +x towards +y
};

/// Features of a photo, the largest scale first; both lists have the same length.
struct Features {
  std::vector<Keypoint> keypoints;
  std::vector<Descriptor> descriptors;
};

/// Features `first` of image a and `second` of image b that show one point.
using FeatureMatches = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

/// How two images lie to each other, as far as their matches tell.
enum class PairKind {
  kCalibrated,    ///< an essential matrix: `b_from_a` is known, up to the length of `t`
  kUncalibrated,  ///< a fundamental matrix alone
  kPlanar,    ///< one homography explains what an essential matrix does: a plane, or no parallax
  kRotation,  ///< a homography without parallax: the camera turned, and did not move
};

/// A pair of images whose matches agree with one geometry.
struct PairGeometry {
  int image_a = 0, image_b = 0;  ///< a < b, indices into ViewGraph::images
  PairKind kind = PairKind::kUncalibrated;
  Eigen::Matrix3d b_rotation_a = Eigen::Matrix3d::Identity();  ///< not of kUncalibrated
  Eigen::Vector3d b_translation_a = Eigen::Vector3d::Zero();   ///< length 1; 0 of kRotation
  double parallax_rad = 0;  ///< median angle between the rays of its matches
  FeatureMatches matches;   ///< those that agree
};

/// A photo in the graph.
struct GraphImage {
  std::string name;
  int camera = 0;                       ///< index into ViewGraph::cameras
  std::vector<Eigen::Vector2d> pixels;  ///< of its features
  /// Images of one station (views of a panorama) stand in one point, in known rotations to it; -1:
  /// of none.
  int station = -1;
  Eigen::Matrix3d cam_from_station = Eigen::Matrix3d::Identity();
};

/// Photos and the pairs among them that were matched; pairs sorted by (image_a, image_b).
struct ViewGraph {
  std::vector<calib::LensCamera> cameras;  ///< priors, or what votes over pairs told
  std::vector<bool> focal_is_known;        ///< per camera: EXIF's, a vote's or the user's
  std::vector<GraphImage> images;
  std::vector<PairGeometry> pairs;
};

}  // namespace dtr::sfm
