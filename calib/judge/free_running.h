// calib/judge/free_running.h -- rigs whose cameras take their images when they like.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "calib/boards/board.h"
#include "calib/solve/rig_solve.h"

namespace dtr::calib {

/// How much later than the first camera's a camera's images of a frame are, in frames.
struct CameraDelay {
  double frames = 0, sigma = 0;  ///< sigma: standard deviation
};

struct FreeRunning {
  /// Of corners that are moved to where they would have been seen had all cameras of a frame taken
  /// their images at one moment: that of the camera of the frame with the least delay. Views
  /// whose moment lies between no two frames are left out. The covariance takes the delays as
  /// unknown.
  RigSolution solution;
  std::vector<std::optional<CameraDelay>> delays;  ///< per camera; empty: the board does not tell
  std::vector<bool> moved;                         ///< per camera: its delay is no chance
  int passes = 0;                                  ///< solves it took
};

/// Beyond this many standard deviations a delay is no chance. (One that corners were moved for once
/// stays no chance above 2.)
inline constexpr double kDelaySigmas = 4.5;

/// What a solution of synchronised cameras says against that, per camera, to first order: residuals
/// that follow the board's motion from frame to frame. Empty where the board does not tell.
std::vector<std::optional<CameraDelay>> DelaysOf(const Board& board, const RigSolution& solution);

/// Solves the rig (SolveRig), estimates every camera's delay from how residuals follow the board's
/// motion, moves the corners accordingly, and begins again until the delays stay. Where the board
/// was between two frames is interpolated from its poses in up to four of them around (a cubic in
/// the turn's logarithm and the shift), no two neighbours more than 1.5 frames apart. After five
/// solves the corners that count stay the same: where some lie at the limit of what is an outlier,
/// solves that decide on them again would take turns for ever. Corners that `views` call outliers
/// are dropped, as by SolveRig. `frames` are in order of time and equally far from each other.
/// Throws Error as SolveRig does, where no delay can be told (a board that stands still, or frames
/// that do not follow each other), where a delay is beyond 3 frames, and where the delays do not
/// settle. The same inputs give the same bits.
FreeRunning SolveFreeRunning(const Board& board, std::span<const RigCameraInput> cameras,
                             std::vector<RigView> views, size_t frames,
                             const RigOptions& options = {});

}  // namespace dtr::calib
