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
  int max_disparities = 256;
  std::int64_t max_volume = 160'000'000;  ///< width * height * disparities of the matcher
};

/// Two virtual cameras with one orientation, x axis along the baseline (the neighbour lies towards
/// +x, so the reference is always the left one: other arrangements come out as rolled images).
/// Both have one focal length and one size. In pixel *indices* of the rectified images
///   x_reference - x_neighbour = disparity, in [0, disparities), and
///   1/Z = (disparity + shift_px) / (focal_px * baseline).
struct RectifiedPair {
  PinholeCamera reference{1, 1, 1, 1, 0, 0};
  PinholeCamera neighbour{1, 1, 1, 1, 0, 0};
  Eigen::Matrix3d rect_from_reference = Eigen::Matrix3d::Identity();  ///< rotation
  Eigen::Matrix3d rect_from_neighbour = Eigen::Matrix3d::Identity();
  double baseline = 0;
  int disparities = 0;  ///< multiple of 16; also the width of the left margin
  double shift_px = 0;  ///< added to a disparity before it is turned into depth
};

/// Rectifies a pair for the depths of `range` in the reference view. The images keep about the
/// reference's resolution unless `limits` asks for less. Follows Fusiello, Trucco, Verri, "A
/// compact algorithm for rectification of stereo pairs", MVA 2000, from exact poses. Empty, with
/// the reason in `*refusal`, when there is no baseline, when an epipole lies in or near an image
/// (forward motion), or when the images do not overlap.
std::optional<RectifiedPair> RectifyPair(const StereoView& reference, const StereoView& neighbour,
                                         const DepthRange& range, const PairLimits& limits,
                                         std::string* refusal);

}  // namespace dtr::stereo
