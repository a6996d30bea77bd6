#include "calib/bundle/normalised.h"

#include <ceres/rotation.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/models/lens_formula.h"
#include "dtr/base/order_statistics.h"

namespace dtr::calib {
namespace {

// Centres closer together than this share of the points' distance are one place.
constexpr double kOnePlace = 1e-9;
constexpr double kMinRadius = 1e-3;  // of what a lens sees, on the plane of its formula

// Largest |q| that each lens sees a point at.
std::vector<double> LargestRadii(const Bundle& bundle) {
  std::vector<double> largest(bundle.lenses.size(), kMinRadius);
  for (const BundleObservation& o : bundle.observations) {
    const BundleImage& image = bundle.images[static_cast<size_t>(o.image)];
    const auto lens = static_cast<size_t>(image.lens);
    const Eigen::Vector4d& h = bundle.points[static_cast<size_t>(o.point)];
    const Eigen::Vector3d ray =
        image.cam_from_world.rotation * h.head<3>() + h[3] * image.cam_from_world.translation;
    Eigen::Vector2d q;
    const auto formula = FormulaOf(bundle.lenses[lens].model, bundle.lenses[lens].params.data());
    if (!formula.Plane(ray.data(), q.data())) continue;
    // Beyond a right angle from the axis a perspective lens sees nothing: a broken start.
    largest[lens] = std::max(largest[lens], std::min(q.norm(), 10.0));
  }
  return largest;
}

double MedianDistance(const Bundle& bundle, const Eigen::Vector3d& from) {
  std::vector<double> distances;
  for (const Eigen::Vector4d& h : bundle.points) {
    if (h[3] > 0) distances.push_back((h.head<3>() / h[3] - from).norm());
  }
  if (distances.empty()) return 1;
  const auto middle = UpperMedian(distances);
  return middle > 0 ? middle : 1;
}

}  // namespace

Normalised Normalised::Around(const Bundle& bundle) {
  Normalised n;
  std::vector<Eigen::Vector3d> centres;
  for (const BundleImage& image : bundle.images) {
    centres.push_back(image.cam_from_world.TargetOriginInSource());
    n.origin += centres.back() / static_cast<double>(bundle.images.size());
  }
  double squared = 0;
  for (const Eigen::Vector3d& c : centres) squared += (c - n.origin).squaredNorm();
  const double spread = std::sqrt(squared / static_cast<double>(centres.size()));
  const double distance = MedianDistance(bundle, n.origin);
  n.unit = spread > kOnePlace * distance ? spread : distance;

  const auto radii = LargestRadii(bundle);
  for (size_t i = 0; i < bundle.lenses.size(); ++i) {
    n.lenses.push_back(FrameAround(bundle.lenses[i], radii[i]));
  }
  for (size_t i = 0; i < bundle.images.size(); ++i) {
    n.poses.push_back({bundle.images[i].cam_from_world.rotation.toRotationMatrix(),
                       (centres[i] - n.origin) / n.unit});
  }
  std::vector<int> first(bundle.points.size(), -1);
  for (const BundleObservation& o : bundle.observations) {
    int& image = first[static_cast<size_t>(o.point)];
    if (image < 0) image = o.image;
  }
  for (size_t p = 0; p < bundle.points.size(); ++p) {
    const Eigen::Vector4d& h = bundle.points[p];
    Eigen::Vector4d local;
    local << (h.head<3>() - h[3] * n.origin) / n.unit, h[3];
    const Eigen::Vector3d anchor = first[p] < 0 ? Eigen::Vector3d(Eigen::Vector3d::Zero())
                                                : n.poses[static_cast<size_t>(first[p])].centre;
    n.points.push_back(FrameAround(local, anchor));
  }
  n.theta.assign(n.lenses.size(), {});
  n.motion.assign(n.poses.size(), {});
  n.place.assign(n.points.size(), {});
  return n;
}

void Normalised::FollowRig() {
  for (size_t i = 0; i < members.size(); ++i) members[i].Motion(MotionOf(i), motion[i].data());
}

Eigen::Vector3d Normalised::Centre(size_t image) const {
  return poses[image].centre + Eigen::Map<const Eigen::Vector3d>(motion[image].data() + 3);
}

Eigen::Vector4d Normalised::Place(size_t point) const {
  const PointFrame& f = points[point];
  const auto& x = place[point];
  const double rho = f.rho + x[2];
  Eigen::Vector4d h;
  h << f.direction + x[0] * f.e1 + x[1] * f.e2 + rho * f.anchor, rho;
  return h;
}

Bundle Normalised::LocalAt(const Bundle& bundle) const {
  Bundle out = bundle;
  for (size_t i = 0; i < lenses.size(); ++i) {
    out.lenses[i].params = ParamsAt(lenses[i], theta[i].data());
  }
  for (size_t i = 0; i < poses.size(); ++i) {
    double quaternion[4];  // wxyz
    ceres::AngleAxisToQuaternion(motion[i].data(), quaternion);
    const Eigen::Quaterniond turn(quaternion[0], quaternion[1], quaternion[2], quaternion[3]);
    Pose& pose = out.images[i].cam_from_world;
    pose.rotation = (turn * Eigen::Quaterniond(poses[i].rotation)).normalized();
    pose.translation = -(pose.rotation * Centre(i));
  }
  for (size_t i = 0; i < shift.size(); ++i) {
    out.images[i].shift_px +=
        ShiftScalePx(bundle, i) * Eigen::Map<const Eigen::Vector2d>(shift[i].data());
  }
  for (size_t p = 0; p < points.size(); ++p) out.points[p] = Place(p);
  return out;
}

void Normalised::ToWorld(Bundle& bundle) const {
  for (BundleImage& image : bundle.images) {
    Pose& pose = image.cam_from_world;
    pose.translation = -(pose.rotation * (origin + unit * pose.TargetOriginInSource()));
  }
  for (Eigen::Vector4d& point : bundle.points) {
    Eigen::Vector4d h = point;
    h.head<3>() = unit * h.head<3>() + h[3] * origin;
    // A place keeps the weight 1 that models have; a direction the length 1.
    point = h[3] > 0 ? Eigen::Vector4d(h / h[3]) : Eigen::Vector4d(h / h.norm());
    if (!point.allFinite()) point = h / h.norm();
  }
}

std::unique_ptr<ceres::CostFunction> Normalised::Cost(const Bundle& bundle,
                                                      const BundleObservation& observation) const {
  const auto image = static_cast<size_t>(observation.image);
  ObservationExtras extras;
  if (!members.empty()) extras.member = &members[image];
  if (!shift.empty()) extras.shift_scale_px = ShiftScalePx(bundle, image);
  return ObservationCost(lenses[static_cast<size_t>(bundle.images[image].lens)], poses[image],
                         points[static_cast<size_t>(observation.point)],
                         observation.pixel - bundle.images[image].shift_px, extras);
}

double Normalised::ShiftScalePx(const Bundle& bundle, size_t image) const {
  const LensFrame& lens = lenses[static_cast<size_t>(bundle.images[image].lens)];
  return lens.scale[static_cast<size_t>(FocalCount(lens.model))];
}

bool Normalised::Residual(const Bundle& bundle, const BundleObservation& observation,
                          Eigen::Vector2d* residual) const {
  const auto image = static_cast<size_t>(observation.image);
  const auto lens = static_cast<size_t>(bundle.images[image].lens);
  const double* blocks[] = {theta[lens].data(), motion[image].data(),
                            place[static_cast<size_t>(observation.point)].data(),
                            shift.empty() ? nullptr : shift[image].data()};
  return Cost(bundle, observation)->Evaluate(blocks, residual->data(), nullptr) &&
         residual->allFinite();
}

std::vector<Eigen::Vector2d> Normalised::Residuals(const Bundle& bundle) const {
  std::vector<Eigen::Matrix3d> rotations;
  for (size_t i = 0; i < poses.size(); ++i) {
    Eigen::Matrix3d turn;
    ceres::AngleAxisToRotationMatrix(motion[i].data(), turn.data());
    rotations.push_back(turn * poses[i].rotation);
  }
  std::vector<std::vector<double>> params;
  for (size_t i = 0; i < lenses.size(); ++i) params.push_back(ParamsAt(lenses[i], theta[i].data()));
  std::vector<Eigen::Vector2d> residuals;
  residuals.reserve(bundle.observations.size());
  for (const BundleObservation& o : bundle.observations) {
    const auto image = static_cast<size_t>(o.image), point = static_cast<size_t>(o.point);
    const auto lens = static_cast<size_t>(bundle.images[image].lens);
    const PointFrame& f = points[point];
    const auto& x = place[point];
    const Eigen::Vector3d ray =
        f.direction + x[0] * f.e1 + x[1] * f.e2 + (f.rho + x[2]) * (f.anchor - Centre(image));
    const Eigen::Vector3d p = rotations[image] * ray;
    Eigen::Vector2d r;
    if (!FormulaOf(lenses[lens].model, params[lens].data()).Project(p.data(), r.data())) {
      residuals.push_back(Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN()));
      continue;
    }
    r -= o.pixel - bundle.images[image].shift_px;
    if (!shift.empty()) {
      r += ShiftScalePx(bundle, image) * Eigen::Map<const Eigen::Vector2d>(shift[image].data());
    }
    residuals.push_back(
        r.allFinite() ? r : Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN()));
  }
  return residuals;
}

}  // namespace dtr::calib
