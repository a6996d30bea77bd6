#include "calib/bundle/observation_rows.h"

#include <Eigen/QR>

#include "calib/bundle/lens_params.h"

namespace dtr::calib {

bool RowsOf(const Normalised& n, const Bundle& bundle, const BundleObservation& observation,
            ObservationRows& rows) {
  const auto image = static_cast<size_t>(observation.image);
  const auto lens = static_cast<size_t>(bundle.images[image].lens);
  const double* blocks[] = {n.theta[lens].data(), n.motion[image].data(),
                            n.place[static_cast<size_t>(observation.point)].data()};
  rows.lens.resize(2, static_cast<long>(n.lenses[lens].centre.size()));
  double* jacobians[] = {rows.lens.data(), rows.pose.data(), rows.point.data()};
  return n.Cost(bundle, observation)->Evaluate(blocks, rows.residual.data(), jacobians) &&
         rows.lens.allFinite() && rows.pose.allFinite() && rows.point.allFinite();
}

Eigen::MatrixXd WithoutPoint(const Eigen::MatrixXd& by_point, const Eigen::MatrixXd& rest) {
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(by_point);
  const Eigen::MatrixXd turned = qr.householderQ().adjoint() * rest;
  return turned.bottomRows(rest.rows() - qr.rank());
}

std::vector<int> FreeParams(const LensCamera& lens, LensFreedom freedom) {
  std::vector<int> free;
  const int focals = FocalCount(lens.model);
  for (int k = 0; k < ParameterCount(lens.model); ++k) {
    const bool focal = k < focals, centre = !focal && k < focals + 2;
    const bool is_free = focal ? freedom != LensFreedom::kFixed
                         : centre
                             ? FreesPrincipalPoint(freedom)
                             : freedom != LensFreedom::kFixed && freedom != LensFreedom::kFocal;
    if (is_free) free.push_back(k);
  }
  return free;
}

}  // namespace dtr::calib
