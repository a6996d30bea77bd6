#include "calib/solve/model_spread.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>

#include "calib/lens_map.h"
#include "calib/models/radial_bend.h"
#include "calib/solve/choose_model.h"
#include "calib/solve/least_squares.h"
#include "calib/solve/limits.h"
#include "calib/solve/reprojection.h"
#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"

namespace dtr::calib {
namespace {

std::vector<BoardView> WithoutOutliers(std::span<const BoardView> views,
                                       std::span<const std::vector<int>> outliers) {
  std::vector<BoardView> some;
  for (size_t i = 0; i < views.size(); ++i) {
    BoardView view = views[i];
    std::erase_if(view.corners, [&](const auto& corner) { return Holds(outliers[i], corner.id); });
    if (view.corners.size() >= kMinCorners) some.push_back(std::move(view));
  }
  return some;
}

std::optional<BoardSolution> SolvedOrNot(const Board& board, BoardModel model, int width_px,
                                         int height_px, std::span<const BoardView> views) {
  SolveOptions options;
  options.loss = Loss::kQuadratic;
  options.cover_image = false;
  try {
    return SolveBoard(board, views, width_px, height_px, model, options);
  } catch (const Error&) {
    return std::nullopt;  // views that do not determine a model do not recommend it either
  }
}

// The motion of the frame `cam` after which `other` draws where the corners were seen what `own`
// has where its poses put the boards.
std::optional<Pose> OtherFromOwn(const Board& board, std::span<const BoardView> views,
                                 const BoardSolution& own, const LensCamera& other) {
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector2d>> seen;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const SolvedView& solved : own.views) {
    const auto view = std::find_if(views.begin(), views.end(),
                                   [&](const BoardView& v) { return v.name == solved.name; });
    for (const BoardCorner& corner : view->corners) {
      seen.emplace_back(solved.cam_from_board * board.Corner(corner.id), corner.pixel);
      middle += seen.back().first;
    }
  }
  middle /= static_cast<double>(seen.size());
  const PoseCoordinates pose = CoordinatesAround(Pose{}, middle);
  std::array<double, 6> motion{};
  ceres::Problem problem;
  for (const auto& [point, pixel] : seen) {
    problem.AddResidualBlock(PoseCost(other, pose, point - middle, pixel).release(), nullptr,
                             motion.data());
  }
  ceres::Solver::Options options = SolverOptions();
  options.linear_solver_type = ceres::DENSE_QR;
  if (!Solve(options, other, &problem)) return std::nullopt;
  return PoseAt(pose, motion.data(), middle);
}

double SquaresOf(const SolvedView& view, std::span<const BoardView> views) {
  const auto seen = std::find_if(views.begin(), views.end(),
                                 [&](const BoardView& v) { return v.name == view.name; });
  return view.rms_px * view.rms_px * static_cast<double>(seen->corners.size());
}

constexpr double kClearlyBetter = -3;  // standard errors

// What the other model's squared residuals exceed the own ones by, the mean of all views in units
// of its standard error; infinite where it cannot explain a view.
double ExcessOf(const BoardSolution& other, const BoardSolution& own,
                std::span<const BoardView> views) {
  double sum = 0, squares = 0;
  size_t count = 0;
  for (const SolvedView& view : own.views) {
    const auto same = std::find_if(other.views.begin(), other.views.end(),
                                   [&](const SolvedView& v) { return v.name == view.name; });
    if (same == other.views.end()) return std::numeric_limits<double>::infinity();
    const double excess = SquaresOf(*same, views) - SquaresOf(view, views);
    sum += excess;
    squares += excess * excess;
    ++count;
  }
  const auto n = static_cast<double>(count);
  const double mean = sum / n, variance = std::max(0.0, squares / n - mean * mean);
  const double error = std::sqrt(variance / std::max(1.0, n - 1));
  return mean / std::max(error, std::numeric_limits<double>::min());
}

// Polynomials with further coefficients fit as well whatever these are, which the covariance of one
// without them cannot count; where they fit no better there is nothing to count.
bool Contains(BoardModel other, BoardModel own) {
  return other != BoardModel::kFisheye && own != BoardModel::kFisheye &&
         FreeParameterCount(other) > FreeParameterCount(own);
}

// One-standard-error rule with views as the unit. Nothing bounds a quotient of polynomials (brown8)
// between the outermost corner and the border, where others have a prior.
bool FitsAsWell(const BoardSolution& other, const BoardSolution& own,
                std::span<const BoardView> views) {
  const bool must_be_better =
      other.model == BoardModel::kBrown8 || Contains(other.model, own.model);
  return ExcessOf(other, own, views) <= (must_be_better ? kClearlyBetter : 1);
}

bool BendsPlausibly(const LensCamera& camera, std::span<const BoardView> views) {
  double seen_px = 0;
  for (const BoardView& view : views) {
    seen_px = std::max(seen_px, OutermostPx(camera, view.corners, {}));
  }
  return RadialBendOf(camera, seen_px).Plausible();
}

}  // namespace

std::optional<double> OtherModel::DifferenceAt(const Eigen::Vector2d& pixel,
                                               double distance) const {
  const auto ray = own.RayFromPixel(pixel);
  if (!ray) return std::nullopt;
  const auto other = LensMap(camera).PixelFromCam(other_from_own * (distance * *ray));
  return other ? (*other - pixel).norm() : std::numeric_limits<double>::infinity();
}

std::vector<OtherModel> OtherModels(const Board& board, BoardModel chosen, int width_px,
                                    int height_px, std::span<const BoardView> views,
                                    std::span<const std::vector<int>> outliers) {
  const std::vector<BoardView> used = WithoutOutliers(views, outliers);
  std::array<std::optional<BoardSolution>, std::size(kBoardModels)> solved;
  ParallelFor(0, static_cast<int>(solved.size()), [&](int m) {
    solved[static_cast<size_t>(m)] = SolvedOrNot(board, kBoardModels[m], width_px, height_px, used);
  });
  const BoardSolution* own = nullptr;
  for (const auto& solution : solved) {
    if (solution && solution->model == chosen) own = &*solution;
  }
  std::vector<OtherModel> others;
  if (own == nullptr) return others;
  const bool own_bends = !BendsPlausibly(own->camera, used);
  for (const auto& other : solved) {
    if (!other || other->model == chosen || !BendsPlausibly(other->camera, used)) continue;
    const bool nearly = own_bends && other->sigma_px <= kBendGivesWay * own->sigma_px;
    if (!nearly && !FitsAsWell(*other, *own, used)) continue;
    const auto other_from_own = OtherFromOwn(board, used, *own, other->camera);
    if (!other_from_own) continue;
    others.push_back({other->model, own->camera, other->camera, *other_from_own, other->sigma_px});
  }
  return others;
}

}  // namespace dtr::calib
