#include "calib/solve/board_scale.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "calib/distributions.h"
#include "calib/precision.h"
#include "calib/solve/board_solve.h"
#include "calib/solve/board_start.h"
#include "calib/solve/least_squares.h"
#include "calib/solve/limits.h"
#include "calib/solve/rig_start.h"
#include "calib/triangulate.h"
#include "dtr/base/error.h"

namespace dtr::calib {
namespace {

constexpr double kOutlierSigmas = 5;
constexpr double kMaxRelativeSigma = 0.1;  // as with distances (calib/scale.cpp)
constexpr double kMinParallax = 1 * std::numbers::pi / 180;
// Scatter beyond what a set's own gate allows is no noise: views that contradict each other must
// not make room for each other.
constexpr double kMaxSigmaPx = 1.5;
constexpr double kStartScalePx = 2;  // of Cauchy's loss, before a sigma is known
constexpr size_t kMaxOfPairs = 40;   // views whose pairs are tried
constexpr int kMaxSteps = 50;
constexpr double kWithoutPixel = 100;  // cost of a corner behind its camera

using Vector7 = Eigen::Matrix<double, 7, 1>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;

[[noreturn]] void RejectScale(const std::string& what) { throw Error("scale by a board: " + what); }

// A corner as a view saw it.
struct Corner {
  size_t view = 0;
  int id = 0;
  Observation observation;
  bool used = true;
};

// Everything but the similarity.
struct Problem {
  const Board& board;
  std::span<const BoardObservation> observations;
  std::vector<BoardView> seen;  // counted from the end that fits
  std::vector<bool> view_used;
  std::vector<Corner> corners;
};

Corner CornerOf(const BoardObservation& observation, size_t view, const BoardCorner& corner) {
  return {view, corner.id,
          MakeObservation(observation.camera, observation.cam_from_world, corner.pixel), true};
}

double CauchyCost(double length_px, double scale_px) {
  return std::isfinite(length_px) ? std::log1p(std::pow(length_px / scale_px, 2)) : kWithoutPixel;
}

double LengthPx(const Observation& observation, const Eigen::Vector3d& p_in_world) {
  Eigen::Vector2d residual;
  return PixelResidual(observation, p_in_world, &residual, nullptr)
             ? residual.norm()
             : std::numeric_limits<double>::infinity();
}

double CostOf(const Board& board, const BoardObservation& observation, const BoardView& seen,
              const Similarity& scene_from_board) {
  double cost = 0;
  for (const BoardCorner& corner : seen.corners) {
    cost += CauchyCost(
        LengthPx(MakeObservation(observation.camera, observation.cam_from_world, corner.pixel),
                 scene_from_board * board.Corner(corner.id)),
        kStartScalePx);
  }
  return cost;
}

bool MayBeTurned(const Board& board) { return board.kind == Board::Kind::kChessboard; }

// The view, counted from the end that fits better.
BoardView Fitting(const Board& board, const BoardObservation& observation,
                  const Similarity& scene_from_board, double* cost) {
  *cost = CostOf(board, observation, observation.seen, scene_from_board);
  if (!MayBeTurned(board)) return observation.seen;
  BoardView turned = TurnedByHalf(board, observation.seen);
  const double other = CostOf(board, observation, turned, scene_from_board);
  if (other >= *cost) return observation.seen;
  *cost = other;
  return turned;
}

// Where two views alone see the board; empty where their corners do not tell.
std::optional<Similarity> FromPair(const Board& board, const BoardObservation& a,
                                   const BoardObservation& b, const BoardView& seen_by_b) {
  std::vector<Eigen::Vector3d> on_board, in_scene;
  double widest = 0;
  for (const BoardCorner& corner : a.seen.corners) {
    const auto same = std::find_if(seen_by_b.corners.begin(), seen_by_b.corners.end(),
                                   [&](const BoardCorner& c) { return c.id == corner.id; });
    if (same == seen_by_b.corners.end()) continue;
    const Observation observations[] = {MakeObservation(a.camera, a.cam_from_world, corner.pixel),
                                        MakeObservation(b.camera, b.cam_from_world, same->pixel)};
    const Triangulation point = Triangulate(observations, -1);
    if (point.status != TriangulationStatus::kConverged) continue;
    widest = std::max(widest,
                      std::atan2(observations[0].direction.cross(observations[1].direction).norm(),
                                 observations[0].direction.dot(observations[1].direction)));
    on_board.push_back(board.Corner(corner.id));
    in_scene.push_back(point.p_in_world);
  }
  if (on_board.size() < kMinCorners || widest < kMinParallax) return std::nullopt;
  try {
    return AlignPoints(on_board, in_scene);
  } catch (const Error&) {
    return std::nullopt;  // corners on a line
  }
}

// Of what all pairs of views say, that which all views together agree with best.
Similarity Start(const Board& board, std::span<const BoardObservation> observations) {
  std::optional<Similarity> best;
  double least = std::numeric_limits<double>::infinity();
  const auto ask = [&](const std::optional<Similarity>& candidate) {
    if (!candidate) return;
    double sum = 0;
    for (const BoardObservation& observation : observations) {
      double cost = 0;
      Fitting(board, observation, *candidate, &cost);
      sum += cost;
    }
    if (sum >= least) return;
    least = sum;
    best = candidate;
  };
  const size_t step = (observations.size() + kMaxOfPairs - 1) / kMaxOfPairs;
  for (size_t i = 0; i < observations.size(); i += step) {
    for (size_t j = 0; j < i; j += step) {
      ask(FromPair(board, observations[i], observations[j], observations[j].seen));
      if (!MayBeTurned(board)) continue;
      ask(FromPair(board, observations[i], observations[j],
                   TurnedByHalf(board, observations[j].seen)));
    }
  }
  if (!best) {
    RejectScale(
        "expected two views that see the board under an angle of a degree or more, found none; "
        "take photos of it from different sides");
  }
  return *best;
}

// Normal equations of a step of the similarity: its scale's logarithm, a turn, and a shift in sizes
// of the board, all about the board's middle. Weights of Cauchy's loss where a scale is given.
double Accumulate(const Problem& problem, const Similarity& scene_from_board,
                  std::optional<double> cauchy_px, Matrix7* normal, Vector7* right) {
  const Eigen::Vector3d middle = MiddleOf(problem.board);
  const double size = scene_from_board.scale * middle.norm();
  double cost = 0;
  normal->setZero();
  right->setZero();
  for (const Corner& corner : problem.corners) {
    if (!corner.used || !problem.view_used[corner.view]) continue;
    const Eigen::Vector3d place = problem.board.Corner(corner.id);
    Eigen::Vector2d residual;  // observed less predicted
    Eigen::Matrix<double, 2, 3> by_point;
    if (!PixelResidual(corner.observation, scene_from_board * place, &residual, &by_point)) {
      cost += kWithoutPixel;
      continue;
    }
    const Eigen::Vector3d arm =
        scene_from_board.scale * (scene_from_board.rotation * (place - middle));
    Eigen::Matrix<double, 3, 7> by_step;
    by_step.col(0) = arm;
    for (int k = 0; k < 3; ++k) by_step.col(1 + k) = Eigen::Vector3d::Unit(k).cross(arm);
    by_step.rightCols<3>() = size * Eigen::Matrix3d::Identity();
    const Eigen::Matrix<double, 2, 7> j = by_point * by_step;
    const double square = residual.squaredNorm();
    const double weight = cauchy_px ? 1 / (1 + square / (*cauchy_px * *cauchy_px)) : 1;
    cost += cauchy_px ? *cauchy_px * *cauchy_px * CauchyCost(residual.norm(), *cauchy_px) : square;
    *normal += weight * j.transpose() * j;
    *right += weight * j.transpose() * residual;
  }
  return cost;
}

Similarity Stepped(const Board& board, const Similarity& from, const Vector7& step) {
  const Eigen::Vector3d middle = MiddleOf(board), turn = step.segment<3>(1);
  Similarity to;
  to.scale = from.scale * std::exp(step[0]);
  to.rotation = from.rotation;
  if (turn.norm() > 0) {
    to.rotation =
        (Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized())) * from.rotation)
            .normalized();
  }
  const Eigen::Vector3d centre = from * middle + from.scale * middle.norm() * step.tail<3>();
  to.translation = centre - to.scale * (to.rotation * middle);
  return to;
}

