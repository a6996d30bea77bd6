// dtr/render/blend_weights.h -- SPEC 4.5: the five weights by name, safe at any exponent.
#pragma once
#include <span>
#include <string_view>

#include "dtr/render/options.h"
#include "dtr/types/dtr_set.h"

namespace dtr {

/// Parameters of a weight that do not change within one image.
struct BlendParameters {
  BlendWeight blend = BlendWeight::kCosine;
  double exponent = 8, falloff = 8;
  int blend_k = 3;
  double max_angle_rad = 1;
  double pixel_angle_rad = 1e-3;  ///< t_pixel: angle of one novel pixel at the image centre
  /// 1/z in the novel camera at which t of farther points is taken, 1 / scene units; 0: nowhere.
  double least_inverse_depth = 0;
};
/// `bounds`: of the scene; t of points farther away than its diagonal is taken there. Empty: t is
/// taken at the points themselves.
BlendParameters BlendParametersOf(const RenderOptions& options, double novel_fx_px,
                                  const Bounds& bounds);

/// Natural logarithm of the weight for one angle t >= 0 (radians); -infinity for weight 0.
/// `next_angle_rad` is t_(k+1) of kKNearest and ignored by the others.
double LogWeight(const BlendParameters& parameters, double angle_rad, double next_angle_rad);

/// t_(k+1) of kKNearest: the (k+1)-th smallest of `angles_rad`, or max_angle where there are no
/// more than k of them.
double NextAngle(const BlendParameters& parameters, std::span<const double> angles_rad);

/// SPEC 4.6. Weights of the views that meet at one pixel, divided by their sum. Logarithms are
/// subtracted before exponentiating, so nothing overflows and the largest never vanishes; where
/// every weight is 0 the views at the smallest angle share equally. `shares` has the length of
/// `angles_rad`. Returns how many views have a weight above 0 (before rounding).
int BlendShares(const BlendParameters& parameters, std::span<const double> angles_rad,
                std::span<double> shares);

/// SPEC 4.8. Shares of views that fade by `factors` (above 0, at most 1), their sum 1 before and
/// after.
void FadeShares(std::span<const double> factors, std::span<double> shares);

}  // namespace dtr
