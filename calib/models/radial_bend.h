// calib/models/radial_bend.h -- what a camera model does where no corner was seen.
#pragma once
#include <span>

#include "calib/boards/observations.h"
#include "calib/lens_camera.h"

namespace dtr::calib {

/// The radial scale of a camera model is d|d| / d|q| of the formula in lens_formula.h, tangential
/// terms left out: 1 on the axis, everywhere 1 of a model without distortion. Lenses change it
/// steadily; a polynomial of high degree can leave the observed part of the image with any slope.
/// Changes are of its natural logarithm against the axis.
struct RadialBend {
  double seen_px = 0, border_px = 0;  ///< distance of the outermost corner seen, and of the
                                      ///< image's farthest corner with its margin
  double seen_change = 0;             ///< largest up to the outermost corner that was seen
  double beyond_change = 0;           ///< largest from there to the image's farthest corner
  bool folds = false;                 ///< the scale reaches zero before the farthest corner
  double allowed = 0;                 ///< for beyond_change

  bool Plausible() const { return !folds && beyond_change <= allowed; }
};

/// Measures the model up to the image's farthest corner and a margin, or to 100 degrees off the
/// axis, whichever is nearer: a fisheye's image may be a circle with nothing in the corners. What
/// is allowed beyond the corners seen is the change up to them, continued by the law of the first
/// term of every model (the square of |q|), times 2 for further terms, and a floor for lenses that
/// hardly change. Requires `seen_px`, the outermost distance from the principal point at which a
/// corner was seen, to be positive; CameraModel::kFov is not measured.
RadialBend RadialBendOf(const LensCamera& camera, double seen_px);

/// Largest distance from the principal point of these corners, px, but for those in `outliers`'
/// (sorted ids).
double OutermostPx(const LensCamera& camera, std::span<const BoardCorner> corners,
                   std::span<const int> outliers);

}  // namespace dtr::calib
