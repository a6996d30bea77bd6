#include "dtr/render/finish_image.h"

#include <utility>
#include <vector>

#include "dtr/render/fill_holes.h"
#include "dtr/render/frame.h"
#include "dtr/render/smooth_edges.h"

namespace dtr {

Grid<float> FinishImage(const RenderScene& scene, const PinholeCamera& novel,
                        const Pose& novel_from_world, const RenderOptions& options,
                        RenderResult& result) {
  Grid<float> seen = SeenDepth(result);
  if (!options.smooth_edges) {
    return options.fill_holes ? FillHoles(result, options.threads) : std::move(seen);
  }
  // Edges of what was seen: filled depth runs smoothly into it.
  Grid<float> shown = options.fill_holes ? FillHoles(result, options.threads) : seen;
  std::vector<Eigen::Vector3d> view_centres;
  for (const int index : result.views_used) {
    const View& view = *scene.views[static_cast<size_t>(index)];
    view_centres.push_back(PlaceView(view, novel_from_world).translation);
  }
  SmoothEdges(novel, view_centres, seen, options.fill_holes, options.threads, result.image);
  return shown;
}

}  // namespace dtr
