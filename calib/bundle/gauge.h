// calib/bundle/gauge.h -- internal to calib/bundle: the seven ways to move a world as a whole.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "calib/bundle/bundle.h"
#include "calib/bundle/observation_cost.h"

namespace dtr::calib {

/// Derivatives of all poses (6 rows each: turn w, shift v of the centre, as in observation_cost.h)
/// by a shift, a turn and a growth of the world: 7 columns, the last zero where all stand in the
/// origin.
Eigen::MatrixXd GaugeColumns(const std::vector<PoseFrame>& poses);

/// Orthonormal directions, one per column, of `unknowns` unknowns that move the world as a whole:
/// three shifts, three turns, a scale (which none is where all cameras stand in one place). The
/// pose of image i begins at `image_at[i]`.
Eigen::MatrixXd GaugeDirections(const std::vector<PoseFrame>& poses,
                                const std::vector<int>& image_at, long unknowns);

/// Moves `now` as a whole so that its cameras are as near as can be to those of `start`: least
/// squares over turns (radians) and centres together (units of the bundle). At the minimum the
/// difference is orthogonal to every GaugeColumn: these are the inner constraints of a free network
/// (Triggs et al. 2000, sec. 9.4), to which the free network's covariance belongs. `keep_scale`:
/// lengths are known, and only shifts and turns are left to choose.
void MoveToGaugeOf(const Bundle& start, Bundle& now, bool keep_scale = false);

}  // namespace dtr::calib
