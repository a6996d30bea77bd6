// calib/solve/term_uncertainty.h -- which coefficient of a camera model the corners leave open.
#pragma once
#include <Eigen/Core>
#include <string>

#include "calib/models/board_model.h"

namespace dtr::calib {

/// How uncertain one radial coefficient is: its standard deviation as the share of the distance from
/// the principal point by which it moves the image's corner, of a fisheye no farther than 90 degrees
/// off its axis.
struct TermUncertainty {
  int index = -1;  ///< into FreeParameterNames; -1: the model has no such coefficient
  double share = 0;
};

/// More than that, and corners say little more of a coefficient than is known of any camera (0.3:
/// the prior of solves).
inline constexpr double kMaxTermShare = 0.1;

/// The most uncertain radial coefficient by a covariance of FreeParameterNames. Of a quotient
/// (brown8) single coefficients say nothing: none.
TermUncertainty MostUncertainTerm(BoardModel model, const LensCamera& camera,
                                  const Eigen::MatrixXd& covariance);

/// "k4 = 9.9 +- 19".
std::string TextOfTerm(BoardModel model, const LensCamera& camera,
                       const Eigen::MatrixXd& covariance, int index);

}  // namespace dtr::calib
