#include "calib/solve/rotated_views.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "calib/solve/board_start.h"
#include "dtr/base/error.h"

namespace dtr::calib {
namespace {

constexpr std::array kRotations{PhotoRotation::kClockwise, PhotoRotation::kCounterclockwise};
// Of squared residuals. For the wrong way to leave half of what the right one does, the errors of a
// view's corners would have to lie along the difference of the two by more than 45 degrees in some
// 100 dimensions. The chessboard set's views reach 1.1 to 15, the right way in each.
constexpr double kClearRatio = 2;
constexpr double kClearSigmas = 3;      // of views' differences with random signs: 10 that agree
constexpr double kExplainedSigmas = 3;  // RMS of a view that is of this camera
constexpr double kHalfTurnSigmas = 5;   // covariances do not count what is systematic
constexpr double kNoiseFloorPx = 0.02;  // corners of drawn boards have next to none

// Of one view, per rotation of kRotations: squared residuals, the pose alone fitted; infinite where
// no pose explains the view.
using Squares = std::array<double, 2>;

Squares SquaresOf(const Board& board, const BoardView& view, const LensCamera& camera) {
  Squares squares;
  for (size_t r = 0; r < kRotations.size(); ++r) {
    const BoardView back = OnSensorGrid(view, kRotations[r], camera.width_px, camera.height_px);
    squares[r] = std::numeric_limits<double>::infinity();
    const auto pose = SolvePose(board, back, camera);
    if (!pose) continue;
    squares[r] = 0;
    for (const double length : ResidualLengths(board, back, camera, *pose)) {
      squares[r] += length * length;
    }
  }
  return squares;
}

// How far the camera is, in standard deviations, from one that half a turn of the sensor does not
// change: principal point in the middle, no tangential distortion.
double HalfTurnSigmas(const BoardSolution& solution) {
  const LensCamera& camera = solution.camera;
  const auto names = FreeParameterNames(solution.model);
  std::vector<int> odd;  // parameters that half a turn mirrors
  std::vector<double> off;
  for (size_t i = 0; i < names.size(); ++i) {
    double middle = 0;
    if (names[i] == "cx_px")
      middle = camera.width_px / 2.0;
    else if (names[i] == "cy_px")
      middle = camera.height_px / 2.0;
    else if (names[i] != "p1" && names[i] != "p2")
      continue;
    odd.push_back(static_cast<int>(i));
    off.push_back(camera.params[i] - middle);
  }
  const Eigen::MatrixXd covariance = solution.covariance(odd, odd);
  const Eigen::Map<const Eigen::VectorXd> distance(off.data(), static_cast<long>(off.size()));
  return std::sqrt(distance.dot(covariance.ldlt().solve(distance)));
}

size_t BetterOf(const Squares& squares) { return squares[0] <= squares[1] ? 0 : 1; }

bool IsClear(const Squares& squares) {
  const size_t better = BetterOf(squares);
  return squares[1 - better] > kClearRatio * squares[better];
}

// Largest squared residuals of a view that is of the camera; a pose has 6 parameters.
double ExplainedSquares(const BoardView& view, const ReferenceCamera& reference) {
  if (!reference.sigma_px) return std::numeric_limits<double>::max();
  const double sigma = kExplainedSigmas * std::max(*reference.sigma_px, kNoiseFloorPx);
  const double freedom = 2.0 * static_cast<double>(view.corners.size()) - 6;
  return std::max(2.0, freedom) * sigma * sigma;
}

// What the views that are not clear follow, an index of kRotations.
std::optional<size_t> CommonRotation(const std::vector<Squares>& explained) {
  std::array<int, 2> clear{};
  double sum = 0, squares = 0;
  for (const Squares& view : explained) {
    if (IsClear(view)) ++clear[BetterOf(view)];
    const double difference = view[1] - view[0];
    sum += difference;
    squares += difference * difference;
  }
  if (clear[0] > 0 && clear[1] > 0) return std::nullopt;
  if (clear[0] > 0) return 0;
  if (clear[1] > 0) return 1;
  if (!(std::abs(sum) > kClearSigmas * std::sqrt(squares))) return std::nullopt;
  return sum > 0 ? 0 : 1;
}

}  // namespace

BoardView OnSensorGrid(const BoardView& view, PhotoRotation rotation, int width_px, int height_px) {
  BoardView back = view;
  back.rotation = rotation;
  for (BoardCorner& corner : back.corners) {
    const Eigen::Vector2d p = corner.pixel;
    if (rotation == PhotoRotation::kClockwise) corner.pixel = {p.y(), height_px - p.x()};
    if (rotation == PhotoRotation::kCounterclockwise) corner.pixel = {width_px - p.y(), p.x()};
  }
  return back;
}

ReferenceCamera ReferenceFrom(const Board& board, std::span<const BoardView> views, int width_px,
                              int height_px) {
  SolveOptions options;
  options.cover_image = false;
  std::optional<BoardSolution> best;
  std::string why;
  for (const BoardModel model : {BoardModel::kBrown4, BoardModel::kFisheye}) {
    try {
      BoardSolution solved = SolveBoard(board, views, width_px, height_px, model, options);
      if (!best || solved.sigma_px < best->sigma_px) best = std::move(solved);
    } catch (const Error& error) {
      if (why.empty()) why = error.what();
    }
  }
  if (!best) throw Error(why);
  if (!(HalfTurnSigmas(*best) > kHalfTurnSigmas)) {
    throw Error("its principal point is in the middle of the image, as far as they show it");
  }
  return {best->camera, best->sigma_px};
}

std::vector<FoundRotation> FindRotations(const Board& board, std::span<const BoardView> rotated,
                                         const ReferenceCamera& reference) {
  std::vector<Squares> all, explained;
  std::vector<bool> is_explained;
  for (const BoardView& view : rotated) {
    all.push_back(SquaresOf(board, view, reference.camera));
    const double least = all.back()[BetterOf(all.back())];
    is_explained.push_back(least <= ExplainedSquares(view, reference));
    if (is_explained.back()) explained.push_back(all.back());
  }
  const auto common = CommonRotation(explained);
  std::vector<FoundRotation> found(rotated.size());
  for (size_t i = 0; i < rotated.size(); ++i) {
    if (!is_explained[i]) {
      found[i].undecided =
          "neither rotation agrees with the camera of the other photos; is it of another "
          "camera, zoom or crop?";
    } else if (IsClear(all[i])) {
      found[i].rotation = kRotations[BetterOf(all[i])];
    } else if (common) {
      found[i].rotation = kRotations[*common];
    } else {
      found[i].undecided = "both ways agree with the camera of the other photos";
    }
  }
  return found;
}

}  // namespace dtr::calib
