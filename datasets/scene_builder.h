// datasets/scene_builder.h -- puts scenes together; used by the scenes_*.cpp only.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "datasets/scene.h"

namespace dtr::datasets {

/// Collects primitives and materials. Angles in degrees; "turn" is about world z.
class SceneBuilder {
 public:
  explicit SceneBuilder(std::uint64_t seed) : seed_(seed) {}

  /// Index of a new material; its texture seed follows from the scene's seed and its own number.
  int Add(Material material);

  /// Each adds one primitive and returns it for the finishing touches; valid until the next Add.
  Primitive& Box(const Eigen::Vector3d& center, const Eigen::Vector3d& half, int material,
                 double turn_deg = 0);
  Primitive& Sphere(const Eigen::Vector3d& center, double radius, int material);
  /// A closed cylinder from the centre of one disc to the centre of the other.
  Primitive& Rod(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius,
                 int material);
  /// Spanned by two orthogonal half edges.
  Primitive& Rectangle(const Eigen::Vector3d& center, const Eigen::Vector3d& half_u,
                       const Eigen::Vector3d& half_v, int material);
  Primitive& Triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                      int material);
  /// A slab of the given thickness spanned by two orthogonal half edges: slanted roofs, leaning
  /// boards. `center` is that of the slab.
  Primitive& Slab(const Eigen::Vector3d& center, const Eigen::Vector3d& half_u,
                  const Eigen::Vector3d& half_v, double half_thickness, int material);

  Scene Build(std::string name, const Lighting& lighting, const Framing& framing) &&;

 private:
  std::uint64_t seed_;
  std::vector<Primitive> primitives_;
  std::vector<Material> materials_;
};

/// A sky far away that closes the scene: whatever misses all else sees clouds, hills and woods.
void AddSky(SceneBuilder& builder, double radius);

/// Bright daylight from the front left.
Lighting Daylight();

Scene MakeCourtyard(std::uint64_t seed);
Scene MakeRoom(std::uint64_t seed, bool plain);
Scene MakePlane(std::uint64_t seed);
Scene MakeStairs(std::uint64_t seed);
Scene MakeSphere(std::uint64_t seed, double time_s = 0);
Scene MakeToys(std::uint64_t seed, double time_s = 0);

}  // namespace dtr::datasets
