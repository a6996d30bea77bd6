// calib/motion_clocks.h -- how much later each fixed camera's frames are, from what moves.
#pragma once
#include <string>
#include <vector>

#include "calib/lens_camera.h"
#include "dtr/types/grid.h"
#include "dtr/types/pose.h"

namespace dtr::calib {

/// What a camera that does not move saw move.
struct MotionSeen {
  std::string name;  ///< for messages
  LensCamera lens;
  Pose cam_from_world;
  /// Per frame, over equal cells of the image: how much changed since the frame before, >= 0. Empty
  /// where that is not known. All that are not empty have one size.
  std::vector<Grid<float>> cells;
};

/// How a motion of frame t of the first camera shows in another one: at frame t + `later`.
struct MotionClock {
  double later = 0;       ///< frames; 0 for the first camera
  double rms_frames = 0;  ///< by which the pairs that this camera is in differ from all together
  int pairs = 0;          ///< of cameras that agree on it
};

/// Finds the clocks of cameras that run at one rate by epipolar consistency. What moves in a plane
/// through the centres of two cameras moves both of its lines, so each camera's motion per plane
/// and frame is correlated with the other's, over all shifts in time that leave half of the
/// shorter recording (at least kFewestFrames) in common. Shifts of pairs, to fractions of a frame
/// by a parabola, are then joined by least squares, those that contradict better ones by more than
/// a frame left out. Motion barcodes: Ben-Artzi, Halperin, Werman and Peleg 2016 ("Epipolar
/// geometry based on line similarity"); theirs are binary and find the geometry, these know it.
///
/// The same for any number of threads. Throws Error naming a camera that shares no unambiguous
/// motion with the others (nothing moved, it moved periodically, or clocks are farther apart), and
/// std::invalid_argument for fewer than two cameras or sizes that differ.
std::vector<MotionClock> FindMotionClocks(const std::vector<MotionSeen>& cameras);
inline constexpr int kFewestFrames = 8;

}  // namespace dtr::calib
