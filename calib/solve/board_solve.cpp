#include "calib/solve/board_solve.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "calib/models/lens_formula.h"
#include "calib/precision.h"
#include "calib/solve/board_start.h"
#include "calib/solve/least_squares.h"
#include "calib/solve/limits.h"
#include "calib/solve/reprojection.h"
#include "calib/solve/rig_system.h"
#include "dtr/base/error.h"

namespace dtr::calib {
namespace {

constexpr double kMinTiltDeg = 3;           // between two boards: below, they count as parallel
constexpr double kLargestFocalError = 0.1;  // relative; above, the solution is of no use

// What is being solved: the views in it, the camera and poses so far.
struct State {
  std::vector<const BoardView*> views;
  std::vector<Pose> cam_from_board;
  LensCamera camera;
  Used used;
};

std::vector<std::vector<double>> Lengths(const Board& board, const State& state) {
  std::vector<std::vector<double>> lengths;
  for (size_t i = 0; i < state.views.size(); ++i) {
    lengths.push_back(
        ResidualLengths(board, *state.views[i], state.camera, state.cam_from_board[i]));
  }
  return lengths;
}

// Largest |q| of a used corner: how far out the lens is seen.
double LargestRadius(const Board& board, const State& state) {
  const auto lens = FormulaOf(state.camera.model, state.camera.params.data());
  double largest = 1e-3;
  for (size_t i = 0; i < state.views.size(); ++i) {
    for (size_t j = 0; j < state.used[i].size(); ++j) {
      const Eigen::Vector3d p =
          state.cam_from_board[i] * board.Corner(state.views[i]->corners[j].id);
      Eigen::Vector2d q;
      if (state.used[i][j] && lens.Plane(p.data(), q.data())) largest = std::max(largest, q.norm());
    }
  }
  return largest;
}

// Least squares over the used corners from where the state is; Cauchy's loss where a scale is
// given.
void Minimise(const Board& board, BoardModel model, std::optional<double> cauchy_px, State& state) {
  const Eigen::Vector3d pivot = MiddleOf(board);
  const LensCoordinates lens = CoordinatesAround(model, state.camera, LargestRadius(board, state));
  std::vector<PoseCoordinates> poses;
  for (const Pose& pose : state.cam_from_board) poses.push_back(CoordinatesAround(pose, pivot));
  std::array<double, kMaxLensParameters> theta{};
  std::vector<std::array<double, 6>> motions(poses.size(), std::array<double, 6>{});
  ceres::Solver::Options options = SolverOptions();
  options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  ceres::Problem problem;
  for (size_t i = 0; i < poses.size(); ++i) {
    for (size_t j = 0; j < state.used[i].size(); ++j) {
      if (!state.used[i][j]) continue;
      const BoardCorner& corner = state.views[i]->corners[j];
      problem.AddResidualBlock(
          ReprojectionCost(lens, poses[i], board.Corner(corner.id) - pivot, corner.pixel).release(),
          cauchy_px ? new ceres::CauchyLoss(*cauchy_px) : nullptr, theta.data(), motions[i].data());
    }
    if (problem.HasParameterBlock(motions[i].data())) {
      options.linear_solver_ordering->AddElementToGroup(motions[i].data(), 0);
    }
  }
  options.linear_solver_ordering->AddElementToGroup(theta.data(), 1);
  if (auto prior = RadialPrior(lens, BorderRadius(state.camera),
                               SigmaOfUsed(Lengths(board, state), state.used))) {
    problem.AddResidualBlock(prior.release(), nullptr, theta.data());
  }
  if (!Solve(options, state.camera, &problem)) Reject("the corners have no least-squares solution");
  std::vector<double> params;
  for (int k = 0; k < FreeParameterCount(model); ++k) {
    const auto i = static_cast<size_t>(k);
    params.push_back(lens.centre[i] + lens.scale[i] * theta[i]);
  }
  try {
    state.camera = CameraFrom(model, state.camera.width_px, state.camera.height_px, params);
  } catch (const std::invalid_argument&) {
    Reject(
        fmt::format("no camera of the model {} explains the corners; take views of the board "
                    "from more directions",
                    NameOf(model)));
  }
  for (size_t i = 0; i < poses.size(); ++i) {
    state.cam_from_board[i] = PoseAt(poses[i], motions[i].data(), pivot);
  }
}

double SumOfSquares(const std::vector<double>& lengths, const std::vector<bool>& used) {
  double sum = 0;
  for (size_t j = 0; j < lengths.size(); ++j) sum += used[j] ? lengths[j] * lengths[j] : 0;
  return sum;
}

// A plane can be seen in two poses that differ little. Which is right is clear only when the lens
// is known, so views are looked at once more. Returns true when a pose was exchanged.
bool RepairPoses(const Board& board, State& state) {
  bool repaired = false;
  for (size_t i = 0; i < state.views.size(); ++i) {
    const auto other = PoseOfBoard(board, *state.views[i], state.camera);
    if (!other) continue;
    const auto& used = state.used[i];
    const auto now = ResidualLengths(board, *state.views[i], state.camera, state.cam_from_board[i]);
    const auto then = ResidualLengths(board, *state.views[i], state.camera, *other);
    if (SumOfSquares(then, used) < SumOfSquares(now, used)) {
      state.cam_from_board[i] = *other;
      repaired = true;
    }
  }
  return repaired;
}

void TakeOutView(size_t index, const std::string& reason, State& state,
                 std::vector<LeftOut>& left_out) {
  const auto at = static_cast<long>(index);
  left_out.push_back({state.views[index]->name, reason});
  state.views.erase(state.views.begin() + at);
  state.cam_from_board.erase(state.cam_from_board.begin() + at);
  state.used.erase(state.used.begin() + at);
}

void TakeOutDisagreeing(State& state, std::vector<LeftOut>& left_out) {
  for (size_t i = state.views.size(); i-- > 0;) {
    const auto& used = state.used[i];
    const auto agreeing = static_cast<size_t>(std::count(used.begin(), used.end(), true));
    if (agreeing >= kMinCorners &&
        static_cast<double>(agreeing) >= kMinAgreeing * static_cast<double>(used.size())) {
      continue;
    }
    TakeOutView(i,
                fmt::format("only {} of {} corners lie where a flat board can have them", agreeing,
                            used.size()),
                state, left_out);
  }
  if (state.views.size() < kMinViews) {
    Reject(fmt::format("expected at least {} images that one camera explains, found {}", kMinViews,
                       state.views.size()));
  }
}

void SolveRobustly(const Board& board, BoardModel model, double outlier_sigmas, State& state,
                   std::vector<LeftOut>& left_out) {
  state.used = Within(Lengths(board, state), std::numeric_limits<double>::infinity());
  double scale = kCauchySigmas * SigmaOfUsed(Lengths(board, state), state.used);
  for (int pass = 0; pass < kMaxRobustPasses; ++pass) {
    Minimise(board, model, scale, state);
    const bool repaired = RepairPoses(board, state);
    const double next = kCauchySigmas * SigmaOfUsed(Lengths(board, state), state.used);
    const bool settled = std::abs(next - scale) < kSameScale * scale;
    scale = next;
    if (settled && !repaired) break;
  }
  state.used = Within(Lengths(board, state), OutlierLimitPx(outlier_sigmas, scale / kCauchySigmas));
  TakeOutDisagreeing(state, left_out);
  for (int pass = 0; pass < kMaxOutlierPasses; ++pass) {
    Minimise(board, model, {}, state);
    const auto lengths = Lengths(board, state);
    Used used = Within(lengths, OutlierLimitPx(outlier_sigmas, ScatterOfUsed(lengths, state.used)));
    if (used == state.used) break;
    state.used = std::move(used);
    TakeOutDisagreeing(state, left_out);
  }
}

// Least squares until the residuals, which say what the prior weighs, do not shrink any more.
void MinimiseSettled(const Board& board, BoardModel model, State& state) {
  double sigma = SigmaOfUsed(Lengths(board, state), state.used);
  for (int pass = 0; pass < kMaxRobustPasses; ++pass) {
    Minimise(board, model, {}, state);
    const double next = SigmaOfUsed(Lengths(board, state), state.used);
    const bool settled = std::abs(next - sigma) < kSameScale * sigma;
    sigma = next;
    if (settled) break;
  }
}

void SolveQuadratically(const Board& board, BoardModel model, State& state) {
  state.used = Within(Lengths(board, state), std::numeric_limits<double>::infinity());
  MinimiseSettled(board, model, state);
  // Corners that the start could not draw count now.
  state.used = Within(Lengths(board, state), std::numeric_limits<double>::infinity());
  for (const auto& used : state.used) {
    if (std::count(used.begin(), used.end(), false) > 0) {
      Reject(
          "with a quadratic loss every corner counts, and some have no position in the image; "
          "leave the loss robust");
    }
  }
  RepairPoses(board, state);
  MinimiseSettled(board, model, state);
}

void RejectParallelBoards(const State& state) {
  double min_cosine = 1;
  const auto normal = [&](size_t i) -> Eigen::Vector3d {
    return state.cam_from_board[i].rotation * Eigen::Vector3d::UnitZ();
  };
  for (size_t i = 0; i < state.views.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      min_cosine = std::min(min_cosine, std::abs(normal(i).dot(normal(j))));
    }
  }
  const double tilt_deg = std::acos(std::min(1.0, min_cosine)) * 180 / std::numbers::pi;
  if (tilt_deg < kMinTiltDeg) {
    Reject(
        fmt::format("parallel boards: expected boards tilted against each other by at least {} "
                    "degrees, found {:.2f}; focal length and distance cannot be distinguished; "
                    "tilt the board by 20 to 45 degrees, to different sides",
                    kMinTiltDeg, tilt_deg));
  }
}

ArrowInformation InformationOf(const Board& board, BoardModel model, const State& state) {
  Rig rig;
  rig.cameras.push_back({"", model, state.camera, {}});
  rig.rig_from_board = state.cam_from_board;
  for (size_t i = 0; i < state.views.size(); ++i) {
    RigView view{0, i, *state.views[i], {}};
    for (size_t j = 0; j < state.used[i].size(); ++j) {
      if (!state.used[i][j]) view.outliers.push_back(view.seen.corners[j].id);
    }
    rig.views.push_back(std::move(view));
  }
  const RigLayout layout(rig.cameras, true);
  return calib::InformationOf(RowsOf(board, rig, layout), layout);
}

void RejectUseless(const BoardSolution& solution, bool cover_image) {
  const double error = std::sqrt(std::max(solution.covariance(0, 0), solution.covariance(1, 1)));
  const double focal = std::min(solution.camera.params[0], solution.camera.params[1]);
  if (!(error < kLargestFocalError * focal)) {
    Reject(
        fmt::format("the focal length is not determined, {:.4g} px +- {:.2g}: the boards are too "
                    "parallel to each other, too few or too far away; fill the image and tilt "
                    "them by 20 to 45 degrees, to different sides",
                    focal, error));
  }
  if (cover_image && !CoversImage(solution.camera)) {
    Reject(TurnsBack(solution.model));
  }
}

void Describe(const Board& board, const State& state, BoardSolution& solution) {
  const auto lengths = Lengths(board, state);
  double sum = 0;
  for (size_t i = 0; i < state.views.size(); ++i) {
    SolvedView view{state.views[i]->name, state.cam_from_board[i], {}, 0};
    const double squares = SumOfSquares(lengths[i], state.used[i]);
    const auto count = std::count(state.used[i].begin(), state.used[i].end(), true);
    for (size_t j = 0; j < state.used[i].size(); ++j) {
      if (!state.used[i][j]) view.outliers.push_back(state.views[i]->corners[j].id);
    }
    view.rms_px = std::sqrt(squares / static_cast<double>(count));
    solution.corners += static_cast<int>(count);
    solution.outliers += static_cast<int>(view.outliers.size());
    solution.views.push_back(std::move(view));
    sum += squares;
  }
  const auto unknowns = static_cast<double>(FreeParameterCount(solution.model)) +
                        6.0 * static_cast<double>(state.views.size());
  const double freedom = 2.0 * solution.corners - unknowns;
  if (!(freedom > 0)) {
    Reject(fmt::format("expected more corners than half of {} unknowns, found {}; take more views",
                       unknowns, solution.corners));
  }
  solution.rms_px = std::sqrt(sum / solution.corners);
  solution.sigma_px = std::sqrt(sum / freedom);
}

State StateFrom(const Board& board, std::span<const BoardView> views, int width_px, int height_px,
                BoardModel model, std::vector<LeftOut>& left_out) {
  const BoardStart start = StartBoard(board, views, width_px, height_px, model);
  State state;
  state.camera = start.camera;
  for (size_t i = 0; i < views.size(); ++i) {
    if (start.cam_from_board[i]) {
      state.views.push_back(&views[i]);
      state.cam_from_board.push_back(*start.cam_from_board[i]);
    } else {
      left_out.push_back({views[i].name, "no pose of a flat board explains its corners"});
    }
  }
  return state;
}

}  // namespace

