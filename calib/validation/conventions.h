// calib/validation/conventions.h -- do given cameras fit the photos, and if not, which usual
// mistake of reading or writing camera files explains it?
#pragma once
#include <span>
#include <string>
#include <vector>

#include "calib/lens_camera.h"
#include "calib/matched_pair.h"
#include "dtr/types/pose.h"

namespace dtr::calib {

/// A camera as it was given, of the photo `name`.
struct GivenCamera {
  std::string name;
  LensCamera lens;
  Pose cam_from_world;
};

/// A way to take the cameras, and what the matches say of it.
struct Convention {
  std::string name;        ///< "OpenGL axes", "principal point half a pixel larger", ...
  std::string advice;      ///< what to do about the file, as a clause
  double residual_px = 0;  ///< median
};

/// Result of TestConventions.
struct ConventionReport {
  int pairs = 0,
      matches = 0;      ///< that took part; fewer than kMinConventionMatches: nothing is said
  double given_px = 0;  ///< median residual of the cameras as given
  double limit_px = 0;  ///< residuals up to here are those of features
  /// Mistakes that explain the residuals, one on top of the other: each makes them clearly smaller.
  /// Empty: none does.
  std::vector<Convention> found;

  bool tested() const;
  bool fits() const { return tested() && given_px <= limit_px && found.empty(); }
};

/// Fewer matches would let chance decide.
inline constexpr int kMinConventionMatches = 200;

/// Residuals: distances (px) of features from the epipolar lines of their matches, by the cameras;
/// a match whose rays meet behind a camera counts as far off. All hypotheses are tried on the same
/// matches (6000 at most): axes of OpenGL, of PyTorch3D and of LLFF, camera-to-world taken for
/// world-to-camera, photos in another order, intrinsics of an image of another size, fx and fy or
/// cx and cy swapped, a principal point half a pixel off, distortion ignored or applied twice,
/// another distortion model, p1 and p2 swapped, the sign of the coefficients. One is reported if
/// the median residual falls to half (of those that change little, the principal point and the
/// distortion: to 9/10) and the mean of Cauchy's loss falls by more than 6 standard deviations of
/// its mean. Cameras in order of their names. Deterministic.
ConventionReport TestConventions(std::span<const GivenCamera> cameras,
                                 std::span<const MatchedPair> pairs);

/// One line for people: what was found and what to do; empty where the cameras fit or nothing can
/// be said. `file`: the cameras'.
std::string LineOf(const ConventionReport& report, const std::string& file);

}  // namespace dtr::calib
