#include "calib/solve/term_uncertainty.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "calib/distributions.h"
#include "calib/solve/reprojection.h"

namespace dtr::calib {

TermUncertainty MostUncertainTerm(BoardModel model, const LensCamera& camera,
                                  const Eigen::MatrixXd& covariance) {
  TermUncertainty most;
  // A fisheye's image may be a circle with nothing in the corners.
  const double radius = model == BoardModel::kFisheye
                            ? std::min(BorderRadius(camera), std::numbers::pi / 2)
                            : BorderRadius(camera);
  double power = 1;
  for (const int index : RadialTerms(model)) {
    power *= radius * radius;
    const double share = RootOfVariance(covariance(index, index)) * power;
    if (most.index < 0 || !(share <= most.share)) most = {index, share};
  }
  return most;
}

std::string TextOfTerm(BoardModel model, const LensCamera& camera,
                       const Eigen::MatrixXd& covariance, int index) {
  const auto at = static_cast<size_t>(index);
  return fmt::format("{} = {:.2g} +- {:.2g}", FreeParameterNames(model)[at], camera.params[at],
                     RootOfVariance(covariance(index, index)));
}

}  // namespace dtr::calib
