// calib/bundle/plain/minimise_bundle.h -- internal to calib/bundle: Adjust's solves without Ceres.
#pragma once
#include <vector>

#include "calib/bundle/adjust.h"
#include "calib/bundle/normalised.h"
#include "calib/bundle/plain/minimise.h"

namespace dtr::calib {

/// Whether MinimisePlain serves: plain camera models, images that move by themselves, no known
/// positions or distances.
bool ServesPlain(const Bundle& bundle, const AdjustOptions& options, const Normalised& n);

/// One solve of Adjust: over the observations with used[i], under Cauchy's loss where a scale is
/// given. `known`: the lenses that the options' priors speak of; `sigma_px` weighs these.
plain::MinimiseResult MinimisePlain(const Bundle& bundle, const std::vector<LensCamera>& known,
                                    const AdjustOptions& options, const std::vector<bool>& used,
                                    double sigma_px, double cauchy_px, Normalised& n);

}  // namespace dtr::calib
