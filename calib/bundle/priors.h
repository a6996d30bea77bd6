// calib/bundle/priors.h -- internal to calib/bundle: what a solve knows beside the observations.
#pragma once
#include <ceres/ceres.h>

#include "calib/bundle/adjust.h"
#include "calib/bundle/normalised.h"

namespace dtr::calib {

/// Throws Error on priors that cannot be meant.
void CheckPriors(const Bundle& bundle, const AdjustOptions& options);

/// Positions, distances, shifts of images and what is known of lenses, in units of an observation's
/// sigma so that both sums can be added. `known`: the lenses that are known. `n` is borrowed.
void AddPriors(const Bundle& bundle, const std::vector<LensCamera>& known,
               const AdjustOptions& options, double sigma_px, Normalised& n,
               ceres::Problem& problem);

/// What the priors miss by, in units of their sigmas, squared; how many numbers they are.
double PriorSquares(const std::vector<LensCamera>& known, const Bundle& bundle,
                    const AdjustOptions& options, double* numbers);

}  // namespace dtr::calib
