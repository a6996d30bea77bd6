#include "datasets/primitive.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace dtr::datasets {
namespace {

using Eigen::Vector3d;

bool InTriangle(double x, double y, double base, const Eigen::Vector2d& apex) {
  // Barycentric coordinates of (x, y) in (0,0), (base,0), apex.
  const double c = y / apex.y();
  const double b = (x - c * apex.x()) / base;
  return b >= 0 && c >= 0 && b + c <= 1;
}

double IntersectFlat(const Primitive& p, const Vector3d& o, const Vector3d& d, double t_min,
                     double t_max) {
  const double t = -o.z() / d.z();
  if (!(t > t_min && t < t_max)) return kNoHit;
  const double x = o.x() + t * d.x(), y = o.y() + t * d.y();
  const bool inside = p.shape == Primitive::Shape::kRectangle
                          ? std::abs(x) <= p.half.x() && std::abs(y) <= p.half.y()
                          : InTriangle(x, y, p.half.x(), p.apex);
  return inside ? t : kNoHit;
}

double FirstInRange(double enter, double leave, double t_min, double t_max) {
  if (enter > t_min) return enter < t_max ? enter : kNoHit;
  return leave > t_min && leave < t_max ? leave : kNoHit;
}

double IntersectBox(const Vector3d& half, const Vector3d& o, const Vector3d& d, double t_min,
                    double t_max) {
  double enter = -kNoHit, leave = kNoHit;
  for (int axis = 0; axis < 3; ++axis) {
    if (d[axis] == 0) {
      if (std::abs(o[axis]) > half[axis]) return kNoHit;
      continue;
    }
    double a = (-half[axis] - o[axis]) / d[axis], b = (half[axis] - o[axis]) / d[axis];
    if (a > b) std::swap(a, b);
    enter = std::max(enter, a);
    leave = std::min(leave, b);
  }
  return enter <= leave ? FirstInRange(enter, leave, t_min, t_max) : kNoHit;
}

double IntersectSphere(double radius, const Vector3d& o, const Vector3d& d, double t_min,
                       double t_max) {
  // The discriminant from the distance of the centre to the line, and the roots without
  // cancellation: Haines, Guenther, Akenine-Moeller, "Precision Improvements for Ray/Sphere
  // Intersection", Ray Tracing Gems (2019), ch. 7.
  const double a = d.squaredNorm(), b = -o.dot(d);
  const double discriminant = radius * radius - (o + (b / a) * d).squaredNorm();
  if (discriminant < 0) return kNoHit;
  const double c = o.squaredNorm() - radius * radius;
  const double q = b + std::copysign(std::sqrt(a * discriminant), b);
  double t0 = c / q, t1 = q / a;
  if (t0 > t1) std::swap(t0, t1);
  return FirstInRange(t0, t1, t_min, t_max);
}

double IntersectCylinder(const Vector3d& half, const Vector3d& o, const Vector3d& d, double t_min,
                         double t_max) {
  double enter = -kNoHit, leave = kNoHit;
  const Eigen::Vector2d o2 = o.head<2>(), d2 = d.head<2>();
  const double a = d2.squaredNorm();
  if (a > 0) {
    const double b = -o2.dot(d2);
    const double discriminant = half.x() * half.x() - (o2 + (b / a) * d2).squaredNorm();
    if (discriminant < 0) return kNoHit;
    const double root = std::sqrt(a * discriminant);
    enter = (b - root) / a;
    leave = (b + root) / a;
  } else if (o2.squaredNorm() > half.x() * half.x()) {
    return kNoHit;
  }
  if (d.z() != 0) {
    double bottom = (-half.z() - o.z()) / d.z(), top = (half.z() - o.z()) / d.z();
    if (bottom > top) std::swap(bottom, top);
    enter = std::max(enter, bottom);
    leave = std::min(leave, top);
  } else if (std::abs(o.z()) > half.z()) {
    return kNoHit;
  }
  return enter <= leave ? FirstInRange(enter, leave, t_min, t_max) : kNoHit;
}

}  // namespace

double Primitive::Intersect(const Ray& ray, double t_min, double t_max) const {
  const Vector3d o = ToLocal(ray.origin), d = local_from_world * ray.direction;
  switch (shape) {
    case Shape::kRectangle:
    case Shape::kTriangle:
      return IntersectFlat(*this, o, d, t_min, t_max);
    case Shape::kBox:
      return IntersectBox(half, o, d, t_min, t_max);
    case Shape::kSphere:
      return IntersectSphere(half.x(), o, d, t_min, t_max);
    case Shape::kCylinder:
      return IntersectCylinder(half, o, d, t_min, t_max);
  }
  return kNoHit;
}

Vector3d Primitive::NormalAt(const Vector3d& p_in_world) const {
  const Vector3d p = ToLocal(p_in_world);
  Vector3d normal = Vector3d::UnitZ();
  if (shape == Shape::kBox) {
    // The face is the axis on which the point lies farthest out, relative to the box.
    int axis = 0;
    p.cwiseQuotient(half).cwiseAbs().maxCoeff(&axis);
    normal = Vector3d::Unit(axis) * std::copysign(1.0, p[axis]);
  } else if (shape == Shape::kSphere) {
    normal = p.normalized();
  } else if (shape == Shape::kCylinder) {
    const double out_side = p.head<2>().norm() - half.x(), out_disc = std::abs(p.z()) - half.z();
    normal = out_side > out_disc ? Vector3d(p.x(), p.y(), 0).normalized()
                                 : Vector3d(0, 0, std::copysign(1.0, p.z()));
  }
  return local_from_world.transpose() * normal;
}

Eigen::AlignedBox3d Primitive::Bounds() const {
  Eigen::AlignedBox3d box;
  const auto add = [&](const Vector3d& p) {
    box.extend(center + local_from_world.transpose() * p);
  };
  if (shape == Shape::kTriangle) {
    add(Vector3d::Zero());
    add({half.x(), 0, 0});
    add({apex.x(), apex.y(), 0});
    return box;
  }
  Vector3d extent = half;
  if (shape == Shape::kRectangle) extent.z() = 0;
  if (shape == Shape::kCylinder) extent.y() = extent.x();
  if (shape == Shape::kSphere) extent = Vector3d::Constant(half.x());
  for (int corner = 0; corner < 8; ++corner) {
    add(extent.cwiseProduct(
        Vector3d((corner & 1) ? 1 : -1, (corner & 2) ? 1 : -1, (corner & 4) ? 1 : -1)));
  }
  return box;
}

}  // namespace dtr::datasets
