#include "dtr/gl/gpu_views.h"

#include <algorithm>

namespace dtr::gl {
namespace {

// More than any view takes per sample of its geometry and depth. The two passes' mesh: every block
// open, with four quarter cells of four points and six indices each. The reduced mesh: two
// triangles of three corners and a cell.
constexpr size_t kMaxBytesOfMesh = 320, kMaxBytesOfSplats = 48, kMaxBytesOfReducedMesh = 80;
constexpr size_t kBytesPerPixel = 4;  // GL_RGBA8

size_t PixelsOf(const LayerSize& size) {
  return static_cast<size_t>(size.width_px) * static_cast<size_t>(size.height_px);
}

LayerSize SizeOf(const PinholeCamera& camera) { return {camera.width_px(), camera.height_px()}; }

size_t MostBytesOf(const View& view, const RenderOptions& options, const LayerSizes& sizes) {
  const size_t per_sample = options.method == RenderMethod::kDeferred ? kMaxBytesOfReducedMesh
                            : options.primitive == Primitive::kSplat  ? kMaxBytesOfSplats
                                                                      : kMaxBytesOfMesh;
  return kBytesPerPixel * PixelsOf(sizes.LayerFor(SizeOf(view.camera))) +
         kBytesPerPixel * PixelsOf(sizes.LayerFor(PackedDepthSize(view, options.resolution))) +
         per_sample * PixelsOf(SizeOf(view.DepthCamera()));
}

LayerSizes SizesFor(const RenderFrame& frame) {
  GLint most_px = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most_px);
  return {frame.scene.views, frame.options.resolution, most_px};
}

}  // namespace

void GpuViews::Begin(const RenderFrame& frame) { sizes_ = SizesFor(frame); }

void GpuViews::DropAll() {
  store_.Clear();
  meshes_.Clear();
}

void GpuViews::DropView(const View& view) {
  store_.Drop(view);
  meshes_.Drop(view);
}

int GpuViews::LayersFor(const RenderFrame& frame, const View& view) {
  const std::vector<const View*>& all = frame.scene.views;
  const LayerSize layer = sizes_.LayerFor(SizeOf(view.camera));
  const auto alike = std::count_if(all.begin(), all.end(), [&](const View* other) {
    return sizes_.LayerFor(SizeOf(other->camera)) == layer &&
           other->depth_scale == view.depth_scale;
  });
  const size_t fitting = room_bytes() / (BytesOf(view) + 2 * kBytesPerPixel * PixelsOf(layer));
  return static_cast<int>(
      std::clamp<size_t>(fitting, 1, std::max<size_t>(1, static_cast<size_t>(alike))));
}

void GpuViews::PutTextures(const RenderFrame& frame, const std::vector<const View*>& views) {
  std::map<const View*, int> layers;  // by what the geometry takes, before images and depths do
  for (const View* view : views) layers[view] = LayersFor(frame, *view);
  const auto new_layers = [&](const View& view) { return layers.at(&view); };
  store_.PrepareImages(views, sizes_, new_layers);
  if (frame.deferred()) store_.PrepareDeferred(views, frame.options, sizes_, new_layers);
}

void GpuViews::Put(const RenderFrame& frame, const std::vector<const View*>& views) {
  if (frame.deferred()) {
    meshes_.Prepare(views, frame.options);
  } else {
    store_.Prepare(views, frame.options);
  }
  PutTextures(frame, views);
}

void GpuViews::DropUnused(const RenderFrame& frame, const View& view) {
  store_.DropUnusedBy(frame.options, view);
  if (!frame.deferred()) meshes_.Drop(view);
}

size_t GpuViews::MostBytesOf(const RenderFrame& frame) const {
  const LayerSizes sizes = SizesFor(frame);
  size_t most = 0;
  for (const View* view : frame.views) most += gl::MostBytesOf(*view, frame.options, sizes);
  return most;
}

}  // namespace dtr::gl
