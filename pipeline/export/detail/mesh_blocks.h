// pipeline/export/detail/mesh_blocks.h -- blocks of a sparse lattice of signed distances.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "pipeline/export/detail/surface_views.h"

namespace dtr::pipeline {

inline constexpr int kBlockSide = 8;  ///< voxels
/// Truncation, voxels.
inline constexpr double kTruncation = 3;

using BlockPlace = std::array<std::int32_t, 3>;  ///< of its first voxel, in blocks
using SurfaceList = std::vector<std::shared_ptr<const SurfaceView>>;

/// What a block contributes. Cells and lattice points are numbered x + 8 (y + 8 z).
struct MeshBlock {
  struct Vertex {
    std::uint16_t cell = 0;
    Eigen::Vector3f position, normal;
  };
  /// Four cells around the lattice edge from `point` along `axis`.
  struct Quad {
    std::uint16_t point = 0;
    std::uint8_t axis = 0;
    bool outwards = false;  ///< the surface faces along the axis
  };
  std::vector<Vertex> vertices;  // rising cells
  std::vector<Quad> quads;
};

/// The blocks that hold a voxel within the truncation of a surface sample of the view, in rising
/// order.
std::vector<BlockPlace> BlocksOf(const SurfaceView& surface, double voxel);

/// Depths at which a view may show the surface to a voxel, by the pixel that the voxel is seen in.
class NearDepths {
 public:
  NearDepths(const SurfaceView& surface, double voxel);
  /// False where no voxel of a block, nor one of its neighbours' first ones, is within the
  /// truncation of what the view shows: to the block the view adds no distance.
  bool MayReach(const BlockPlace& place) const;

 private:
  const SurfaceView& surface_;
  double voxel_;
  Grid<float> from_, to_;  ///< z in the camera frame; infinity, 0: never
};

/// Distances of a block's voxels and its neighbours' first ones, as Mesh describes it; `views`: all
/// that see it.
MeshBlock MeshBlockOf(const BlockPlace& place, double voxel, int min_views,
                      const SurfaceList& views);

}  // namespace dtr::pipeline
