// dtr/render/nearest_by_angle.h -- internal to dtr/render: the cameras nearest to one as seen from
// the scene centre, without going through all of them.
#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "dtr/types/pose.h"

namespace dtr {

/// A tree of the directions in which cameras lie from the scene centre.
class NearestByAngle {
 public:
  /// SPEC 0.3: neighbours of a reference baseline (docs/FORMAT.md).
  static constexpr size_t kNeighbours = 4;

  NearestByAngle(std::span<const Pose> cam_from_world, const Eigen::Vector3d& scene_center);

  /// Positions of the kNeighbours nearest by AngleBetween at the scene centre (ties: the smaller
  /// index), fewer where there are fewer. `self`: the index of the camera itself, if it is here.
  std::vector<Eigen::Vector3d> Of(const Eigen::Vector3d& center, std::optional<size_t> self) const;

 private:
  struct Search;
  /// A camera of the tree: it parts the range that it is in the middle of, along `axis`.
  struct Node {
    size_t index = 0;
    Eigen::Vector3d direction;  ///< unit length
    int axis = 0;
  };
  void Build(size_t begin, size_t end);
  void Visit(size_t begin, size_t end, Search& search) const;

  Eigen::Vector3d scene_center_;
  std::vector<Eigen::Vector3d> centers_;
  std::vector<Node> tree_;
  std::vector<size_t> at_scene_center_;  ///< whose direction says nothing
};

}  // namespace dtr
