// calib/bundle/wider_fit.h -- internal to calib/bundle: do unknowns that a solve did not have
// explain what it left?
#pragma once
#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "calib/bundle/covariance.h"
#include "calib/bundle/observation_rows.h"

namespace dtr::calib {

/// How an observation's residual, px, follows one more unknown.
struct ExtraColumn {
  long unknown = 0;
  Eigen::Vector2d by;
};
/// Those that an observation feels; none of them twice.
using ExtraColumns =
    std::function<std::vector<ExtraColumn>(const BundleObservation&, const ObservationRows&)>;

struct WiderFit {
  std::string not_tested;  ///< why there is no figure; empty where there is one
  double p = 1;            ///< of as much by chance, for normal errors
  /// RMS over all coordinates of what the unknowns explain, less what they would of noise.
  double amplitude_px = 0;
  int freedom = 0;        ///< unknowns that are independent of the solve's and of each other
  Eigen::VectorXd found;  ///< their values, the shortest vector where some cannot be told apart
  Eigen::MatrixXd half;   ///< half half^T is their covariance
};

/// Fisher's F test of the least-squares problem with `extra` more unknowns against the solved one,
/// to first order (Seber & Lee 2003, sec. 4.3), at a solution of Adjust with the layout of its
/// covariance (CovarianceOf). Deterministic.
WiderFit FitWider(const Adjusted& adjusted, const BundleCovariance& layout, long extra,
                  const ExtraColumns& columns);

/// How many unknowns may be added before the test is rejected.
long MostExtra(const BundleCovariance& layout);

/// Where an observation's point is drawn. Not where it was seen: a pattern made of that holds the
/// residual itself.
Eigen::Vector2d DrawnAt(const BundleObservation& observation, const ObservationRows& rows);

}  // namespace dtr::calib
