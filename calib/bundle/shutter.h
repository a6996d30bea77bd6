// calib/bundle/shutter.h -- were the photos' rows read while the camera turned?
#pragma once
#include <string>
#include <vector>

#include "calib/bundle/covariance.h"

namespace dtr::calib {

/// A camera that turns while its rows are read, one after the other, draws each row from another
/// pose. Of every image a turn from the first row to the last, about the camera's three axes, is
/// held against residuals that lens, poses and points cannot explain: Fisher's F test of the wider
/// least-squares problem against the solved one, to first order (Seber & Lee 2003, sec. 4.3). A
/// motion sideways looks like a turn where what is seen is about equally far.
struct ShutterTest {
  std::string not_tested;  ///< why there is no figure; empty where there is one
  double p = 1;            ///< of as much by chance, for normal errors
  /// RMS over all coordinates of what the turns explain, less what they would of noise.
  double amplitude_px = 0;
  int freedom = 0;  ///< turns that are independent of the unknowns and of each other
  /// Per image: its turn, radians, and its length in predicted standard deviations.
  std::vector<double> turns_rad, sigmas;
};

/// At a solution of Adjust, with the layout of its covariance (CovarianceOf).
ShutterTest TestShutter(const Adjusted& adjusted, const BundleCovariance& layout);

}  // namespace dtr::calib
