#include "calib/solve/rig_minimise.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "calib/models/lens_formula.h"
#include "calib/solve/board_start.h"
#include "calib/solve/limits.h"
#include "calib/solve/reprojection.h"
#include "dtr/base/error.h"

namespace dtr::calib {
namespace {

const Eigen::Vector3d kRigOrigin = Eigen::Vector3d::Zero();

// Largest |q| that each camera sees a corner at.
std::vector<double> LargestRadii(const Board& board, const Rig& rig, const Used& used) {
  std::vector<double> radii(rig.cameras.size(), 1e-3);
  for (size_t v = 0; v < rig.views.size(); ++v) {
    const RigView& view = rig.views[v];
    const RigCamera& camera = rig.cameras[view.camera];
    const auto lens = FormulaOf(camera.camera.model, camera.camera.params.data());
    const Pose cam_from_board = camera.cam_from_rig * rig.rig_from_board[view.frame];
    for (size_t j = 0; j < view.seen.corners.size(); ++j) {
      const Eigen::Vector3d p = cam_from_board * board.Corner(view.seen.corners[j].id);
      Eigen::Vector2d q;
      if (used[v][j] && lens.Plane(p.data(), q.data())) {
        radii[view.camera] = std::max(radii[view.camera], q.norm());
      }
    }
  }
  return radii;
}

// Unknowns of the joint problem in the solver's coordinates.
struct Unknowns {
  std::vector<LensCoordinates> lenses;
  std::vector<PoseCoordinates> places, frames;
  std::vector<std::array<double, kMaxLensParameters>> thetas;
  std::vector<std::array<double, 6>> place_motions, frame_motions;
};

Unknowns UnknownsOf(const Board& board, const Rig& rig, const Used& used) {
  Unknowns u;
  const auto radii = LargestRadii(board, rig, used);
  std::vector<double> distances{1e-300};
  for (const Pose& pose : rig.rig_from_board) {
    u.frames.push_back(CoordinatesAround(pose, MiddleOf(board)));
    distances.push_back(u.frames.back().scale);
  }
  // Cameras may stand in one point: their shifts are measured by how far the boards are.
  const double distance = *std::max_element(distances.begin(), distances.end());
  for (size_t c = 0; c < rig.cameras.size(); ++c) {
    u.lenses.push_back(CoordinatesAround(rig.cameras[c].model, rig.cameras[c].camera, radii[c]));
    u.places.push_back(CoordinatesAround(rig.cameras[c].cam_from_rig, kRigOrigin));
    u.places.back().scale = distance;
  }
  u.thetas.resize(rig.cameras.size(), {});
  u.place_motions.resize(rig.cameras.size(), {});
  u.frame_motions.resize(rig.rig_from_board.size(), {});
  return u;
}

void TakeOver(const Board& board, const Unknowns& u, Rig& rig) {
  for (size_t c = 0; c < rig.cameras.size(); ++c) {
    RigCamera& camera = rig.cameras[c];
    std::vector<double> params;
    for (int k = 0; k < FreeParameterCount(camera.model); ++k) {
      const auto i = static_cast<size_t>(k);
      params.push_back(u.lenses[c].centre[i] + u.lenses[c].scale[i] * u.thetas[c][i]);
    }
    try {
      camera.camera =
          CameraFrom(camera.model, camera.camera.width_px, camera.camera.height_px, params);
    } catch (const std::invalid_argument&) {
      Reject(fmt::format("camera {}: no camera of the model {} explains the corners", camera.name,
                         calib::NameOf(camera.model)));
    }
    camera.cam_from_rig = PoseAt(u.places[c], u.place_motions[c].data(), kRigOrigin);
  }
  for (size_t f = 0; f < rig.rig_from_board.size(); ++f) {
    rig.rig_from_board[f] = PoseAt(u.frames[f], u.frame_motions[f].data(), MiddleOf(board));
  }
}

}  // namespace

// Sigma per camera; that of all where a camera has no view.
std::vector<double> CameraSigmas(const Rig& rig, const std::vector<std::vector<double>>& lengths,
                                 const Used& used, SigmaRule sigma_of) {
  std::vector<double> sigmas(rig.cameras.size(), sigma_of(lengths, used));
  for (size_t c = 0; c < rig.cameras.size(); ++c) {
    std::vector<std::vector<double>> own;
    Used own_used;
    for (size_t v = 0; v < rig.views.size(); ++v) {
      if (rig.views[v].camera != c) continue;
      own.push_back(lengths[v]);
      own_used.push_back(used[v]);
    }
    if (!own.empty()) sigmas[c] = sigma_of(own, own_used);
  }
  return sigmas;
}

// Least squares over the used corners from where the rig is; Cauchy's loss where a scale is given.
void Minimise(const Board& board, bool free_lenses, std::optional<double> cauchy_px,
              const Used& used, Rig& rig) {
  const Eigen::Vector3d pivot = MiddleOf(board);
  Unknowns u = UnknownsOf(board, rig, used);
  ceres::Problem problem;
  for (size_t v = 0; v < rig.views.size(); ++v) {
    const RigView& view = rig.views[v];
    for (size_t j = 0; j < view.seen.corners.size(); ++j) {
      if (!used[v][j]) continue;
      const BoardCorner& corner = view.seen.corners[j];
      problem.AddResidualBlock(
          RigCost(u.lenses[view.camera], u.places[view.camera], u.frames[view.frame],
                  board.Corner(corner.id) - pivot, corner.pixel)
              .release(),
          cauchy_px ? new ceres::CauchyLoss(*cauchy_px) : nullptr, u.thetas[view.camera].data(),
          u.place_motions[view.camera].data(), u.frame_motions[view.frame].data());
    }
  }
  const auto sigmas = CameraSigmas(rig, ResidualLengths(board, rig), used, SigmaOfUsed);
  for (size_t c = 0; c < rig.cameras.size() && free_lenses; ++c) {
    if (!problem.HasParameterBlock(u.thetas[c].data())) continue;
    if (auto prior = RadialPrior(u.lenses[c], BorderRadius(rig.cameras[c].camera), sigmas[c])) {
      problem.AddResidualBlock(prior.release(), nullptr, u.thetas[c].data());
    }
  }
  ceres::Solver::Options options = SolverOptions();
  options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (auto& motion : u.frame_motions) {
    if (!problem.HasParameterBlock(motion.data())) continue;
    options.linear_solver_ordering->AddElementToGroup(motion.data(), 0);
  }
  for (size_t c = 0; c < rig.cameras.size(); ++c) {
    if (!problem.HasParameterBlock(u.thetas[c].data())) continue;
    // Groups of their own: within one Ceres orders by address, which differs from run to run.
    options.linear_solver_ordering->AddElementToGroup(u.place_motions[c].data(), 1);
    options.linear_solver_ordering->AddElementToGroup(u.thetas[c].data(), 2);
    if (!free_lenses) problem.SetParameterBlockConstant(u.thetas[c].data());
    if (c == 0) problem.SetParameterBlockConstant(u.place_motions[c].data());
  }
  if (!Solve(options, LargestImage(rig), &problem)) {
    Reject("the corners of the rig have no least-squares solution");
  }
  TakeOver(board, u, rig);
}

// Least squares over a frame's used corners by the board's pose alone.
void MinimiseFrame(const Board& board, const std::vector<size_t>& views, const Used& used,
                   std::optional<double> cauchy_px, size_t frame, Rig& rig) {
  const Eigen::Vector3d pivot = MiddleOf(board);
  const PoseCoordinates pose = CoordinatesAround(rig.rig_from_board[frame], pivot);
  std::array<double, 6> motion{};
  ceres::Problem problem;
  for (const size_t v : views) {
    const RigCamera& camera = rig.cameras[rig.views[v].camera];
    for (size_t j = 0; j < used[v].size(); ++j) {
      if (!used[v][j]) continue;
      const BoardCorner& corner = rig.views[v].seen.corners[j];
      problem.AddResidualBlock(PoseCost(camera.camera, pose, board.Corner(corner.id) - pivot,
                                        corner.pixel, camera.cam_from_rig)
                                   .release(),
                               cauchy_px ? new ceres::CauchyLoss(*cauchy_px) : nullptr,
                               motion.data());
    }
  }
  if (problem.NumResidualBlocks() < static_cast<int>(kMinCorners)) return;
  ceres::Solver::Options options = SolverOptions();
  options.linear_solver_type = ceres::DENSE_QR;
  if (Solve(options, LargestImage(rig), &problem)) {
    rig.rig_from_board[frame] = PoseAt(pose, motion.data(), pivot);
  }
}

}  // namespace dtr::calib
