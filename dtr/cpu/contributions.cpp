#include "dtr/cpu/contributions.h"

#include <stdexcept>

#include "dtr/base/parallel_for.h"
#include "dtr/cpu/own_depth.h"
#include "dtr/cpu/setup.h"
#include "dtr/render/frame.h"

namespace dtr::cpu {

Contributions ContributionsTo(const DepthImage& depth, const RenderScene& scene,
                              const PinholeCamera& novel, const Pose& novel_from_world,
                              const RenderOptions& options) {
  CheckRenderOptions(options);
  CheckNovelCamera(novel, novel_from_world);
  if (depth.width() != novel.width_px() || depth.height() != novel.height_px()) {
    throw std::invalid_argument("ContributionsTo: a depth of another size than the camera");
  }
  const ViewSelection selection = SelectViews(scene, novel_from_world, options);
  Contributions contributions;
  if (selection.views.empty()) return contributions;
  Setup setup = MakeSetup(scene, selection, novel, novel_from_world, options);
  const Band whole{novel.width_px(), 0, novel.height_px()};
  std::vector<double> start;
  for (const float z : depth.grid().data()) start.push_back(DepthImage::IsHole(z) ? 0 : 1.0 / z);
  std::vector<Layer> layers(setup.views.size(), Layer(Band{}));
  ParallelFor(0, static_cast<int>(layers.size()), [&](int i) {
    const auto k = static_cast<size_t>(i);
    layers[k] = FindOwnFragments(setup.placed[k], novel, options, whole, start);
  });
  contributions.views = setup.order;
  for (size_t i = 0; i < layers.size(); ++i) {
    setup.views[i].layer = &layers[i];
    Grid<float> inverse_depth(novel.width_px(), novel.height_px());
    for (size_t p = 0; p < start.size(); ++p) {
      inverse_depth.data()[p] = static_cast<float>(layers[i].inverse_depth[p]);
    }
    contributions.inverse_depth.push_back(std::move(inverse_depth));
  }
  contributions.shares.assign(layers.size(), Grid<float>(novel.width_px(), novel.height_px()));
  RenderResult result = EmptyResult(novel);
  ParallelFor(0, novel.height_px(), [&](int y) {
    ResolveRow(setup.settings, setup.views, y, result, contributions.shares);
  });
  return contributions;
}

}  // namespace dtr::cpu