// Levenberg-Marquardt; `normal` is left as it is at the minimum.
Similarity Minimised(const Problem& problem, Similarity at, std::optional<double> cauchy_px,
                     Matrix7* normal) {
  Vector7 right;
  double damping = 1e-6;
  double cost = Accumulate(problem, at, cauchy_px, normal, &right);
  for (int k = 0; k < kMaxSteps; ++k) {
    Matrix7 damped = *normal;
    damped.diagonal() *= 1 + damping;
    const Vector7 step = damped.ldlt().solve(right);
    if (!step.allFinite()) break;
    const Similarity next = Stepped(problem.board, at, step);
    Matrix7 next_normal;
    Vector7 next_right;
    const double next_cost = Accumulate(problem, next, cauchy_px, &next_normal, &next_right);
    if (!(next_cost <= cost)) {
      damping = std::max(damping * 10, 1e-6);
      if (damping > 1e12) break;
      continue;
    }
    at = next;
    *normal = next_normal;
    right = next_right;
    cost = next_cost;
    damping /= 10;
    if (step.norm() < 1e-12) break;
  }
  return at;
}

std::vector<double> UsedLengths(const Problem& problem, const Similarity& scene_from_board) {
  std::vector<double> lengths;
  for (const Corner& corner : problem.corners) {
    if (!corner.used || !problem.view_used[corner.view]) continue;
    lengths.push_back(
        LengthPx(corner.observation, scene_from_board * problem.board.Corner(corner.id)));
  }
  return lengths;
}

double SigmaOf(const Problem& problem, const Similarity& scene_from_board) {
  return std::clamp(RobustSigma(UsedLengths(problem, scene_from_board)), kSmallestSigmaPx,
                    kMaxSigmaPx);
}

