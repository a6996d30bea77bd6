#include "calib/triangulate.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

namespace dtr::calib {
namespace {

constexpr double kHuberPx = 2.0;  // inlier noise of feature detectors is about half a pixel
constexpr int kMaxIterations = 50;
constexpr double kConvergedPx = 1e-9;  // predicted movement in the images; far below any noise
constexpr double kMinReciprocalCondition = 1e-12;  // below, the rays are parallel to rounding

/// Point nearest to all rays: minimises the sum of squared distances (Hartley & Sturm 1997 call it
/// the midpoint method). False when the rays are parallel.
bool MeetingPoint(std::span<const Observation> observations, int left_out,
                  Eigen::Vector3d* p_in_world) {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  int count = 0;
  for (size_t i = 0; i < observations.size(); ++i) {
    if (static_cast<int>(i) == left_out) continue;
    origin += observations[i].center;
    ++count;
  }
  if (count < 2) return false;
  origin /= count;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < observations.size(); ++i) {
    if (static_cast<int>(i) == left_out) continue;
    const Eigen::Vector3d& d = observations[i].direction;
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - d * d.transpose();
    normal += across;
    right += across * (observations[i].center - origin);
  }
  const Eigen::LDLT<Eigen::Matrix3d> solver(normal);
  if (solver.info() != Eigen::Success || solver.rcond() < kMinReciprocalCondition) return false;
  *p_in_world = origin + solver.solve(right);
  return p_in_world->allFinite();
}

struct Linearised {
  double cost = std::numeric_limits<double>::infinity();  ///< Huber's, px^2
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
};

/// Cost infinite when the point is behind a camera.
Linearised Linearise(std::span<const Observation> observations, int left_out,
                     const Eigen::Vector3d& p) {
  Linearised at;
  double cost = 0;
  for (size_t i = 0; i < observations.size(); ++i) {
    if (static_cast<int>(i) == left_out) continue;
    Eigen::Vector2d r;
    Eigen::Matrix<double, 2, 3> jacobian;
    if (!PixelResidual(observations[i], p, &r, &jacobian)) return Linearised{};
    const double length = r.norm();
    const double weight = length <= kHuberPx ? 1.0 : kHuberPx / length;
    cost += length <= kHuberPx ? length * length : kHuberPx * (2 * length - kHuberPx);
    at.matrix += weight * jacobian.transpose() * jacobian;
    at.gradient += weight * jacobian.transpose() * r;
  }
  at.cost = cost;
  return at;
}

/// A start in front of all cameras where the meeting point is not: along the mean ray, at growing
/// distances. The best of them; false when none is in front of all cameras.
bool StartAlongMeanRay(std::span<const Observation> observations, int left_out,
                       Eigen::Vector3d* p_in_world) {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero(), direction = Eigen::Vector3d::Zero();
  int count = 0;
  for (size_t i = 0; i < observations.size(); ++i) {
    if (static_cast<int>(i) == left_out) continue;
    origin += observations[i].center;
    direction += observations[i].direction;
    ++count;
  }
  origin /= count;
  double spread = 0;
  for (size_t i = 0; i < observations.size(); ++i) {
    if (static_cast<int>(i) != left_out) {
      spread = std::max(spread, (observations[i].center - origin).norm());
    }
  }
  double best = std::numeric_limits<double>::infinity();
  for (double reach = spread; reach <= 1024 * spread && spread > 0; reach *= 2) {
    const Eigen::Vector3d p = origin + reach * direction.normalized();
    const double cost = Linearise(observations, left_out, p).cost;
    if (cost < best) {
      best = cost;
      *p_in_world = p;
    }
  }
  return std::isfinite(best);
}

}  // namespace

Observation MakeObservation(const PinholeCamera& camera, const Pose& cam_from_world,
                            const Eigen::Vector2d& pixel) {
  Observation observation;
  observation.camera = &camera;
  observation.cam_from_world_rotation = cam_from_world.rotation.toRotationMatrix();
  observation.center = cam_from_world.TargetOriginInSource();
  observation.direction =
      observation.cam_from_world_rotation.transpose() * camera.RayFromPixel(pixel).normalized();
  observation.pixel = pixel;
  return observation;
}

bool PixelResidual(const Observation& observation, const Eigen::Vector3d& p_in_world,
                   Eigen::Vector2d* residual, Eigen::Matrix<double, 2, 3>* pixel_by_point) {
  const Eigen::Vector3d p = observation.cam_from_world_rotation * (p_in_world - observation.center);
  if (!(p.z() > 0)) return false;
  const double x = p.x() / p.z(), y = p.y() / p.z();
  const double fx = observation.camera->fx_px(), fy = observation.camera->fy_px();
  *residual = observation.pixel - Eigen::Vector2d(fx * x + observation.camera->cx_px(),
                                                  fy * y + observation.camera->cy_px());
  if (!residual->allFinite()) return false;
  if (pixel_by_point != nullptr) {
    Eigen::Matrix<double, 2, 3> by_cam;
    by_cam << fx, 0, -fx * x, 0, fy, -fy * y;
    *pixel_by_point = (by_cam / p.z()) * observation.cam_from_world_rotation;
  }
  return true;
}

Triangulation Triangulate(std::span<const Observation> observations, int left_out) {
  Triangulation result;
  Eigen::Vector3d p;
  if (!MeetingPoint(observations, left_out, &p)) return result;
  Linearised at = Linearise(observations, left_out, p);
  if (!std::isfinite(at.cost)) {
    if (!StartAlongMeanRay(observations, left_out, &p)) {
      result.status = TriangulationStatus::kBehind;
      return result;
    }
    at = Linearise(observations, left_out, p);
  }
  double damping = 1e-6;  // relative to the diagonal; Levenberg-Marquardt's usual small start
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    Eigen::Matrix3d damped = at.matrix;
    damped.diagonal() *= 1 + damping;
    const Eigen::Vector3d step = damped.ldlt().solve(at.gradient);
    if (!step.allFinite()) return result;
    const double moved_px = std::sqrt(std::max(0.0, step.dot(at.matrix * step)));
    if (moved_px < kConvergedPx) break;
    const Linearised next = Linearise(observations, left_out, p + step);
    if (next.cost <= at.cost) {
      p += step;
      at = next;
      damping = std::max(damping / 10, 1e-12);
    } else {
      damping *= 10;
      if (damping > 1e12) break;  // no descent left at double precision
    }
  }
  const Eigen::LDLT<Eigen::Matrix3d> solver(at.matrix);
  if (solver.info() != Eigen::Success || solver.rcond() < kMinReciprocalCondition) return result;
  result.p_in_world = p;
  result.covariance = solver.solve(Eigen::Matrix3d::Identity());
  result.status = TriangulationStatus::kConverged;
  return result;
}

}  // namespace dtr::calib
