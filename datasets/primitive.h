// datasets/primitive.h -- surfaces a ray meets in closed form.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <limits>

namespace dtr::datasets {

/// Half line origin + t * direction, t > 0. The direction need not be of unit length: with a camera
/// ray of z = 1 in the camera frame, t is the z-depth.
struct Ray {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d At(double t) const { return origin + t * direction; }
};

/// A surface in its own frame, and where that frame stands in the world.
struct Primitive {
  enum class Shape {
    kRectangle,  ///< z = 0, |x| <= half.x, |y| <= half.y; seen from both sides
    kTriangle,   ///< z = 0, corners (0, 0), (half.x, 0), (apex.x, apex.y); from both sides
    kBox,        ///< |x| <= half.x, |y| <= half.y, |z| <= half.z; from outside and inside
    kSphere,     ///< radius half.x; from outside and inside
    kCylinder,   ///< axis z, radius half.x, |z| <= half.z, closed by two discs
  };
  Shape shape = Shape::kBox;
  Eigen::Matrix3d local_from_world = Eigen::Matrix3d::Identity();  ///< rotation only
  Eigen::Vector3d center = Eigen::Vector3d::Zero();                ///< local origin in the world
  Eigen::Vector3d half = Eigen::Vector3d::Ones();                  ///< see Shape
  Eigen::Vector2d apex = Eigen::Vector2d::Zero();                  ///< kTriangle only
  int material = 0;                                                ///< index into the scene's list
  bool casts_shadow = true;  ///< false for what encloses the light (a sky, a room's walls)

  /// The smallest t in (t_min, t_max) at which the ray meets the surface, or infinity.
  double Intersect(const Ray& ray, double t_min, double t_max) const;
  /// Outward unit normal in the world at a point of the surface (for flat shapes local +z).
  Eigen::Vector3d NormalAt(const Eigen::Vector3d& p_in_world) const;
  /// World-axis-aligned bounds.
  Eigen::AlignedBox3d Bounds() const;

  Eigen::Vector3d ToLocal(const Eigen::Vector3d& p_in_world) const {
    return local_from_world * (p_in_world - center);
  }
};

inline constexpr double kNoHit = std::numeric_limits<double>::infinity();

}  // namespace dtr::datasets
