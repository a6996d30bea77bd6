// calib/bundle/observation_rows.h -- internal to calib/bundle: one observation's derivatives.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "calib/bundle/adjust.h"
#include "calib/bundle/normalised.h"

namespace dtr::calib {

/// Of the residual, px, by the solver's coordinates (observation_cost.h).
struct ObservationRows {
  Eigen::Vector2d residual;
  Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::RowMajor> lens;
  Eigen::Matrix<double, 2, 6, Eigen::RowMajor> pose;
  Eigen::Matrix<double, 2, 3, Eigen::RowMajor> point;
};

/// False where the point has no pixel.
bool RowsOf(const Normalised& n, const Bundle& bundle, const BundleObservation& observation,
            ObservationRows& rows);

/// What is left of rows where a point is fitted to them. Orthogonal elimination: subtracting
/// W V^-1 W^T would lose the digits that tell far points' depth.
Eigen::MatrixXd WithoutPoint(const Eigen::MatrixXd& by_point, const Eigen::MatrixXd& rest);

/// Indices of the lens's parameters that this freedom lets move.
std::vector<int> FreeParams(const LensCamera& lens, LensFreedom freedom);

}  // namespace dtr::calib
