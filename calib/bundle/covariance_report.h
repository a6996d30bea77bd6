// calib/bundle/covariance_report.h -- what is uncertain about lenses and poses, by their names.
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "calib/bundle/covariance.h"

namespace dtr::calib {

/// Of one lens: its free parameters by name, and their covariance in the same order.
struct LensCovariance {
  std::vector<std::string> names;
  Eigen::MatrixXd matrix;
};

/// Of one photo's camera, 6x6: turn w (radians, p_in_cam = exp(w) p_in_cam), then the centre (world
/// units), in the gauge of the free network (BundleCovariance).
struct PoseCovariance {
  std::string name;
  Eigen::MatrixXd matrix;
};

/// BundleCovariance without the bundle; `lenses` and `cameras` are empty where the covariance is
/// not determined or not computed.
struct CovarianceReport {
  double sigma_px = 0;    ///< of an observed coordinate
  bool computed = false;  ///< false beyond kMaxUnknowns: the next three are defaults then
  double condition = 0;   ///< may be infinite
  int gauge_freedom = 0;
  bool determined = true;
  std::vector<LensCovariance> lenses;   ///< in the bundle's order
  std::vector<PoseCovariance> cameras;  ///< in the order of the bundle's images
};

/// `covariance` is that of `adjusted`, whose bundle is still there.
CovarianceReport CovarianceReportOf(const Adjusted& adjusted, const BundleCovariance& covariance);

}  // namespace dtr::calib
