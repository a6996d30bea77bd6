// calib/solve/rig_start.h -- where a rig's cameras stand, from boards that several of them saw.
#pragma once
#include <string>
#include <utility>
#include <vector>

#include "calib/boards/board.h"
#include "calib/solve/rig.h"

namespace dtr::calib {

/// A view with the pose that its own camera gives the board.
struct PosedView {
  RigView view;
  Pose cam_from_board;
};

/// A plain chessboard whose corners were counted from the other end: the same board, turned by 180
/// degrees. Boards with markers cannot be confused so.
BoardView TurnedByHalf(const Board& board, const BoardView& view);
RigView TurnedByHalf(const Board& board, const RigView& view);  ///< outliers with their corners
Pose TurnedByHalf(const Board& board, const Pose& cam_from_board);

/// Corners that views call outliers, taken out of them: they were decided on before.
void DropOutliers(std::vector<RigView>& views);

/// Views that are counted from the same end within a frame, and the poses of the frames' boards.
struct Counted {
  std::vector<RigView> views;        ///< flipped ones with their corners counted again
  std::vector<Pose> rig_from_board;  ///< by each frame's first view; of frames without one, nothing
  std::vector<std::string> flipped;  ///< names of views that were counted from the other end
};

/// Each frame's views, counted from the end that fits the first of them, with the cameras where
/// they stand.
Counted CountFromOneEnd(const Board& board, const std::vector<RigCamera>& cameras,
                        std::vector<PosedView> views, size_t frames);

/// A rig to start Newton from.
struct RigStart {
  Rig rig;                           ///< flipped views have their corners counted again
  std::vector<std::string> flipped;  ///< names of views that were counted from the other end
};

/// Places the cameras relative to the first: along the pairs with the most frames in common, each
/// by the one of the frames' own answers that agrees best with all of them (a medoid: half of the
/// frames may be wrong), with each chessboard counted from either end. Then each frame's views are
/// counted from the end that fits the first of them. `cameras` need no cam_from_rig; frames are
/// 0..frames-1. Throws Error naming the cameras that no frame connects to the first.
RigStart StartRig(const Board& board, std::vector<RigCamera> cameras, std::vector<PosedView> views,
                  size_t frames);

}  // namespace dtr::calib
