// calib/judge/patterns.h -- what noise does not do: residuals that follow a pattern.
#pragma once
#include <functional>
#include <span>
#include <vector>

#include "calib/boards/board.h"
#include "calib/solve/rig_solve.h"

namespace dtr::calib {

/// How much of the residuals a pattern explains that the unknowns of the solve cannot: Fisher's F
/// test of the wider least-squares problem against the solved one (Seber & Lee 2003, sec. 4.3),
/// to first order around the solution.
struct PatternTest {
  double p = 1;  ///< of as much by chance, for normal errors
  /// RMS over all coordinates of what the pattern explains, less what it would explain of noise.
  double amplitude_px = 0;
  int freedom = 0;  ///< patterns that are independent of the unknowns and of each other
  // Per column, of shared patterns alone; not a number where no residual feels it, and empty where
  // columns cannot be told apart.
  std::vector<double> coefficients, sigmas;
  std::vector<double> effects_px;  ///< what the coefficient does to a coordinate it acts on, RMS
};

/// Columns of a pattern for the rows of a frame. Shared: one coefficient per column for all frames.
using PatternColumns = std::function<Eigen::MatrixXd(const FrameRows&)>;
PatternTest TestSharedPattern(const RigSolution& solution, const PatternColumns& columns);
/// With coefficients of its own for every frame. `nuisance`: patterns with shared coefficients that
/// are fitted in any case and are not what is tested for.
PatternTest TestFramePattern(std::span<const FrameRows> rows, const PatternColumns& columns,
                             const PatternColumns& nuisance = {});

/// Residuals along the radius from the principal point, as a function of the radius: hat functions
/// on 6 rings per camera (residual_patterns.h). A lens model that cannot follow the lens.
PatternTest TestRadial(const RigSolution& solution);
/// A mean residual vector in each of 4 x 4 regions of the image, per camera.
PatternTest TestRegional(const RigSolution& solution);
/// A board whose corners lie off its plane, bent and twisted (second and third order in its
/// coordinates).
PatternTest TestBoardShape(const Board& board, const RigSolution& solution);
/// A motion of the board, free for each frame, times the row of the image: what a shutter that
/// reads row by row does to a moving board. What a board of another shape does is taken out before:
/// every corner may lie elsewhere on it. Of boards with more than 150 corners, 150 take part.
PatternTest TestRollingShutter(const Board& board, const RigSolution& solution);
/// Per camera but the first: an image that is late by a time, in frames; the board's speed from the
/// frames before and after. coefficients: the delays. p is 1 for a single camera.
PatternTest TestTimeOffset(const RigSolution& solution);
/// The same with a delay of every frame's own, beyond one that all frames share: images that are
/// not taken at one rate. p is 1 for a single camera.
PatternTest TestUnsteadyClocks(const RigSolution& solution);

}  // namespace dtr::calib
