#include "calib/validation/board_solves.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"

namespace dtr::calib {
namespace {

constexpr size_t kFolds = 5;

std::vector<RigCameraInput> InputsOf(const ValidatedCalibration& calibration) {
  std::vector<RigCameraInput> inputs;
  for (const RigCamera& c : calibration.cameras) {
    inputs.push_back({c.name, c.model, c.camera.width_px, c.camera.height_px, {}});
    if (!calibration.free_lenses) inputs.back().given = c.camera;
  }
  return inputs;
}

}  // namespace

Fresh SolveFresh(const ValidatedCalibration& calibration, std::vector<RigView> views, size_t frames,
                 Loss loss) {
  RigOptions options;
  options.solve.loss = loss;
  options.solve.cover_image = false;
  options.free_lenses = calibration.free_lenses;
  Fresh fresh;
  try {
    fresh.solution =
        SolveRig(calibration.board, InputsOf(calibration), std::move(views), frames, options);
  } catch (const Error& error) {
    fresh.refused = error.what();
  }
  return fresh;
}

std::vector<RigView> FramesWhere(const std::vector<RigView>& views,
                                 const std::function<bool(size_t)>& wanted) {
  std::vector<RigView> some;
  std::copy_if(views.begin(), views.end(), std::back_inserter(some),
               [&](const RigView& view) { return wanted(view.frame); });
  return some;
}

std::map<size_t, size_t> OrderOfFrames(const std::vector<RigView>& views) {
  std::map<size_t, size_t> order;
  for (const RigView& view : views) order.emplace(view.frame, 0);
  size_t next = 0;
  for (auto& [frame, place] : order) place = next++;
  return order;
}

BoardResiduals HeldOut(const ValidatedCalibration& calibration, std::string* refused) {
  const auto order = OrderOfFrames(calibration.kept);
  const size_t folds = std::min(kFolds, order.size());
  std::vector<BoardResiduals> by_fold(folds);
  std::vector<std::string> why(folds);
  ParallelFor(0, static_cast<int>(folds), [&](int k) {
    const auto fold = static_cast<size_t>(k);
    const auto held = [&](size_t frame) { return order.at(frame) % folds == fold; };
    const Fresh fresh =
        SolveFresh(calibration, FramesWhere(calibration.kept, [&](size_t f) { return !held(f); }),
                   calibration.kept_frames, Loss::kQuadratic);
    if (!fresh.solution) {
      why[fold] = fresh.refused;
      return;
    }
    SolveOptions quadratic;
    quadratic.loss = Loss::kQuadratic;
    std::vector<LeftOut> left_out;
    AddResiduals(calibration.board,
                 FitFrames(calibration.board, fresh.solution->rig.cameras,
                           FramesWhere(calibration.kept, held), calibration.kept_frames, quadratic,
                           left_out),
                 by_fold[fold]);
  });
  BoardResiduals all;
  all.by_camera.resize(calibration.cameras.size());
  for (size_t fold = 0; fold < folds; ++fold) {
    if (!why[fold].empty()) {
      *refused = "without a part of the views: " + why[fold];
      continue;
    }
    for (size_t c = 0; c < by_fold[fold].by_camera.size(); ++c) {
      const auto& own = by_fold[fold].by_camera[c];
      all.by_camera[c].insert(all.by_camera[c].end(), own.begin(), own.end());
    }
    all.squares += by_fold[fold].squares;
    all.corners += by_fold[fold].corners;
  }
  return all;
}

double Distance(const Eigen::VectorXd& difference, const Eigen::MatrixXd& covariance, int at,
                int count) {
  const Eigen::VectorXd d = difference.segment(at, count);
  // Unknowns differ by many orders of magnitude: in units of their own sigmas they do not.
  const Eigen::VectorXd scale = covariance.diagonal().segment(at, count).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd correlation =
      scale.asDiagonal() * covariance.block(at, at, count, count) * scale.asDiagonal();
  const Eigen::VectorXd z = scale.cwiseProduct(d);
  const double squared = z.dot(correlation.ldlt().solve(z));
  // Beyond what a covariance can say: no distance passes for none.
  return squared >= 0 ? std::sqrt(squared) : std::numeric_limits<double>::infinity();
}

std::string LargestPart(const RigLayout& layout, const Eigen::VectorXd& difference,
                        const Eigen::MatrixXd& covariance, int at, int count) {
  int worst = at;
  double most = -1;
  for (int i = at; i < at + count; ++i) {
    const double sigmas = std::abs(difference[i]) / std::sqrt(covariance(i, i));
    if (sigmas > most) {
      most = sigmas;
      worst = i;
    }
  }
  return fmt::format("{} differs by {:.4g} = {:.1f} sigma", layout.NameOf(worst), difference[worst],
                     most);
}

}  // namespace dtr::calib
