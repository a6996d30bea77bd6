// stereo/sgbm/rectify.h -- turns two posed cameras into a pair with horizontal epipolar lines.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>

#include "stereo/engine.h"

namespace dtr::stereo {

/// Bounds on what matching one pair may cost.
struct PairLimits {
  double scale = 1.0;  ///< resolution to match at, relative to the reference image
  int max_disparities = 512;
  std::int64_t max_volume = 200'000'000;  ///< width * height * disparities of the matcher
};

/// Which disparities the matcher searches: those around a plane (planes of the world are planes of
/// disparity). A disparity at pixel (x, y) of the rectified reference is
///   plane . (x, y, 1) + (1 - plane.x) * step,   step in [0, steps),
/// so that on a surface parallel to the plane the step is constant, however slanted the surface.
struct Sweep {
  Eigen::Vector3d plane = Eigen::Vector3d::Zero();
  int steps = 0;  ///< a multiple of 16

  double DisparityAt(const Eigen::Vector2d& pixel, double step) const {
    return plane.x() * pixel.x() + plane.y() * pixel.y() + plane.z() + (1 - plane.x()) * step;
  }
};

/// Two virtual cameras with one orientation, x axis along the baseline (the neighbour lies towards
/// +x, so the reference is always the left one: other arrangements come out as rolled images), and
/// with one pinhole model. x_reference - x_neighbour is the disparity; 1/Z = disparity /
/// (focal * baseline).
struct RectifiedPair {
  PinholeCamera camera{1, 1, 1, 1, 0, 0};  ///< its size is the part of the reference to match
  Eigen::Matrix3d rect_from_reference = Eigen::Matrix3d::Identity();  ///< rotation
  Eigen::Matrix3d rect_from_neighbour = Eigen::Matrix3d::Identity();
  double baseline = 0;
  double low_px = 0, high_px = 0;  ///< disparities of the depth range, with margins

  /// All disparities of the depth range, on planes that rise by `slope` px per row (0: facing).
  Sweep FullSweep(double slope_px_per_row) const;

  /// A few disparities on either side of the plane n . p = 1, p in the reference's camera frame.
  /// Empty where the neighbour sees the plane from behind or at a grazing angle.
  std::optional<Sweep> SweepAround(const Eigen::Vector3d& n_in_reference, int steps) const;
};

/// Rectifies a pair for the depths of `range` in the reference view. The images keep about the
/// reference's resolution unless `limits` asks for less. Follows Fusiello, Trucco, Verri, "A
/// compact algorithm for rectification of stereo pairs", MVA 2000, from exact poses. Empty, with
/// the reason in `*rejection`, when there is no baseline, when an epipole lies in or near an image
/// (forward motion), or when the images do not overlap.
std::optional<RectifiedPair> RectifyPair(const StereoView& reference, const StereoView& neighbour,
                                         const DepthRange& range, const PairLimits& limits,
                                         std::string* rejection);

}  // namespace dtr::stereo
