#include "calib/solve/reprojection.h"

#include <ceres/normal_prior.h>
#include <ceres/rotation.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <type_traits>
#include <vector>

#include "calib/models/lens_formula.h"

namespace dtr::calib {
namespace {

// Standard deviation of what a radial coefficient does to the corner of the image, of its distance
// from the principal point: published calibrations of webcams and wide angles reach 0.5.
constexpr double kExpectedDisplacement = 0.3;

// A point (turned by pose.rotation already) after a motion.
template <typename T, typename P>
void Move(const PoseCoordinates& pose, const P turned[3], const T* motion, T moved[3]) {
  const T point[3] = {T(turned[0]), T(turned[1]), T(turned[2])};
  ceres::AngleAxisRotatePoint(motion, point, moved);
  for (int i = 0; i < 3; ++i) moved[i] += pose.translation[i] + pose.scale * motion[3 + i];
}

template <typename T>
void Turn(const Eigen::Matrix3d& rotation, const T point[3], T turned[3]) {
  for (int i = 0; i < 3; ++i) {
    turned[i] = rotation(i, 0) * point[0] + rotation(i, 1) * point[1] + rotation(i, 2) * point[2];
  }
}

template <typename T>
bool Residual(const LensFormula<T>& lens, const T p_in_cam[3], const Eigen::Vector2d& observed_px,
              T* residual) {
  if (!lens.Project(p_in_cam, residual)) return false;
  residual[0] -= observed_px[0];
  residual[1] -= observed_px[1];
  return true;
}

template <int kFree, typename T>
LensFormula<T> LensAt(const LensCoordinates& lens, const T* theta) {
  T params[kMaxLensParameters];
  for (size_t i = 0; i < kMaxLensParameters; ++i) {
    params[i] = i < kFree ? lens.centre[i] + lens.scale[i] * theta[i] : T(0);
  }
  return FormulaOf(CameraModelOf(lens.model), params);
}

template <int kFree>
struct Reprojection {
  const LensCoordinates& lens;
  const PoseCoordinates& pose;
  Eigen::Vector3d corner;
  Eigen::Vector2d observed_px;

  template <typename T>
  bool operator()(const T* theta, const T* motion, T* residual) const {
    T p_in_cam[3];
    Move(pose, corner.data(), motion, p_in_cam);
    return Residual(LensAt<kFree>(lens, theta), p_in_cam, observed_px, residual);
  }
};

template <int kFree>
struct RigReprojection {
  const LensCoordinates& lens;
  const PoseCoordinates &cam_from_rig, &rig_from_board;
  Eigen::Vector3d corner;
  Eigen::Vector2d observed_px;

  template <typename T>
  bool operator()(const T* theta, const T* place, const T* motion, T* residual) const {
    T p_in_rig[3], turned[3], p_in_cam[3];
    Move(rig_from_board, corner.data(), motion, p_in_rig);
    Turn(cam_from_rig.rotation, p_in_rig, turned);
    Move(cam_from_rig, turned, place, p_in_cam);
    return Residual(LensAt<kFree>(lens, theta), p_in_cam, observed_px, residual);
  }
};

struct PoseReprojection {
  const LensCamera& camera;
  const PoseCoordinates& pose;
  Eigen::Vector3d corner;
  Eigen::Vector2d observed_px;
  Eigen::Matrix3d cam_from_rig;
  Eigen::Vector3d rig_in_cam;

  template <typename T>
  bool operator()(const T* motion, T* residual) const {
    const std::vector<T> params(camera.params.begin(), camera.params.end());
    T p_in_rig[3], p_in_cam[3];
    Move(pose, corner.data(), motion, p_in_rig);
    Turn(cam_from_rig, p_in_rig, p_in_cam);
    for (int i = 0; i < 3; ++i) p_in_cam[i] += rig_in_cam[i];
    return Residual(FormulaOf(camera.model, params.data()), p_in_cam, observed_px, residual);
  }
};

// Calls `make` with the model's number of parameters as a type.
template <typename Make>
std::unique_ptr<ceres::CostFunction> WithParameterCount(BoardModel model, const Make& make) {
  switch (FreeParameterCount(model)) {
    case 4:
      return make(std::integral_constant<int, 4>{});
    case 8:
      return make(std::integral_constant<int, 8>{});
    case 9:
      return make(std::integral_constant<int, 9>{});
    case 12:
      return make(std::integral_constant<int, 12>{});
  }
  throw std::logic_error("ReprojectionCost: no model has this number of parameters");
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

double BorderRadius(const LensCamera& camera) {
  return 0.5 * std::hypot(camera.width_px, camera.height_px) / camera.params[0];
}

std::vector<int> RadialTerms(BoardModel model) {
  if (model == BoardModel::kBrown4) return {4, 5};
  if (model == BoardModel::kBrown5) return {4, 5, 8};
  if (model == BoardModel::kFisheye) return {4, 5, 6, 7};
  return {};
}

std::unique_ptr<ceres::CostFunction> RadialPrior(const LensCoordinates& lens, double border_radius,
                                                 double sigma_px) {
  const std::vector<int> radial = RadialTerms(lens.model);
  if (radial.empty()) return nullptr;
  Eigen::MatrixXd by_theta =
      Eigen::MatrixXd::Zero(static_cast<long>(radial.size()), FreeParameterCount(lens.model));
  Eigen::VectorXd centre = Eigen::VectorXd::Zero(FreeParameterCount(lens.model));
  double power = 1;
  for (long row = 0; row < by_theta.rows(); ++row) {
    const long at = radial[static_cast<size_t>(row)];
    const double scale = lens.scale[static_cast<size_t>(at)];
    power *= border_radius * border_radius;
    by_theta(row, at) = sigma_px / kExpectedDisplacement * power * scale;
    centre[at] = -lens.centre[static_cast<size_t>(at)] / scale;
  }
  return std::make_unique<ceres::NormalPrior>(by_theta, centre);
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
  return WithParameterCount(lens.model, [&](auto count) {
    using Functor = Reprojection<count()>;
    return std::make_unique<ceres::AutoDiffCostFunction<Functor, 2, count(), 6>>(
        new Functor{lens, pose, pose.rotation * corner, observed_px});
  });
}

std::unique_ptr<ceres::CostFunction> PoseCost(const LensCamera& camera, const PoseCoordinates& pose,
                                              const Eigen::Vector3d& corner,
                                              const Eigen::Vector2d& observed_px,
                                              const Pose& cam_from_rig) {
  return std::make_unique<ceres::AutoDiffCostFunction<PoseReprojection, 2, 6>>(
      new PoseReprojection{camera, pose, pose.rotation * corner, observed_px,
                           cam_from_rig.rotation.toRotationMatrix(), cam_from_rig.translation});
}

std::unique_ptr<ceres::CostFunction> RigCost(const LensCoordinates& lens,
                                             const PoseCoordinates& cam_from_rig,
                                             const PoseCoordinates& rig_from_board,
                                             const Eigen::Vector3d& corner,
                                             const Eigen::Vector2d& observed_px) {
  return WithParameterCount(lens.model, [&](auto count) {
    using Functor = RigReprojection<count()>;
    return std::make_unique<ceres::AutoDiffCostFunction<Functor, 2, count(), 6, 6>>(new Functor{
        lens, cam_from_rig, rig_from_board, rig_from_board.rotation * corner, observed_px});
  });
}

}  // namespace dtr::calib
