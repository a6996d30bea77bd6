// viewer/wireframe.h -- the reduced meshes that images start from, as lines over the image.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "dtr/render/adaptive_mesh.h"
#include "viewer/shown.h"

namespace dtr::viewer {

/// Draws wireframes and keeps the meshes of the last image's views, which must not die before the
/// next call; pixels that were read again make new ones.
class Wireframe {
 public:
  /// The image, darkened, and over it the edges of its views' meshes (SPEC 5.1), each view in its
  /// colour, the nearest view's on top. An edge is hidden where it lies more than the view's
  /// Delta behind the surface shown, in 1/z. The two passes draw full grids: theirs are reduced
  /// with no tolerance, so that only blocks which are flat to the digit are joined. Splats have no
  /// edges; the mesh of their samples is shown.
  ImageRgb8 Draw(const Drawn& drawn);

 private:
  struct Kept {
    int resolution = 0;
    MeshRule rule;
    const void* depth_data = nullptr;
    std::vector<Eigen::Vector3d> points;  ///< stored world
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  };
  void Keep(const Drawn& drawn);

  std::map<const View*, Kept> meshes_;
};

}  // namespace dtr::viewer
