// datasets/scene.h -- exact synthetic scenes: analytic surfaces, procedural texture, fixed light.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "datasets/material.h"
#include "datasets/primitive.h"

namespace dtr::datasets {

/// Where a ray meets the scene.
struct Hit {
  double t = 0;  ///< along the ray, in units of its direction
  Eigen::Vector3d p_in_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit length, towards the ray's origin
  int primitive = 0;                                  ///< index into primitives()
};

/// Light that does not depend on where one looks from.
struct Lighting {
  bool is_sun = true;  ///< `source` is a direction towards the light; else the place of a lamp
  Eigen::Vector3d source = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d direct = Eigen::Vector3d::Ones();      ///< linear RGB irradiance / pi
  Eigen::Vector3d from_above = Eigen::Vector3d::Ones();  ///< ambient for upward normals
  Eigen::Vector3d from_below = Eigen::Vector3d::Ones();  ///< ambient for downward normals
  double lamp_reach = 1;  ///< lamps only: distance at which `direct` is received in full
};

/// What camera layouts must know of a scene (datasets/layout.h). World: z up, scene units.
struct Framing {
  Eigen::Vector3d focus = Eigen::Vector3d::Zero();  ///< what inward-looking cameras look at
  double distance = 1;      ///< of arc, grid and line cameras from the focus, towards -y
  double height = 0;        ///< of the cameras above the focus
  double max_arc_deg = 90;  ///< the longest arc from which nothing is in the way
  double ring_radius = 0;   ///< of a full ring around the focus
  Eigen::Vector3d inside = Eigen::Vector3d::Zero();  ///< middle of an inside-out capture
  double inside_radius = 0;                          ///< of the circle its cameras stand on
  std::vector<std::string> layouts;  ///< those that make sense here; the first is the default
};

/// A still scene. Immutable; all members may be called from several threads.
class Scene {
 public:
  /// Throws std::invalid_argument when a primitive names a material that is not there.
  Scene(std::string name, std::vector<Primitive> primitives, std::vector<Material> materials,
        Lighting lighting, Framing framing);

  const std::string& name() const { return name_; }
  const Framing& framing() const { return framing_; }
  const std::vector<Primitive>& primitives() const { return primitives_; }

  /// The nearest surface with t in (0, t_max), or empty. Exact up to double rounding; with a
  /// direction of z = 1 in a camera's frame, Hit::t is the z-depth. `guess`: the primitive probably
  /// hit (that of a neighbouring ray), which saves time and changes nothing; -1 for none.
  std::optional<Hit> Intersect(const Ray& ray, double t_max = kNoHit, int guess = -1) const;

  /// True when a surface lies at t in (t_min, t_max).
  bool IsBlocked(const Ray& ray, double t_min, double t_max) const;

  /// Diffuse radiance of a surface point, linear RGB, 1 = white of an 8-bit image. Lambert's law
  /// with one light (hard shadows) and an ambient term by normal. Independent of the viewer but
  /// for `footprint` (scene units per pixel at the point), which band-limits the texture as a
  /// pixel's area does.
  Eigen::Vector3d Radiance(const Hit& hit, double footprint) const;

 private:
  struct Node {
    Eigen::AlignedBox3d box;
    int first = 0;  ///< leaf: index into order_; else the left child, the right one follows it
    int count = 0;  ///< primitives of a leaf; 0 for an inner node
  };
  void Build(int node, int first, int count);
  /// Visits primitives whose box the ray may meet before the current limit; `visit(index, limit)`
  /// returns the new limit, or a negative number to stop.
  template <typename Visit>
  void Traverse(const Ray& ray, double limit, const Visit& visit) const;

  std::string name_;
  std::vector<Primitive> primitives_;
  std::vector<Material> materials_;
  Lighting lighting_;
  Framing framing_;
  std::vector<int> large_;  ///< primitives as big as the scene: tested first, one by one
  std::vector<int> order_;  ///< all others, in the order of the tree's leaves
  std::vector<Node> nodes_;
};

/// The scenes by name: courtyard, plane, stairs, sphere, room, plain-room, toys. `seed` changes
/// textures and, in courtyard and the rooms, small things; never the framing. `time_s`: the time
/// step; the ball of `sphere` rolls; of `toys` a ball rolls, a crate slides and a box turns; all
/// else stands still. Throws UsageError for other names, listing those that
/// exist, and for another time than 0 of a scene where nothing moves.
Scene MakeScene(const std::string& name, std::uint64_t seed, double time_s = 0);

/// Names MakeScene knows.
std::vector<std::string> SceneNames();

}  // namespace dtr::datasets
