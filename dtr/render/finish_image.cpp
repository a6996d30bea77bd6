#include "dtr/render/finish_image.h"

#include <vector>

#include "dtr/render/fill_holes.h"
#include "dtr/render/frame.h"
#include "dtr/render/smooth_edges.h"

namespace dtr {

Grid<float> FinishImage(const RenderScene& scene, const PinholeCamera& novel,
                        const Pose& novel_from_world, const RenderOptions& options,
                        RenderResult& result) {
  // Edges are those of what was seen: filled depth runs smoothly into it. So it stays apart.
  Grid<float> shown = options.fill_holes ? FillHoles(result) : SeenDepth(result);
  if (!options.smooth_edges) return shown;
  std::vector<Eigen::Vector3d> view_centres;
  for (const int index : result.views_used) {
    const View& view = *scene.views[static_cast<size_t>(index)];
    view_centres.push_back(PlaceView(view, novel_from_world).translation);
  }
  SmoothEdges(novel, view_centres, options.fill_holes, result);
  return shown;
}

}  // namespace dtr
