// calib/bundle/parallax.h -- internal to calib/bundle: points whose distance nothing tells.
#pragma once
#include <vector>

#include "calib/bundle/bundle.h"
#include "calib/bundle/normalised.h"

namespace dtr::calib {

/// Clears used[i] of observations whose points have no parallax left: seen from one position alone
/// (exposure brackets, bursts), often because the observations from elsewhere are outliers. Such a
/// point takes any distance for a little less noise, and with it the tiny distances between those
/// photos, in hundreds of steps. `sigma_px`: of an observation's coordinate. All stay of an image
/// that would lose most of its own, and where too few others are there to say how far things are.
void LeaveOutWithoutParallax(const Bundle& bundle, const Normalised& n, double sigma_px,
                             std::vector<bool>& used);

}  // namespace dtr::calib
