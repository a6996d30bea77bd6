// calib/solve/rig.h -- cameras that are fixed to each other, and what they saw of a board.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "calib/boards/observations.h"
#include "calib/models/board_model.h"
#include "dtr/types/pose.h"

namespace dtr::calib {

/// One camera of a rig. Frame `rig` is the first camera's.
struct RigCamera {
  std::string name;
  BoardModel model = BoardModel::kPinhole;
  LensCamera camera;
  Pose cam_from_rig;
};

/// What one camera saw at one time step.
struct RigView {
  size_t camera = 0, frame = 0;
  BoardView seen;
  std::vector<int> outliers;  ///< rising ids of corners that do not count
};

/// A rig, the board's pose at every time step, and the observations. A single camera is a rig of
/// one.
struct Rig {
  std::vector<RigCamera> cameras;
  std::vector<Pose> rig_from_board;  ///< per frame
  std::vector<RigView> views;        ///< rising frame, then camera; each pair once
};

/// The camera whose images have the longest side.
const LensCamera& LargestImage(const Rig& rig);

/// Which unknowns all frames share, and where each stands in their vector: per camera the
/// parameters of the lens (unless they are given), then for every camera but the first its place,
/// (w, v): cam_from_rig' = (exp(w) R, t + v), w in radians, v in the unit of the board.
class RigLayout {
 public:
  RigLayout(const std::vector<RigCamera>& cameras, bool free_lenses);

  int size() const { return size_; }
  bool free_lenses() const { return free_lenses_; }
  int LensAt(size_t camera) const { return lens_at_[camera]; }    ///< -1: not an unknown
  int PlaceAt(size_t camera) const { return place_at_[camera]; }  ///< -1: not an unknown
  /// "left fx_px", "right turn_x_rad", "right shift_z".
  const std::string& NameOf(int index) const { return names_[static_cast<size_t>(index)]; }

 private:
  std::vector<int> lens_at_, place_at_;
  std::vector<std::string> names_;
  int size_ = 0;
  bool free_lenses_ = true;
};

/// `a` less `b`, coordinate by coordinate of the layout; places as (w, v) with a = (w, v) of b.
/// Both rigs must have the cameras that the layout was made of.
Eigen::VectorXd Difference(const RigLayout& layout, const std::vector<RigCamera>& a,
                           const std::vector<RigCamera>& b);

}  // namespace dtr::calib
