// calib/validation/board_residuals.h -- internal to calib/validation: residuals of views, and
// figures of them.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "calib/validation/boards.h"

namespace dtr::calib {

/// Residuals of a rig whose frames were fitted, by camera; outliers apart.
struct BoardResiduals {
  std::vector<std::vector<Eigen::Vector2d>> by_camera;
  std::vector<std::vector<ResidualArrow>> arrows;
  double squares = 0;  ///< px^2
  int corners = 0, outliers = 0;
};

/// Of the corners of one view, predicted less observed, without outliers and what has no pixel.
std::vector<ResidualArrow> ArrowsOf(const Board& board, const Rig& rig, const RigView& view);
/// Adds the residuals of all views of `rig`.
void AddResiduals(const Board& board, const Rig& rig, BoardResiduals& out);
/// px per coordinate, with the poses' 6 unknowns per frame taken off; NaN when nothing is left.
double SigmaOf(const BoardResiduals& residuals, size_t frames);

}  // namespace dtr::calib
