// pipeline/export/detail/mesh.h -- the depth maps of a set as triangles.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "dtr/base/progress.h"
#include "pipeline/export/detail/surface_views.h"

namespace dtr::pipeline {

struct MeshOptions {
  double voxel = 0;      ///< scene units; 0: twice the median width of a pixel on the surface
  int min_views = 2;     ///< that show a surface at the same depth
  double memory_gb = 4;  ///< for what is made; a larger voxel is taken where it would be more
};

struct Mesh {
  double voxel = 0;                                     ///< that was taken
  std::vector<Eigen::Vector3f> positions, normals;      ///< stored world; unit length, outwards
  std::vector<std::array<std::uint8_t, 3>> colours;     ///< sRGB, mean exposure of the set
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counterclockwise from outside
};

/// Truncated signed distances (Curless and Levoy 1996) on a lattice of voxels, of which only blocks
/// around surfaces exist, and a surface between their signs (dual: Gibson 1998, surface nets).
/// - A voxel's distance is the mean over the views whose surface lies within three voxels of it,
///   along the normal, weighted by 1 / variance. It is unknown where fewer than `min_views` are, or
///   where more views see through it.
/// - Only cells whose eight corners are known and nowhere farther apart than their distance allows
///   have a surface: there is none across depth breaks.
/// - Parts of few triangles are left out.
/// The same for any number of threads. `views` with colours. Memory: the bounds of `views` and of
/// the options; blocks are computed one by one from all views that see them.
Mesh MeshOf(SurfaceViews& views, const MeshOptions& options, Progress& progress);

}  // namespace dtr::pipeline
