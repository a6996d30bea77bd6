// calib/solve/board_start.h -- where a calibration starts: a camera and poses good enough for
// Newton.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "calib/boards/board.h"
#include "calib/boards/observations.h"
#include "calib/models/board_model.h"
#include "dtr/types/pose.h"

namespace dtr::calib {

/// Standard deviation per coordinate that residual lengths would have if the smaller third of them
/// came from a normal distribution: holds while more than half of them are good.
/// Requires at least one.
double RobustSigma(std::vector<double> lengths_px);

/// Pose of a board before a known camera, from its corners alone: rays, a homography that most of
/// the corners agree with (RANSAC), and of the two poses that a plane can have (Collins & Bartoli
/// 2014, IPPE) the one with the smaller reprojection errors. Half of the corners may be wrong.
/// Empty when fewer than 4 corners agree.
std::optional<Pose> PoseOfBoard(const Board& board, const BoardView& view,
                                const LensCamera& camera);

/// Distance of a view's corners from where this camera and pose draw them, in the order of
/// view.corners; infinite for corners without a pixel.
std::vector<double> ResidualLengths(const Board& board, const BoardView& view,
                                    const LensCamera& camera, const Pose& cam_from_board);

struct BoardStart {
  LensCamera camera;
  std::vector<std::optional<Pose>> cam_from_board;  ///< per view; empty: no pose explains it
};

/// A camera without distortion, principal point in the middle of the image, whose focal length
/// explains the views best: OpenCV's closed form (Zhang 2000) and a ladder of focal lengths from
/// ultra wide to 2 degrees are tried. Throws Error when none explains at least 3 views.
BoardStart StartBoard(const Board& board, std::span<const BoardView> views, int width_px,
                      int height_px, BoardModel model);

}  // namespace dtr::calib
