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
         kBytesPerPixel * PixelsOf(sizes.LayerFor(DepthPictureSize(view, options.resolution))) +
         per_sample * PixelsOf(SizeOf(view.DepthCamera()));
}

LayerSizes SizesFor(const Frame& frame) {
  GLint most_px = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most_px);
  return {frame.scene.views, frame.options.resolution, most_px};
}

}  // namespace

size_t GpuViews::bytes() const {
  size_t sum = 0;
  for (const auto& [view, used] : used_) sum += used.bytes;
  return sum;
}

void GpuViews::Clear() {
  store_.Clear();
  meshes_.Clear();
  sampled_.Clear();
  used_.clear();
}

void GpuViews::Drop(const View& view) {
  store_.Drop(view);
  meshes_.Drop(view);
  sampled_.Drop(view);
  used_.erase(&view);
}

bool GpuViews::DropOldest() {
  auto oldest = used_.end();
  for (auto it = used_.begin(); it != used_.end(); ++it) {
    if (it->second.last == now_) continue;
    if (oldest == used_.end() || it->second.last < oldest->second.last) oldest = it;
  }
  if (oldest == used_.end()) return false;
  Drop(*oldest->first);
  return true;
}

int GpuViews::LayersFor(const Frame& frame, const View& view) {
  const std::vector<const View*>& all = frame.scene.views;
  const LayerSize layer = sizes_.LayerFor(SizeOf(view.camera));
  const auto alike = std::count_if(all.begin(), all.end(), [&](const View* other) {
    return sizes_.LayerFor(SizeOf(other->camera)) == layer &&
           other->depth_scale == view.depth_scale;
  });
  const size_t fitting = room_bytes_ / (BytesOf(view) + 2 * kBytesPerPixel * PixelsOf(layer));
  return static_cast<int>(
      std::clamp<size_t>(fitting, 1, std::max<size_t>(1, static_cast<size_t>(alike))));
}

void GpuViews::PutTextures(const Frame& frame, const std::vector<const View*>& views) {
  std::map<const View*, int> layers;  // by what the geometry takes, before images and depths do
  for (const View* view : views) layers[view] = LayersFor(frame, *view);
  const auto new_layers = [&](const View& view) { return layers.at(&view); };
  store_.PrepareImages(views, sizes_, new_layers);
  if (frame.deferred()) store_.PrepareDeferred(views, frame.options, sizes_, new_layers);
}

void GpuViews::Put(const Frame& frame, const std::vector<const View*>& views) {
  if (frame.deferred()) {
    meshes_.Prepare(views, frame.options);
  } else {
    store_.Prepare(views, frame.options);
  }
  if (frame.on_processor) {
    sampled_.Prepare(views, frame.options);
  } else {
    PutTextures(frame, views);
  }
  for (const View* view : views) used_[view] = {BytesOf(*view), now_};
}

bool GpuViews::HasSamples(const Frame& frame, const View& view) {
  return frame.on_processor ? sampled_.Of(view).columns > 0 : store_.DeferredOf(view) != nullptr;
}

void GpuViews::DropUnused(const Frame& frame, const View& view) {
  if (frame.on_processor) {
    store_.Drop(view);
  } else {
    store_.DropUnusedBy(frame.options, view);
    sampled_.Drop(view);
  }
  if (!frame.deferred()) meshes_.Drop(view);
  used_[&view].bytes = BytesOf(view);
}

size_t GpuViews::Prepare(Frame& frame, const std::vector<const View*>& nearest_first) {
  try {
    return PutWithinRoom(frame, nearest_first);
  } catch (...) {
    Clear();  // what was put there by half must not be taken for whole
    throw;
  }
}

bool GpuViews::AllFit(const Frame& frame) const {
  const LayerSizes sizes = SizesFor(frame);
  size_t most = 0;
  for (const View* view : frame.views) most += MostBytesOf(*view, frame.options, sizes);
  return most <= room_bytes_;
}

size_t GpuViews::PutWithinRoom(Frame& frame, const std::vector<const View*>& nearest_first) {
  now_ += 2;
  sizes_ = SizesFor(frame);
  for (const View* view : nearest_first) {
    const auto found = used_.find(view);
    if (found != used_.end()) found->second.last = now_ - 1;  // others go first
  }
  if (AllFit(frame)) {  // made on all cores
    Put(frame, nearest_first);
    for (const View* view : nearest_first) {
      if (bytes() > room_bytes_) DropUnused(frame, *view);
    }
    while (bytes() > room_bytes_ && DropOldest()) {
    }
    return nearest_first.size();
  }
  size_t fitting = 0;
  for (const View* view : nearest_first) {
    Put(frame, {view});
    DropUnused(frame, *view);
    while (bytes() > room_bytes_ && DropOldest()) {
    }
    if (bytes() > room_bytes_ && fitting > 0) break;
    ++fitting;
  }
  for (size_t k = fitting; k < nearest_first.size(); ++k) {
    if (used_.contains(nearest_first[k])) Drop(*nearest_first[k]);
    const auto at = std::find(frame.views.begin(), frame.views.end(), nearest_first[k]);
    frame.Erase(static_cast<size_t>(at - frame.views.begin()));
  }
  return fitting;
}

}  // namespace dtr::gl
