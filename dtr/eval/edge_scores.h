// dtr/eval/edge_scores.h -- how far estimated depth edges lie from the true ones.
#pragma once
#include <optional>

#include "dtr/types/depth_image.h"
#include "dtr/types/grid.h"

namespace dtr::eval {

/// Figures over true depth edges. Empty: there was none.
struct EdgeScores {
  std::optional<double> displacement_px;  ///< mean of |estimated place - true place|, pixels
  std::optional<double> fattening_px;     ///< mean, > 0 where the near surface has grown
  std::optional<double> found_share;      ///< edges that have an estimate on both sides
};

/// Gathers the depth edges of any number of maps. An edge is a pair of neighbouring pixels of a row
/// or a column whose true inverse depths differ by a jump. Along that row or column, up to 8 pixels
/// either way as far as the truth stays on its side of the middle between the two inverse depths,
/// the estimated edge is put where the fewest kept pixels lie on the wrong side; in the middle of
/// all such places when a hole leaves the choice. An edge without kept pixels of both surfaces is
/// not found and has no displacement.
class EdgeScorer {
 public:
  /// `estimate`, `truth`: plane z on one grid; `scored`: both pixels of an edge must count (empty:
  /// all do). `set_units_per_truth_unit` as in DepthScorer::Add; `px_per_inverse_depth` > 0: jumps
  /// are measured in pixels of disparity.
  void Add(const DepthImage& estimate, const DepthImage& truth, const Mask& scored,
           double set_units_per_truth_unit, double px_per_inverse_depth);
  EdgeScores Scores() const;

 private:
  long long edges_ = 0, found_ = 0;
  double displacement_sum_ = 0, fattening_sum_ = 0;
};

}  // namespace dtr::eval
