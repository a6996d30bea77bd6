#include "calib/bundle/shutter.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "calib/bundle/wider_fit.h"

namespace dtr::calib {

ShutterTest TestShutter(const Adjusted& adjusted, const BundleCovariance& layout) {
  const Bundle& bundle = adjusted.bundle;
  // How far down the image, from -1/2 to 1/2, times the turn of all of it.
  const auto turns_of = [&](const BundleObservation& observation, const ObservationRows& rows) {
    const auto lens =
        static_cast<size_t>(bundle.images[static_cast<size_t>(observation.image)].lens);
    const double share = DrawnAt(observation, rows).y() / bundle.lenses[lens].height_px - 0.5;
    std::vector<ExtraColumn> columns;
    for (long k = 0; k < 3; ++k)
      columns.push_back({3 * observation.image + k, share * rows.pose.col(k)});
    return columns;
  };
  const long turns = 3 * static_cast<long>(bundle.images.size());
  ShutterTest test{FitWider(adjusted, layout, turns, turns_of), {}, {}};
  if (!test.fit.not_tested.empty()) return test;
  for (long i = 0; i < turns; i += 3) {
    const Eigen::Vector3d turn = test.fit.found.segment<3>(i);
    const Eigen::Matrix3d covariance =
        test.fit.half.middleRows<3>(i) * test.fit.half.middleRows<3>(i).transpose();
    const double squared = turn.dot(covariance.ldlt().solve(turn));
    test.turns_rad.push_back(turn.norm());
    test.sigmas.push_back(squared >= 0 ? std::sqrt(squared) : 0);
  }
  return test;
}

}  // namespace dtr::calib
