// stereo/complete/scene_planes.h -- the large planes of a scene: ground, walls, facades.
#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "dtr/types/pose.h"
#include "stereo/complete/cells.h"

namespace dtr::stereo {

/// normal . p = offset for points p of the world; the normal is of unit length.
struct ScenePlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double offset = 0;

  /// Empty where the camera stands in the plane.
  std::optional<ViewPlane> Before(const Pose& cam_from_world) const;
};

/// The planes on which most of what the views measured lies, largest first, at most `most`: one
/// after the other, each the one of most support among those through single measured cells with
/// their normals (RANSAC, Fischler and Bolles 1981), fitted to its support. Equal inputs give equal
/// planes, for any number of threads.
std::vector<ScenePlane> FindScenePlanes(std::span<const CellView> views, int most);

/// A view with those around it.
struct Neighbourhood {
  const CellView* view;
  std::vector<const CellView*> others;
};

/// Planes that nothing was measured of, but on which the views agree: lawns, floors, water. Planes
/// parallel to `known` ones and level ones are swept through what was not measured (Collins, A
/// space-sweep approach to true multi-image matching, CVPR 1996; only its textured parts say
/// anything), and one after the other the one is chosen that explains most, at most `most`.
std::vector<ScenePlane> SweepScenePlanes(std::span<const Neighbourhood> views,
                                         std::span<const ScenePlane> known, int most);

}  // namespace dtr::stereo
