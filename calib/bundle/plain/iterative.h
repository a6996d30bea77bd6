// calib/bundle/plain/iterative.h -- internal to calib/bundle/plain: the reduced system of many
// images, solved without its matrix.
#pragma once
#include <Eigen/Core>
#include <optional>

#include "calib/bundle/plain/normal.h"

namespace dtr::calib::plain {

/// Preconditioned conjugate gradients on the Schur complement, which is applied point by point and
/// never written out (Agarwal et al. 2010, sec. 4). Requires a layout of that kind, in which poses
/// move. The same bits for any number of threads. Empty where the system is not positive definite.
std::optional<Eigen::VectorXd> SolveIteratively(const Problem& problem, const Layout& layout,
                                                const NormalEquations& normal);

}  // namespace dtr::calib::plain
