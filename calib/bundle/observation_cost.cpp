#include "calib/bundle/observation_cost.h"

#include <ceres/rotation.h>

#include <Eigen/Geometry>
#include <cmath>
#include <stdexcept>

#include "calib/bundle/lens_params.h"
#include "calib/models/lens_formula.h"

namespace dtr::calib {
namespace {

template <int kLens>
struct ObservationFunctor {
  const LensFrame& lens;
  const PoseFrame& pose;
  const PointFrame& point;
  Eigen::Vector2d observed_px;

  template <typename T>
  bool operator()(const T* theta, const T* motion, const T* place, T* residual) const {
    T params[kLens];
    for (int i = 0; i < kLens; ++i) {
      const auto k = static_cast<size_t>(i);
      params[i] = lens.centre[k] + lens.scale[k] * theta[i];
    }
    const T rho = point.rho + place[2];
    const Eigen::Vector3d offset = point.anchor - pose.centre;
    T ray[3], turned[3], p_in_cam[3];
    for (int i = 0; i < 3; ++i) {
      ray[i] = point.direction[i] + place[0] * point.e1[i] + place[1] * point.e2[i] +
               rho * (offset[i] - motion[3 + i]);
    }
    const Eigen::Matrix3d& r = pose.rotation;
    for (int i = 0; i < 3; ++i) {
      turned[i] = r(i, 0) * ray[0] + r(i, 1) * ray[1] + r(i, 2) * ray[2];
    }
    ceres::AngleAxisRotatePoint(motion, turned, p_in_cam);
    if (!FormulaOf(lens.model, params).Project(p_in_cam, residual)) return false;
    residual[0] -= observed_px[0];
    residual[1] -= observed_px[1];
    return true;
  }
};

template <int kLens>
struct ShiftedObservationFunctor {
  ObservationFunctor<kLens> functor;
  double shift_scale_px;

  template <typename T>
  bool operator()(const T* theta, const T* motion, const T* place, const T* shift,
                  T* residual) const {
    if (!functor(theta, motion, place, residual)) return false;
    residual[0] += shift_scale_px * shift[0];
    residual[1] += shift_scale_px * shift[1];
    return true;
  }
};

template <int kLens>
struct RigObservationFunctor {
  ObservationFunctor<kLens> functor;
  const RigMember& member;

  template <typename T>
  bool operator()(const T* theta, const T* rig_motion, const T* place, T* residual) const {
    T motion[6];
    member.Motion(rig_motion, motion);
    return functor(theta, motion, place, residual);
  }
};

template <int kLens>
std::unique_ptr<ceres::CostFunction> Cost(const LensFrame& lens, const PoseFrame& pose,
                                          const PointFrame& point,
                                          const Eigen::Vector2d& observed_px,
                                          const ObservationExtras& extras) {
  using Functor = ObservationFunctor<kLens>;
  if (extras.shift_scale_px > 0) {
    return std::make_unique<
        ceres::AutoDiffCostFunction<ShiftedObservationFunctor<kLens>, 2, kLens, 6, 3, 2>>(
        new ShiftedObservationFunctor<kLens>{{lens, pose, point, observed_px},
                                             extras.shift_scale_px});
  }
  const RigMember* member = extras.member;
  if (member != nullptr) {
    return std::make_unique<
        ceres::AutoDiffCostFunction<RigObservationFunctor<kLens>, 2, kLens, 6, 3>>(
        new RigObservationFunctor<kLens>{{lens, pose, point, observed_px}, *member});
  }
  return std::make_unique<ceres::AutoDiffCostFunction<Functor, 2, kLens, 6, 3>>(
      new Functor{lens, pose, point, observed_px});
}

// What a coefficient multiplies at radius r: tangential and prism terms r^2, radial ones r^(2i+1).
double LeverOf(CameraModel model, size_t coefficient, double r) {
  const bool tangential_third = model == CameraModel::kOpenCv ||
                                model == CameraModel::kFullOpenCv ||
                                model == CameraModel::kThinPrismFisheye;
  if (!tangential_third) return std::pow(r, 2 * static_cast<double>(coefficient) + 3);
  if (coefficient < 2) return std::pow(r, 2 * static_cast<double>(coefficient) + 3);
  if (coefficient < 4) return r * r;
  if (model == CameraModel::kThinPrismFisheye) {
    return coefficient < 6 ? std::pow(r, 2 * static_cast<double>(coefficient - 2) + 3) : r * r;
  }
  return coefficient == 4 ? std::pow(r, 7)
                          : std::pow(r, 2 * static_cast<double>(coefficient - 5) + 3);
}

}  // namespace

LensFrame FrameAround(const LensCamera& lens, double largest_radius) {
  const double r = largest_radius;
  const auto focals = static_cast<size_t>(FocalCount(lens.model));
  LensFrame frame{lens.model, lens.params, std::vector<double>(lens.params.size(), 1)};
  for (size_t i = 0; i < frame.scale.size(); ++i) {
    if (i < focals) {
      frame.scale[i] = lens.params[0];
    } else if (i < focals + 2) {
      frame.scale[i] = lens.params[0] * r;
    } else {
      frame.scale[i] = r / LeverOf(lens.model, i - focals - 2, r);
    }
  }
  return frame;
}

std::vector<double> ParamsAt(const LensFrame& frame, const double* theta) {
  std::vector<double> params(frame.centre.size());
  for (size_t i = 0; i < params.size(); ++i) {
    params[i] = frame.centre[i] + frame.scale[i] * theta[i];
  }
  return params;
}

PointFrame FrameAround(const Eigen::Vector4d& point, const Eigen::Vector3d& anchor) {
  PointFrame frame;
  frame.anchor = anchor;
  const Eigen::Vector3d towards = point.head<3>() - point[3] * anchor;
  const double length = towards.norm();
  frame.direction = length > 0 ? Eigen::Vector3d(towards / length) : Eigen::Vector3d::UnitZ();
  frame.rho = length > 0 ? point[3] / length : 1;
  frame.e1 = frame.direction.unitOrthogonal();
  frame.e2 = frame.direction.cross(frame.e1);
  return frame;
}

std::unique_ptr<ceres::CostFunction> ObservationCost(const LensFrame& lens, const PoseFrame& pose,
                                                     const PointFrame& point,
                                                     const Eigen::Vector2d& observed_px,
                                                     const ObservationExtras& extras) {
  switch (ParameterCount(lens.model)) {
    case 3:
      return Cost<3>(lens, pose, point, observed_px, extras);
    case 4:
      return Cost<4>(lens, pose, point, observed_px, extras);
    case 5:
      return Cost<5>(lens, pose, point, observed_px, extras);
    case 8:
      return Cost<8>(lens, pose, point, observed_px, extras);
    case 12:
      return Cost<12>(lens, pose, point, observed_px, extras);
  }
  throw std::logic_error("ObservationCost: no model has this number of parameters");
}

}  // namespace dtr::calib
