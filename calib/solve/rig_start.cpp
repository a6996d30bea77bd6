#include "calib/solve/rig_start.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <numbers>
#include <optional>

#include "calib/solve/board_solve.h"
#include "calib/solve/least_squares.h"
#include "dtr/base/order_statistics.h"

namespace dtr::calib {
namespace {

constexpr size_t kMaxCandidates = 60;  // answers that are compared; one good one is enough

bool CanTurn(const Board& board) { return board.kind == Board::Kind::kChessboard; }

// How far two poses of the board disagree: mean distance of its four extreme corners.
double Disagreement(const Board& board, const Pose& a, const Pose& b) {
  const std::array<int, 4> ids{0, board.columns - 1, board.CornerCount() - board.columns,
                               board.CornerCount() - 1};
  double sum = 0;
  for (const int id : ids) sum += (a * board.Corner(id) - b * board.Corner(id)).norm();
  return sum / 4;
}

// Disagreement counted from the end that fits better; whether that is the other one.
std::pair<double, bool> LeastDisagreement(const Board& board, const Pose& expected,
                                          const Pose& found) {
  const double as_is = Disagreement(board, expected, found);
  if (!CanTurn(board)) return {as_is, false};
  const double turned = Disagreement(board, expected, TurnedByHalf(board, found));
  return {std::min(as_is, turned), turned < as_is};
}

using Shared = std::vector<std::pair<const Pose*, const Pose*>>;  // from, to: per common frame

Shared SharedFrames(const std::vector<PosedView>& views, size_t from, size_t to) {
  std::map<size_t, const Pose*> first;
  for (const PosedView& v : views) {
    if (v.view.camera == from) first[v.view.frame] = &v.cam_from_board;
  }
  Shared shared;
  for (const PosedView& v : views) {
    const auto other = first.find(v.view.frame);
    if (v.view.camera == to && other != first.end()) {
      shared.emplace_back(other->second, &v.cam_from_board);
    }
  }
  return shared;
}

// to_from_from: of the frames' own answers the one with the least median disagreement.
Pose RelativePose(const Board& board, const Shared& shared) {
  Pose best;
  double least = std::numeric_limits<double>::infinity();
  const size_t count = std::min(shared.size(), kMaxCandidates);
  for (size_t k = 0; k < count; ++k) {
    const auto& [from, to] = shared[k * shared.size() / count];
    for (const bool turn : {false, true}) {
      if (turn && !CanTurn(board)) continue;
      const Pose candidate = (turn ? TurnedByHalf(board, *to) : *to) * from->Inverse();
      std::vector<double> misfits;
      for (const auto& [a, b] : shared) {
        misfits.push_back(LeastDisagreement(board, candidate * *a, *b).first);
      }
      const double median = UpperMedian(misfits);
      if (median < least) {
        least = median;
        best = candidate;
      }
    }
  }
  return best;
}

void PlaceCameras(const Board& board, const std::vector<PosedView>& views,
                  std::vector<RigCamera>& cameras) {
  std::vector<bool> placed(cameras.size(), false);
  placed[0] = true;
  cameras[0].cam_from_rig = {};
  for (size_t step = 1; step < cameras.size(); ++step) {
    Shared most;
    size_t from = 0, to = 0;
    for (size_t a = 0; a < cameras.size(); ++a) {
      for (size_t b = 0; b < cameras.size(); ++b) {
        if (!placed[a] || placed[b]) continue;
        Shared shared = SharedFrames(views, a, b);
        if (shared.size() > most.size()) {
          most = std::move(shared);
          from = a;
          to = b;
        }
      }
    }
    if (most.empty()) {
      std::string names;
      for (size_t c = 0; c < cameras.size(); ++c) {
        if (!placed[c]) names += (names.empty() ? "" : ", ") + cameras[c].name;
      }
      Reject(
          fmt::format("no frame shows the board to one of the cameras {} and to one connected "
                      "with {}; show it to both at once",
                      names, cameras[0].name));
    }
    cameras[to].cam_from_rig = RelativePose(board, most) * cameras[from].cam_from_rig;
    placed[to] = true;
  }
}

}  // namespace

void DropOutliers(std::vector<RigView>& views) {
  for (RigView& view : views) {
    std::erase_if(view.seen.corners,
                  [&](const BoardCorner& corner) { return Holds(view.outliers, corner.id); });
    view.outliers.clear();
  }
}

BoardView TurnedByHalf(const Board& board, const BoardView& view) {
  BoardView turned = view;
  std::reverse(turned.corners.begin(), turned.corners.end());
  for (BoardCorner& corner : turned.corners) corner.id = board.CornerCount() - 1 - corner.id;
  return turned;
}

RigView TurnedByHalf(const Board& board, const RigView& view) {
  RigView turned = view;
  turned.seen = TurnedByHalf(board, view.seen);
  std::reverse(turned.outliers.begin(), turned.outliers.end());
  for (int& id : turned.outliers) id = board.CornerCount() - 1 - id;
  return turned;
}

Pose TurnedByHalf(const Board& board, const Pose& cam_from_board) {
  const Eigen::Quaterniond half(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitZ()));
  const Eigen::Vector3d middle = MiddleOf(board);
  return cam_from_board * Pose{half, middle - half * middle};
}

Counted CountFromOneEnd(const Board& board, const std::vector<RigCamera>& cameras,
                        std::vector<PosedView> views, size_t frames) {
  Counted counted;
  std::vector<std::optional<Pose>> poses(frames);
  for (PosedView& posed : views) {
    const Pose& cam_from_rig = cameras[posed.view.camera].cam_from_rig;
    std::optional<Pose>& rig_from_board = poses[posed.view.frame];
    if (!rig_from_board) {
      rig_from_board = cam_from_rig.Inverse() * posed.cam_from_board;
    } else if (LeastDisagreement(board, cam_from_rig * *rig_from_board, posed.cam_from_board)
                   .second) {
      posed.view = TurnedByHalf(board, posed.view);
      counted.flipped.push_back(posed.view.seen.name);
    }
    counted.views.push_back(std::move(posed.view));
  }
  // Frames without a view take no part; their pose is never looked at.
  for (const auto& pose : poses) counted.rig_from_board.push_back(pose.value_or(Pose{}));
  return counted;
}

RigStart StartRig(const Board& board, std::vector<RigCamera> cameras, std::vector<PosedView> views,
                  size_t frames) {
  std::sort(views.begin(), views.end(), [](const PosedView& a, const PosedView& b) {
    return std::pair(a.view.frame, a.view.camera) < std::pair(b.view.frame, b.view.camera);
  });
  PlaceCameras(board, views, cameras);
  Counted counted = CountFromOneEnd(board, cameras, std::move(views), frames);
  RigStart start;
  start.rig.views = std::move(counted.views);
  start.rig.rig_from_board = std::move(counted.rig_from_board);
  start.rig.cameras = std::move(cameras);
  start.flipped = std::move(counted.flipped);
  return start;
}

}  // namespace dtr::calib
