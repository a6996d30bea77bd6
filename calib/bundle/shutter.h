// calib/bundle/shutter.h -- internal to calib/bundle: were the photos' rows read while the camera
// turned?
#pragma once
#include <vector>

#include "calib/bundle/wider_fit.h"

namespace dtr::calib {

/// A camera that turns while its rows are read, one after the other, draws each row from another
/// pose. Of every image a turn from the first row to the last, about the camera's three axes, is
/// held against residuals that lens, poses and points cannot explain. A motion sideways looks like
/// a turn where what is seen is about equally far.
struct ShutterTest {
  WiderFit fit;
  /// Per image: its turn, radians, and its length in predicted standard deviations.
  std::vector<double> turns_rad, sigmas;
};

/// At a solution of Adjust, with the layout of its covariance (CovarianceOf).
ShutterTest TestShutter(const Adjusted& adjusted, const BundleCovariance& layout);

}  // namespace dtr::calib
