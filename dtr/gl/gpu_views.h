// dtr/gl/gpu_views.h -- the views that lie on the GPU, within a number of bytes. Only dtr/gl's own
// .cpp files include this.
#pragma once
#include <cstddef>
#include <vector>

#include "dtr/gl/mesh_store.h"
#include "dtr/gl/view_store.h"
#include "dtr/render/views_within_room.h"

namespace dtr::gl {

/// Puts on the GPU what frames are drawn from. What counts is what views use: geometry, meshes, and
/// their layers of texture arrays. The arrays are as long as views of one size fit, so their empty
/// layers are room for the next views.
class GpuViews final : public ViewsWithinRoom {
 public:
  GpuViews(size_t room_bytes, MeshCache::Warn warn)
      : ViewsWithinRoom(room_bytes), meshes_(std::move(warn)) {}

  ViewStore& store() { return store_; }
  const MeshStore& meshes() const { return meshes_; }

 private:
  void Begin(const RenderFrame& frame) override;
  void Put(const RenderFrame& frame, const std::vector<const View*>& views) override;
  void DropUnused(const RenderFrame& frame, const View& view) override;
  void DropView(const View& view) override;
  void DropAll() override;
  size_t BytesOf(const View& view) const override {
    return store_.BytesOf(view) + meshes_.BytesOf(view);
  }
  size_t MostBytesOf(const RenderFrame& frame) const override;
  void PutTextures(const RenderFrame& frame, const std::vector<const View*>& views);
  /// As many views of this view's size as the scene has and the room holds.
  int LayersFor(const RenderFrame& frame, const View& view);

  LayerSizes sizes_;  ///< of the present frame's scene: the same for each of its cameras
  ViewStore store_;
  MeshStore meshes_;
};

}  // namespace dtr::gl
