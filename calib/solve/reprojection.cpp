#include "calib/solve/reprojection.h"

#include <ceres/rotation.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "calib/models/lens_formula.h"

namespace dtr::calib {
namespace {

// Residual of a corner (turned by pose.rotation already) after a motion, seen through the lens.
template <typename T>
bool Residual(const LensFormula<T>& lens, const PoseCoordinates& pose,
              const Eigen::Vector3d& corner, const Eigen::Vector2d& observed_px, const T* motion,
              T* residual) {
  const T turned[3] = {T(corner[0]), T(corner[1]), T(corner[2])};
  T p_in_cam[3];
  ceres::AngleAxisRotatePoint(motion, turned, p_in_cam);
  for (int i = 0; i < 3; ++i) p_in_cam[i] += pose.translation[i] + pose.scale * motion[3 + i];
  if (!lens.Project(p_in_cam, residual)) return false;
  residual[0] -= observed_px[0];
  residual[1] -= observed_px[1];
  return true;
}

template <int kFree>
struct Reprojection {
  const LensCoordinates& lens;
  const PoseCoordinates& pose;
  Eigen::Vector3d corner;
  Eigen::Vector2d observed_px;

  template <typename T>
  bool operator()(const T* theta, const T* motion, T* residual) const {
    T params[kMostLensParameters];
    for (size_t i = 0; i < kMostLensParameters; ++i) {
      params[i] = i < kFree ? lens.centre[i] + lens.scale[i] * theta[i] : T(0);
    }
    return Residual(FormulaOf(LensModelOf(lens.model), params), pose, corner, observed_px, motion,
                    residual);
  }
};

struct PoseReprojection {
  const LensCamera& camera;
  const PoseCoordinates& pose;
  Eigen::Vector3d corner;
  Eigen::Vector2d observed_px;

  template <typename T>
  bool operator()(const T* motion, T* residual) const {
    const std::vector<T> params(camera.params.begin(), camera.params.end());
    return Residual(FormulaOf(camera.model, params.data()), pose, corner, observed_px, motion,
                    residual);
  }
};

template <int kFree>
std::unique_ptr<ceres::CostFunction> Cost(const LensCoordinates& lens, const PoseCoordinates& pose,
                                          const Eigen::Vector3d& corner,
                                          const Eigen::Vector2d& observed_px) {
  using Functor = Reprojection<kFree>;
  return std::make_unique<ceres::AutoDiffCostFunction<Functor, 2, kFree, 6>>(
      new Functor{lens, pose, pose.rotation * corner, observed_px});
}

}  // namespace

LensCoordinates CoordinatesAround(BoardModel model, const LensCamera& camera,
                                  double largest_radius) {
  LensCoordinates lens{model, {}, {}};
  const size_t count = static_cast<size_t>(FreeParameterCount(model));
  std::copy_n(camera.params.begin(), std::min(count, camera.params.size()), lens.centre.begin());
  const double r = largest_radius, s = r * r;
  const double edge_px = camera.params[0] * r;  // from the principal point
  // theta = 1 moves a pixel at the edge by edge_px: df r, dc, f r dk s^i, and about f dp r^2.
  lens.scale = {edge_px / r, edge_px / r, edge_px, edge_px, 1 / s, 1 / (s * s)};
  if (model == BoardModel::kFisheye) {
    lens.scale[6] = 1 / (s * s * s);
    lens.scale[7] = 1 / (s * s * s * s);
  } else {
    lens.scale[6] = lens.scale[7] = 1 / r;
    lens.scale[8] = 1 / (s * s * s);
    for (size_t i = 0; i < 3; ++i) lens.scale[9 + i] = 1 / std::pow(s, static_cast<double>(i + 1));
  }
  return lens;
}

PoseCoordinates CoordinatesAround(const Pose& cam_from_board, const Eigen::Vector3d& pivot) {
  PoseCoordinates pose;
  pose.rotation = cam_from_board.rotation.toRotationMatrix();
  pose.translation = cam_from_board * pivot;
  pose.scale = pose.translation.norm();
  return pose;
}

Pose PoseAt(const PoseCoordinates& coordinates, const double motion[6],
            const Eigen::Vector3d& pivot) {
  double quaternion[4];  // wxyz
  ceres::AngleAxisToQuaternion(motion, quaternion);
  const Eigen::Quaterniond turn(quaternion[0], quaternion[1], quaternion[2], quaternion[3]);
  Pose cam_from_board;
  cam_from_board.rotation = (turn * Eigen::Quaterniond(coordinates.rotation)).normalized();
  cam_from_board.translation = coordinates.translation +
                               coordinates.scale * Eigen::Map<const Eigen::Vector3d>(motion + 3) -
                               cam_from_board.rotation * pivot;
  return cam_from_board;
}

std::unique_ptr<ceres::CostFunction> ReprojectionCost(const LensCoordinates& lens,
                                                      const PoseCoordinates& pose,
                                                      const Eigen::Vector3d& corner,
                                                      const Eigen::Vector2d& observed_px) {
  switch (FreeParameterCount(lens.model)) {
    case 4:
      return Cost<4>(lens, pose, corner, observed_px);
    case 8:
      return Cost<8>(lens, pose, corner, observed_px);
    case 9:
      return Cost<9>(lens, pose, corner, observed_px);
    case 12:
      return Cost<12>(lens, pose, corner, observed_px);
  }
  throw std::logic_error("ReprojectionCost: no model has this number of parameters");
}

std::unique_ptr<ceres::CostFunction> PoseCost(const LensCamera& camera, const PoseCoordinates& pose,
                                              const Eigen::Vector3d& corner,
                                              const Eigen::Vector2d& observed_px) {
  return std::make_unique<ceres::AutoDiffCostFunction<PoseReprojection, 2, 6>>(
      new PoseReprojection{camera, pose, pose.rotation * corner, observed_px});
}

}  // namespace dtr::calib
