// dtr/cpu/setup.h -- what is the same for all pixels of an image.
#pragma once
#include <vector>

#include "dtr/cpu/resolve.h"
#include "dtr/render/scene.h"
#include "dtr/render/valid_views.h"

namespace dtr::cpu {

/// The views of an image in canonical order. `views` points into `placed`; layers are the
/// caller's to fill in.
struct Setup {
  std::vector<int> order;  ///< indices into the scene's views
  std::vector<ViewInNovel> placed;
  std::vector<ResolveView> views;
  ResolveSettings settings;
  Eigen::Vector3d exposure;  ///< FrameExposure
};

Setup MakeSetup(const RenderScene& scene, const ViewSelection& selection,
                const PinholeCamera& novel, const Pose& novel_from_world,
                const RenderOptions& options);

}  // namespace dtr::cpu