std::string TurnsBack(BoardModel model) {
  return fmt::format(
      "the distortion of the model {} folds back before the corner of the image; show the board "
      "near the corners, or choose fewer coefficients",
      NameOf(model));
}

bool Holds(std::span<const int> ids, int id) {
  return std::binary_search(ids.begin(), ids.end(), id);
}

Eigen::Vector3d MiddleOf(const Board& board) {
  return 0.5 * (board.Corner(0) + board.Corner(board.CornerCount() - 1));
}

std::vector<double> BoardSolution::FreeParameters() const {
  return {camera.params.begin(), camera.params.begin() + FreeParameterCount(model)};
}

BoardSolution SolveBoard(const Board& board, std::span<const BoardView> views, int width_px,
                         int height_px, BoardModel model, const SolveOptions& options) {
  if (views.size() < kMinViews) {
    Reject(fmt::format("expected at least {} images with the board, found {}", kMinViews,
                       views.size()));
  }
  BoardSolution solution;
  solution.model = model;
  State state = StateFrom(board, views, width_px, height_px, model, solution.left_out);
  if (options.loss == Loss::kRobust) {
    SolveRobustly(board, model, options.outlier_sigmas, state, solution.left_out);
  } else {
    SolveQuadratically(board, model, state);
  }
  RejectParallelBoards(state);
  solution.camera = state.camera;
  Describe(board, state, solution);
  solution.information = InformationOf(board, model, state);
  solution.covariance = VarianceOf(solution.sigma_px) * solution.information.lens_covariance();
  RejectUseless(solution, options.cover_image);
  return solution;
}

