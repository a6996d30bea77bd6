#include "calib/judge/pattern_checks.h"

#include <fmt/format.h>

#include <cmath>

#include "calib/judge/patterns.h"
#include "calib/residual_patterns.h"

namespace dtr::calib {
namespace {

Check DelayCheck(const RigSolution& solution, const JudgeLimits& limits) {
  const PatternTest late = TestTimeOffset(solution);
  Check check{"time_offset_sigmas", 0, limits.max_time_offset_sigmas, true,
              "not determined: the board stands still, or its frames do not follow each other"};
  std::string untold;
  for (size_t c = 0; c < late.coefficients.size(); ++c) {
    if (!std::isfinite(late.coefficients[c])) {
      untold += (untold.empty() ? "" : ", ") + solution.rig.cameras[c + 1].name;
      continue;
    }
    const double sigmas = std::abs(late.coefficients[c]) / late.sigmas[c];
    // What corners err by in any case is no fault of the clocks.
    const bool harmless = sigmas > check.limit && late.effects_px[c] <= limits.max_pattern_px;
    const double counted = harmless ? 0 : sigmas;
    if (counted < check.value) continue;
    check.value = counted;
    check.reason = fmt::format(
        "{}: its images are {:.4f} +- {:.4f} frames {} than {}'s, which moves a coordinate "
        "by {:.3f} px RMS{}",
        solution.rig.cameras[c + 1].name, std::abs(late.coefficients[c]), late.sigmas[c],
        late.coefficients[c] < 0 ? "earlier" : "later", solution.rig.cameras[0].name,
        late.effects_px[c], harmless ? ": no chance, but no more than corners err" : "");
  }
  check.passed = check.value <= check.limit;
  if (!untold.empty()) {
    check.reason +=
        "; not determined for " + untold + ": its views are in no frames that follow each other";
  }
  return check;
}

}  // namespace

std::vector<Check> PatternChecks(const Board& board, const Fresh& fresh,
                                 const JudgeLimits& limits) {
  const double limit = limits.max_pattern_px;
  if (!fresh.solution) return {NotTested("regional_pattern_px", limit, fresh.refused)};
  const RigSolution& solution = *fresh.solution;
  std::vector<Check> checks;
  const auto add = [&](const char* name, const PatternTest& test, const std::string& what) {
    checks.push_back(PatternCheck(name, what, test.p, test.amplitude_px, limits.min_p, limit));
  };
  add("radial_pattern_px", TestRadial(solution),
      "residuals along the radius that the camera model cannot follow");
  add("regional_pattern_px", TestRegional(solution),
      "mean residuals of image regions that the camera model cannot follow");
  add("board_shape_px", TestBoardShape(board, solution), "residuals as of a board that is bent");
  add("rolling_shutter_px", TestRollingShutter(board, solution),
      "residuals as of boards that move while the rows are read");
  if (solution.rig.cameras.size() < 2) return checks;
  checks.push_back(DelayCheck(solution, limits));
  add("unsteady_clocks_px", TestUnsteadyClocks(solution),
      "residuals as of photos that are not taken at one rate");
  return checks;
}

}  // namespace dtr::calib
