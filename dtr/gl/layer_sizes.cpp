#include "dtr/gl/layer_sizes.h"

#include <algorithm>
#include <set>

#include "dtr/gl/packed_depth.h"

namespace dtr::gl {
namespace {

// Finer steps would hardly leave fewer sizes.
constexpr int kFirstStepPx = 64;

int Rounded(int side_px, int step_px, int most_px) {
  const int rounded = (side_px + step_px - 1) / step_px * step_px;
  return std::max(side_px, std::min(rounded, most_px));
}

}  // namespace

LayerSizes::LayerSizes(const std::vector<const View*>& views, int resolution, int most_px)
    : max_px_(most_px) {
  std::vector<LayerSize> images, depths;
  for (const View* view : views) {
    images.push_back({view->camera.width_px(), view->camera.height_px()});
    depths.push_back(PackedDepthSize(*view, resolution));
  }
  while (step_px_ < most_px && !(AreFew(images) && AreFew(depths))) {
    step_px_ = step_px_ == 1 ? kFirstStepPx : 2 * step_px_;
  }
}

bool LayerSizes::AreFew(const std::vector<LayerSize>& pictures) const {
  std::set<LayerSize> layers;
  for (const LayerSize& picture : pictures) layers.insert(LayerFor(picture));
  return layers.size() <= static_cast<size_t>(kMaxSizes);
}

LayerSize LayerSizes::LayerFor(const LayerSize& picture) const {
  return {Rounded(picture.width_px, step_px_, max_px_),
          Rounded(picture.height_px, step_px_, max_px_)};
}

LayerSize PackedDepthSize(int columns, int rows) {
  if (columns == 0 || rows == 0) return {};
  const int rows_of_bits = (rows + 1 + kBlocksPerTexel - 1) / kBlocksPerTexel;
  return {columns + 1, rows + 1 + rows_of_bits};
}

LayerSize PackedDepthSize(const View& view, int resolution) {
  const PinholeCamera camera = view.DepthCamera();
  const int first = resolution / 2;
  const auto along = [&](int pixels) {
    return pixels > first ? (pixels - first + resolution - 1) / resolution : 0;
  };
  return PackedDepthSize(along(camera.width_px()), along(camera.height_px()));
}

LayerSize SizeWithEdge(const LayerSize& picture, const LayerSize& layer) {
  return {std::min(picture.width_px + 1, layer.width_px),
          std::min(picture.height_px + 1, layer.height_px)};
}

}  // namespace dtr::gl