std::optional<Pose> SolvePose(const Board& board, const BoardView& view, const LensCamera& camera,
                              std::span<const int> ignored) {
  if (!IsAdjustable(camera.model)) {
    throw Error("calibration: a pose cannot be solved with the camera model " +
                NameOf(camera.model) + "; use another one");
  }
  const auto start = PoseOfBoard(board, view, camera);
  if (!start) return std::nullopt;
  const Eigen::Vector3d pivot = MiddleOf(board);
  const PoseCoordinates pose = CoordinatesAround(*start, pivot);
  const auto lengths = ResidualLengths(board, view, camera, *start);
  std::array<double, 6> motion{};
  ceres::Problem problem;
  for (size_t j = 0; j < view.corners.size(); ++j) {
    const BoardCorner& corner = view.corners[j];
    if (Holds(ignored, corner.id) || !std::isfinite(lengths[j])) continue;
    problem.AddResidualBlock(
        PoseCost(camera, pose, board.Corner(corner.id) - pivot, corner.pixel).release(), nullptr,
        motion.data());
  }
  if (problem.NumResidualBlocks() < static_cast<int>(kMinCorners)) return std::nullopt;
  ceres::Solver::Options options = SolverOptions();
  options.linear_solver_type = ceres::DENSE_QR;
  if (!Solve(options, camera, &problem)) return std::nullopt;
  return PoseAt(pose, motion.data(), pivot);
}

}  // namespace dtr::calib
