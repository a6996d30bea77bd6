// dtr/gl/layer_sizes.h -- how large the layers of texture arrays are. Only dtr/gl's own .cpp files
// and its tests include this.
#pragma once
#include <vector>

#include "dtr/types/view.h"

namespace dtr::gl {

struct LayerSize {
  int width_px = 0, height_px = 0;
  bool operator==(const LayerSize&) const = default;
  auto operator<=>(const LayerSize&) const = default;
};

/// A shader reads from few arrays (texture units), and an array has layers of one size. Images of
/// up to kMaxSizes sizes have layers of their own size; of more, sides are rounded up to multiples
/// of a step until no more than kMaxSizes are left.
class LayerSizes {
 public:
  static constexpr int kMaxSizes = 5;

  LayerSizes() = default;
  /// For the images of these views and their depth at every `resolution`-th pixel; `most_px`: the
  /// driver's limit on a side.
  LayerSizes(const std::vector<const View*>& views, int resolution, int most_px);

  LayerSize LayerFor(const LayerSize& picture) const;
  int step_px() const { return step_px_; }

 private:
  bool AreFew(const std::vector<LayerSize>& pictures) const;

  int step_px_ = 1, max_px_ = 0;
};

/// Of the image in which shaders find a grid of samples (PackedDepth); none for an empty grid.
LayerSize PackedDepthSize(int columns, int rows);
/// Of the view's depth map at every `resolution`-th pixel (SPEC 2.1).
LayerSize PackedDepthSize(const View& view, int resolution);

/// An image of `channels` values a pixel with its last column and row once more where the layer is
/// larger: what a texture unit finds where it clamps to the edge of a layer of the image's size.
template <typename T>
std::vector<T> WithEdge(const T* values, const LayerSize& size, int channels,
                        const LayerSize& with_edge) {
  const auto row = static_cast<size_t>(size.width_px) * static_cast<size_t>(channels);
  const auto last = row - static_cast<size_t>(channels);
  std::vector<T> out;
  out.reserve(static_cast<size_t>(with_edge.width_px) * static_cast<size_t>(with_edge.height_px) *
              static_cast<size_t>(channels));
  for (int y = 0; y < with_edge.height_px; ++y) {
    const T* from = values + row * static_cast<size_t>(y < size.height_px ? y : y - 1);
    out.insert(out.end(), from, from + row);
    if (with_edge.width_px > size.width_px) out.insert(out.end(), from + last, from + row);
  }
  return out;
}

/// What of a layer an image takes: its size and, where the layer is larger, a pixel of edge.
LayerSize SizeWithEdge(const LayerSize& picture, const LayerSize& layer);

}  // namespace dtr::gl
