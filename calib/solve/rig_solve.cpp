#include "calib/solve/rig_solve.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "calib/models/lens_formula.h"
#include "calib/precision.h"
#include "calib/solve/board_start.h"
#include "calib/solve/least_squares.h"
#include "calib/solve/limits.h"
#include "calib/solve/reprojection.h"
#include "calib/solve/rig_minimise.h"
#include "calib/solve/rig_start.h"
#include "dtr/base/error.h"

namespace dtr::calib {
namespace {

constexpr double kFitCauchyPx = 1;  // scale for frames alone, before a sigma is known

using ViewLengths = std::vector<std::vector<double>>;

// What counts, as the solver takes it: per view, per corner.
Used UsedOf(const Rig& rig) {
  Used used;
  for (const RigView& view : rig.views) {
    used.emplace_back();
    for (const BoardCorner& corner : view.seen.corners) {
      used.back().push_back(!Holds(view.outliers, corner.id));
    }
  }
  return used;
}

void SetUsed(const Used& used, Rig& rig) {
  for (size_t v = 0; v < rig.views.size(); ++v) {
    rig.views[v].outliers.clear();
    for (size_t j = 0; j < used[v].size(); ++j) {
      if (!used[v][j]) rig.views[v].outliers.push_back(rig.views[v].seen.corners[j].id);
    }
  }
}

std::vector<double> LengthsOf(const Board& board, const Rig& rig, const RigView& view) {
  const RigCamera& camera = rig.cameras[view.camera];
  return ResidualLengths(board, view.seen, camera.camera,
                         camera.cam_from_rig * rig.rig_from_board[view.frame]);
}

// Cauchy's cost of some views; corners without a pixel cost as much as far ones.
double RobustCost(const Board& board, const Rig& rig, const std::vector<size_t>& views,
                  double scale_px) {
  constexpr double kWithoutPixel = 100;
  double sum = 0;
  for (const size_t v : views) {
    const RigView& view = rig.views[v];
    const auto lengths = LengthsOf(board, rig, view);
    for (size_t j = 0; j < lengths.size(); ++j) {
      if (Holds(view.outliers, view.seen.corners[j].id)) continue;
      const double r = lengths[j] / scale_px;
      sum += std::isfinite(r) ? std::log1p(r * r) : kWithoutPixel;
    }
  }
  return sum;
}

std::vector<std::vector<size_t>> ViewsByFrame(const Rig& rig) {
  std::vector<std::vector<size_t>> views(rig.rig_from_board.size());
  for (size_t v = 0; v < rig.views.size(); ++v) views[rig.views[v].frame].push_back(v);
  return views;
}

// One view of a frame may be wrong, and a plane has two poses that look alike: of the poses that
// each view by itself gives the board, the one that fits all views of the frame is taken.
void ChooseFramePoses(const Board& board, double scale_px, Rig& rig) {
  const auto by_frame = ViewsByFrame(rig);
  for (size_t f = 0; f < by_frame.size(); ++f) {
    if (by_frame[f].empty()) continue;
    Pose best = rig.rig_from_board[f];
    double least = RobustCost(board, rig, by_frame[f], scale_px);
    for (const size_t v : by_frame[f]) {
      const RigCamera& camera = rig.cameras[rig.views[v].camera];
      const auto own = PoseOfBoard(board, rig.views[v].seen, camera.camera);
      if (!own) continue;
      rig.rig_from_board[f] = camera.cam_from_rig.Inverse() * *own;
      const double cost = RobustCost(board, rig, by_frame[f], scale_px);
      if (cost < least) {
        least = cost;
        best = rig.rig_from_board[f];
      }
    }
    rig.rig_from_board[f] = best;
  }
}

void TakeOutDisagreeing(Rig& rig, std::vector<LeftOut>& left_out) {
  std::erase_if(rig.views, [&](const RigView& view) {
    const size_t all = view.seen.corners.size(), agreeing = all - view.outliers.size();
    if (agreeing >= kMinCorners &&
        static_cast<double>(agreeing) >= kMinAgreeing * static_cast<double>(all)) {
      return false;
    }
    left_out.push_back(
        {view.seen.name,
         fmt::format("only {} of {} corners lie where a flat board can have them", agreeing, all)});
    return true;
  });
}

Used Drawable(const ViewLengths& lengths) {
  return Within(lengths, std::numeric_limits<double>::infinity());
}

// Names as outliers what is farther off than its camera's sigmas allow. False when nothing changed.
bool NameOutliers(const Board& board, double outlier_sigmas, SigmaRule sigma_of, Rig& rig) {
  const ViewLengths lengths = ResidualLengths(board, rig);
  const Used before = UsedOf(rig);
  const auto sigmas = CameraSigmas(rig, lengths, before, sigma_of);
  Used used = before;
  for (size_t v = 0; v < lengths.size(); ++v) {
    for (size_t j = 0; j < lengths[v].size(); ++j) {
      used[v][j] = lengths[v][j] < OutlierLimitPx(outlier_sigmas, sigmas[rig.views[v].camera]);
    }
  }
  SetUsed(used, rig);
  return used != before;
}

constexpr int kPasses = kMaxRobustPasses + kMaxOutlierPasses;

void BeginPass(const RigOptions& options, int pass) {
  if (options.solve.progress == nullptr) return;
  options.solve.progress->ThrowIfInterrupted();
  options.solve.progress->Update(pass);
}

void SolveRobustly(const Board& board, const RigOptions& options, Rig& rig,
                   std::vector<LeftOut>& left_out) {
  double scale = kCauchySigmas * SigmaOfUsed(ResidualLengths(board, rig), UsedOf(rig));
  ChooseFramePoses(board, scale, rig);
  for (int pass = 0; pass < kMaxRobustPasses; ++pass) {
    BeginPass(options, pass);
    Minimise(board, options.free_lenses, scale, Drawable(ResidualLengths(board, rig)), rig);
    ChooseFramePoses(board, scale, rig);
    const double next = kCauchySigmas * SigmaOfUsed(ResidualLengths(board, rig), UsedOf(rig));
    const bool settled = std::abs(next - scale) < kSameScale * scale;
    scale = next;
    if (settled) break;
  }
  NameOutliers(board, options.solve.outlier_sigmas, SigmaOfUsed, rig);
  TakeOutDisagreeing(rig, left_out);
  for (int pass = 0; pass < kMaxOutlierPasses; ++pass) {
    BeginPass(options, kMaxRobustPasses + pass);
    Minimise(board, options.free_lenses, {}, UsedOf(rig), rig);
    if (!NameOutliers(board, options.solve.outlier_sigmas, ScatterOfUsed, rig)) break;
    TakeOutDisagreeing(rig, left_out);
  }
}

void SolveQuadratically(const Board& board, const RigOptions& options, Rig& rig) {
  ChooseFramePoses(board, kCauchySigmas * SigmaOfUsed(ResidualLengths(board, rig), UsedOf(rig)),
                   rig);
  Minimise(board, options.free_lenses, {}, Drawable(ResidualLengths(board, rig)), rig);
  // Corners that the start could not draw count now.
  if (Drawable(ResidualLengths(board, rig)) != UsedOf(rig)) {
    Reject(
        "with a quadratic loss every corner counts, and some have no position in the image; leave "
        "the loss robust");
  }
  // Until the residuals, which say what the prior of the lenses weighs, do not shrink any more.
  double sigma = SigmaOfUsed(ResidualLengths(board, rig), UsedOf(rig));
  for (int pass = 0; pass < kMaxRobustPasses; ++pass) {
    BeginPass(options, pass);
    Minimise(board, options.free_lenses, {}, UsedOf(rig), rig);
    const double next = SigmaOfUsed(ResidualLengths(board, rig), UsedOf(rig));
    const bool settled = std::abs(next - sigma) < kSameScale * sigma;
    sigma = next;
    if (settled) break;
  }
}

void Describe(const Board& board, RigSolution& solution) {
  solution.layout = RigLayout(solution.rig.cameras, solution.layout.free_lenses());
  solution.rows = RowsOf(board, solution.rig, solution.layout);
  solution.information = InformationOf(solution.rows, solution.layout);
  const size_t cameras = solution.rig.cameras.size();
  std::vector<double> squares(cameras, 0), corners(cameras, 0);
  double sum = 0;
  for (const FrameRows& frame : solution.rows) {
    for (size_t i = 0; i < frame.origins.size(); ++i) {
      const size_t camera = solution.rig.views[frame.origins[i].view].camera;
      const double square = frame.residuals.segment<2>(2 * static_cast<long>(i)).squaredNorm();
      squares[camera] += square;
      corners[camera] += 1;
      sum += square;
      ++solution.corners;
    }
  }
  for (const RigView& view : solution.rig.views) {
    solution.outliers += static_cast<int>(view.outliers.size());
  }
  for (size_t c = 0; c < cameras; ++c) {
    solution.camera_rms_px.push_back(std::sqrt(squares[c] / std::max(1.0, corners[c])));
  }
  solution.freedom = 2.0 * solution.corners - solution.layout.size() -
                     6.0 * static_cast<double>(solution.rows.size());
  if (!(solution.freedom > 0)) {
    Reject(
        fmt::format("expected more numbers than unknowns, found {} corners in {} frames; take "
                    "more views",
                    solution.corners, solution.rows.size()));
  }
  solution.rms_px = std::sqrt(sum / solution.corners);
  solution.sigma_px = std::sqrt(sum / solution.freedom);
  solution.covariance = VarianceOf(solution.sigma_px) * solution.information.lens_covariance();
}

std::vector<BoardView> ViewsOf(const std::vector<RigView>& views, size_t camera,
                               std::vector<size_t>& where) {
  std::vector<BoardView> own;
  for (size_t v = 0; v < views.size(); ++v) {
    if (views[v].camera != camera) continue;
    own.push_back(views[v].seen);
    where.push_back(v);
  }
  return own;
}

// A camera and the boards' poses from its own views alone.
RigCamera StartCamera(const Board& board, const RigCameraInput& input,
                      std::span<const BoardView> own, const SolveOptions& options,
                      std::vector<std::optional<Pose>>& poses) {
  RigCamera camera{input.name, input.model, {}, {}};
  poses.assign(own.size(), std::nullopt);
  if (input.given) {
    camera.camera = *input.given;
    for (size_t i = 0; i < own.size(); ++i) poses[i] = PoseOfBoard(board, own[i], camera.camera);
    return camera;
  }
  try {
    const BoardSolution solution =
        SolveBoard(board, own, input.width_px, input.height_px, input.model, options);
    camera.camera = solution.camera;
    size_t next = 0;  // solved views keep the order; those left out are missing
    for (size_t i = 0; i < own.size() && next < solution.views.size(); ++i) {
      if (own[i].name == solution.views[next].name) {
        poses[i] = solution.views[next++].cam_from_board;
      }
    }
  } catch (const Error& error) {
    if (input.name.empty()) throw;
    throw Error(fmt::format("camera {}: {}", input.name, error.what()));
  }
  return camera;
}

}  // namespace

std::vector<std::vector<double>> ResidualLengths(const Board& board, const Rig& rig) {
  ViewLengths lengths;
  for (const RigView& view : rig.views) lengths.push_back(LengthsOf(board, rig, view));
  return lengths;
}

RigSolution SolveRig(const Board& board, std::span<const RigCameraInput> cameras,
                     std::vector<RigView> views, size_t frames, const RigOptions& options) {
  RigSolution solution;
  DropOutliers(views);
  std::vector<RigCamera> started;
  std::vector<PosedView> posed;
  for (size_t c = 0; c < cameras.size(); ++c) {
    std::vector<size_t> where;
    const auto own = ViewsOf(views, c, where);
    std::vector<std::optional<Pose>> poses;
    started.push_back(StartCamera(board, cameras[c], own, options.solve, poses));
    for (size_t i = 0; i < where.size(); ++i) {
      if (poses[i]) {
        posed.push_back({views[where[i]], *poses[i]});
      } else {
        solution.left_out.push_back({own[i].name, "no pose of a flat board explains its corners"});
      }
    }
  }
  RigStart start = StartRig(board, std::move(started), std::move(posed), frames);
  solution.rig = std::move(start.rig);
  solution.flipped = std::move(start.flipped);
  if (solution.rig.views.empty()) Reject("no view of the board can be used");
  solution.layout = RigLayout(solution.rig.cameras, options.free_lenses);
  if (solution.layout.size() == 0) {
    Reject("expected something to solve for, found one camera whose intrinsics are given");
  }
  if (options.solve.progress != nullptr) {
    options.solve.progress->Stage("solving for all cameras together", kPasses);
  }
  if (options.solve.loss == Loss::kRobust) {
    SolveRobustly(board, options, solution.rig, solution.left_out);
  } else {
    SolveQuadratically(board, options, solution.rig);
  }
  Describe(board, solution);
  if (options.solve.cover_image && options.free_lenses) RequireCoveredImages(solution.rig);
  return solution;
}

void RequireCoveredImages(const Rig& rig) {
  for (size_t c = 0; c < rig.cameras.size(); ++c) {
    const RigCamera& camera = rig.cameras[c];
    if (CoversImage(camera.camera)) continue;
    const std::string who = camera.name.empty() ? "" : fmt::format("camera {}: ", camera.name);
    throw LensTurnsBack(c, "calibration: " + who + TurnsBack(camera.model));
  }
}

Rig FitFrames(const Board& board, std::vector<RigCamera> cameras, std::vector<RigView> views,
              size_t frames, const SolveOptions& options, std::vector<LeftOut>& left_out,
              std::vector<std::string>* flipped) {
  Rig rig;
  rig.cameras = std::move(cameras);
  std::vector<PosedView> posed;
  for (RigView& view : views) {
    const RigCamera& camera = rig.cameras[view.camera];
    const auto pose = PoseOfBoard(board, view.seen, camera.camera);
    if (!pose) {
      left_out.push_back({view.seen.name, "no pose of a flat board explains its corners"});
      continue;
    }
    posed.push_back({std::move(view), *pose});
  }
  Counted counted = CountFromOneEnd(board, rig.cameras, std::move(posed), frames);
  rig.views = std::move(counted.views);
  rig.rig_from_board = std::move(counted.rig_from_board);
  if (flipped != nullptr) *flipped = std::move(counted.flipped);
  if (rig.views.empty()) return rig;
  ChooseFramePoses(board, kFitCauchyPx, rig);
  const auto by_frame = ViewsByFrame(rig);
  const auto minimise = [&](std::optional<double> cauchy_px) {
    Used used = UsedOf(rig);
    const Used drawable = Drawable(ResidualLengths(board, rig));
    for (size_t v = 0; v < used.size(); ++v) {
      for (size_t j = 0; j < used[v].size(); ++j) used[v][j] = used[v][j] && drawable[v][j];
    }
    for (size_t f = 0; f < by_frame.size(); ++f) {
      MinimiseFrame(board, by_frame[f], used, cauchy_px, f, rig);
    }
  };
  if (options.loss == Loss::kRobust) {
    minimise(kCauchySigmas * SigmaOfUsed(ResidualLengths(board, rig), UsedOf(rig)));
    NameOutliers(board, options.outlier_sigmas, SigmaOfUsed, rig);
  }
  minimise({});
  return rig;
}

}  // namespace dtr::calib
