#include "dtr/simd/prepared_views.h"

namespace dtr::simd {
namespace {

// More than any view takes: of its image a pixel of RGBA, and per sample its 1/z as a float, its
// bit, and two triangles of three corners and a cell of the reduced mesh.
constexpr size_t kBytesPerPixel = 4, kMaxBytesPerSample = 96;

size_t PixelsOf(const PinholeCamera& camera) {
  return static_cast<size_t>(camera.width_px()) * static_cast<size_t>(camera.height_px());
}

template <typename T>
size_t BytesIn(const std::vector<T>& values) {
  return values.size() * sizeof(T);
}

}  // namespace

void PreparedViews::Put(const RenderFrame& frame, const std::vector<const View*>& views) {
  meshes_.Prepare(views, frame.options);
  sampled_.Prepare(views, frame.options);
}

void PreparedViews::DropView(const View& view) {
  meshes_.Drop(view);
  sampled_.Drop(view);
}

void PreparedViews::DropAll() {
  meshes_.Clear();
  sampled_.Clear();
}

size_t PreparedViews::BytesOf(const View& view) const {
  const AdaptiveMesh& mesh = meshes_.MeshOf(view);
  return sampled_.BytesOf(view) + BytesIn(mesh.vertices) + BytesIn(mesh.indices) +
         BytesIn(mesh.cells) + BytesIn(mesh.tiles);
}

size_t PreparedViews::MostBytesOf(const RenderFrame& frame) const {
  size_t most = 0;
  for (const View* view : frame.views) {
    most += kBytesPerPixel * PixelsOf(view->camera) +
            kMaxBytesPerSample * PixelsOf(view->DepthCamera());
  }
  return most;
}

}  // namespace dtr::simd
