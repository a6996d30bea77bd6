// dtr/cpu/contributions.h -- which view gives how much of each pixel's colour.
#pragma once
#include <vector>

#include "dtr/render/options.h"
#include "dtr/render/scene.h"
#include "dtr/types/camera.h"
#include "dtr/types/depth_image.h"
#include "dtr/types/pose.h"

namespace dtr::cpu {

/// All grids have the size of the image.
struct Contributions {
  std::vector<int> views;  ///< indices into the scene's, in canonical order
  std::vector<Grid<float>>
      shares;  ///< of each view; 0 where it gives nothing; sums are 1 where seen
  /// Of each view's own fragment in the novel camera, 1 / scene units; 0 where it has none.
  std::vector<Grid<float>> inverse_depth;
};

/// Of an image whose surface is `depth` (plane z, as any renderer gives it): SPEC 5.3 from there,
/// then SPEC 4.2 to 4.8. By the deferred method these are the image's own shares; by two passes,
/// whose fragments lie on triangles, near ones. Throws as Render.
Contributions ContributionsTo(const DepthImage& depth, const RenderScene& scene,
                              const PinholeCamera& novel, const Pose& novel_from_world,
                              const RenderOptions& options);

}  // namespace dtr::cpu
