#include "calib/bundle/pattern_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "calib/bundle/lens_patterns.h"
#include "calib/bundle/shutter.h"
#include "calib/residual_patterns.h"

namespace dtr::calib {
namespace {

Check CheckOf(const char* name, const std::string& what, const WiderFit& fit, double min_p,
              double limit_px) {
  if (!fit.not_tested.empty()) {
    return AtMost(name, std::numeric_limits<double>::quiet_NaN(), limit_px,
                  "not tested: " + fit.not_tested);
  }
  return PatternCheck(name, what, fit.p, fit.amplitude_px, min_p, limit_px);
}

Check LensCheck(const char* name, const std::string& what, const LensPatternTest& test,
                const BundleLimits& limits) {
  Check check = CheckOf(name, what, test.fit, limits.min_p, limits.max_lens_pattern_px);
  if (test.lenses_left_out > 0) {
    check.reason +=
        fmt::format("; without {} cameras with the fewest observations", test.lenses_left_out);
  }
  return check;
}

Check ShutterCheck(const Adjusted& fresh, const BundleCovariance& layout,
                   const BundleLimits& limits) {
  const ShutterTest test = TestShutter(fresh, layout);
  Check check =
      CheckOf("rolling_shutter_px", "residuals as of cameras that rotate while the rows are read",
              test.fit, limits.min_p, limits.max_shutter_px);
  if (check.passed || test.sigmas.empty()) return check;
  const auto surest = static_cast<size_t>(std::max_element(test.sigmas.begin(), test.sigmas.end()) -
                                          test.sigmas.begin());
  check.reason +=
      fmt::format("; the surest is {}, by {:.3g} degrees from its first row to its last",
                  fresh.bundle.images[surest].name, test.turns_rad[surest] * 180 / EIGEN_PI);
  return check;
}

}  // namespace

std::vector<Check> PatternChecks(const Adjusted& fresh, const BundleCovariance& layout,
                                 const BundleLimits& limits) {
  return {LensCheck("radial_pattern_px",
                    "residuals along the radius that the camera model cannot follow",
                    TestRadialPattern(fresh, layout), limits),
          LensCheck("regional_pattern_px",
                    "mean residuals of image regions that the camera model cannot follow",
                    TestRegionalPattern(fresh, layout), limits),
          ShutterCheck(fresh, layout, limits)};
}

}  // namespace dtr::calib