// Drops corners that are off, and views of which most are. False when nothing changed.
bool DropOutliers(const Similarity& scene_from_board, Problem& problem) {
  const double limit = OutlierLimitPx(kOutlierSigmas, SigmaOf(problem, scene_from_board));
  bool changed = false;
  std::vector<size_t> all(problem.seen.size(), 0), kept(problem.seen.size(), 0);
  for (Corner& corner : problem.corners) {
    const bool used =
        LengthPx(corner.observation, scene_from_board * problem.board.Corner(corner.id)) < limit;
    changed = changed || used != corner.used;
    corner.used = used;
    ++all[corner.view];
    kept[corner.view] += used;
  }
  for (size_t v = 0; v < problem.seen.size(); ++v) {
    const bool used = kept[v] >= kMinCorners &&
                      static_cast<double>(kept[v]) >= kMinAgreeing * static_cast<double>(all[v]);
    changed = changed || used != problem.view_used[v];
    problem.view_used[v] = used;
  }
  return changed;
}

size_t UsedViews(const Problem& problem) {
  return static_cast<size_t>(std::count(problem.view_used.begin(), problem.view_used.end(), true));
}

void RequireAgreement(const Problem& problem) {
  const size_t agreeing = UsedViews(problem), all = problem.seen.size();
  if (agreeing >= kMinViews && 2 * agreeing >= all) return;
  RejectScale(
      fmt::format("expected views that agree where the board lies, found that {} of {} do; it must "
                  "stay where it is while the photos are taken",
                  agreeing, all));
}

// What leaving out one view after the other does to the logarithm of the scale, as a standard
// deviation.
double Jackknife(const Problem& problem, const Similarity& scene_from_board) {
  std::vector<double> logs;
  for (size_t v = 0; v < problem.seen.size(); ++v) {
    if (!problem.view_used[v]) continue;
    Problem part = problem;
    part.view_used[v] = false;
    Matrix7 normal;
    logs.push_back(std::log(Minimised(part, scene_from_board, {}, &normal).scale));
  }
  const auto count = static_cast<double>(logs.size());
  double mean = 0, squares = 0;
  for (const double value : logs) mean += value / count;
  for (const double value : logs) squares += std::pow(value - mean, 2);
  return std::sqrt(squares * (count - 1) / count);
}

void Describe(const Problem& problem, const Matrix7& normal, BoardScale& scale) {
  for (size_t v = 0; v < problem.seen.size(); ++v) {
    if (problem.view_used[v]) {
      scale.views.push_back(problem.seen[v].name);
    } else {
      scale.left_out.push_back(
          {problem.seen[v].name, "the board is not where the other views see it"});
    }
  }
  for (const Corner& corner : problem.corners) {
    if (!problem.view_used[corner.view]) continue;
    ++(corner.used ? scale.corners : scale.outliers);
  }
  double squares = 0;
  for (const double length : UsedLengths(problem, scale.scene_from_board)) {
    squares += length * length;
  }
  scale.rms_px = std::sqrt(squares / scale.corners);
  const double sigma_px = std::sqrt(squares / (2.0 * scale.corners - 7));
  const Matrix7 covariance = VarianceOf(sigma_px) * normal.inverse();
  scale.relative_sigma =
      std::max(RootOfVariance(covariance(0, 0)), Jackknife(problem, scale.scene_from_board));
  if (!(scale.relative_sigma <= kMaxRelativeSigma)) {
    RejectScale(fmt::format(
        "expected a scale known to 10 %, found one to {:.0f} %; show the board larger, and from "
        "more sides",
        100 * scale.relative_sigma));
  }
}

}  // namespace

BoardScale ScaleFromBoard(const Board& board, std::span<const BoardObservation> observations) {
  if (observations.size() < kMinViews) {
    RejectScale(fmt::format("expected the board in {} views or more, found it in {}", kMinViews,
                            observations.size()));
  }
  Similarity at = Start(board, observations);
  Problem problem{board, observations, {}, std::vector<bool>(observations.size(), true), {}};
  for (size_t v = 0; v < observations.size(); ++v) {
    double cost = 0;
    problem.seen.push_back(Fitting(board, observations[v], at, &cost));
    for (const BoardCorner& corner : problem.seen.back().corners) {
      problem.corners.push_back(CornerOf(observations[v], v, corner));
    }
  }
  Matrix7 normal;
  double scale_px = kStartScalePx;
  for (int pass = 0; pass < kMaxRobustPasses; ++pass) {
    at = Minimised(problem, at, scale_px, &normal);
    const double next = kCauchySigmas * SigmaOf(problem, at);
    if (std::abs(next - scale_px) < kSameScale * scale_px) break;
    scale_px = next;
  }
  DropOutliers(at, problem);
  for (int pass = 0; pass < kMaxOutlierPasses; ++pass) {
    RequireAgreement(problem);
    at = Minimised(problem, at, {}, &normal);
    if (!DropOutliers(at, problem)) break;
  }
  RequireAgreement(problem);
  BoardScale scale;
  scale.scene_from_board = at;
  Describe(problem, normal, scale);
  return scale;
}

}  // namespace dtr::calib
