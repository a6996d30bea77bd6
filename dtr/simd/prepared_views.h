// dtr/simd/prepared_views.h -- what the renderer made of its views, within a number of bytes. Only
// dtr/simd's own .cpp files include this.
#pragma once
#include <cstddef>
#include <utility>
#include <vector>

#include "dtr/render/mesh_cache.h"
#include "dtr/render/views_within_room.h"
#include "dtr/simd/sampled_views.h"

namespace dtr::simd {

/// A view's samples, image and reduced mesh.
class PreparedViews final : public ViewsWithinRoom {
 public:
  PreparedViews(size_t room_bytes, MeshCache::Warn warn)
      : ViewsWithinRoom(room_bytes), meshes_(std::move(warn)) {}

  const MeshCache& meshes() const { return meshes_; }
  const SampledViews& sampled() const { return sampled_; }
  /// After Prepare: false where R leaves no sample of the view.
  bool HasSamples(const View& view) const { return sampled_.Of(view).columns > 0; }
  /// Of a frame whose views all fit: true when no pixels of the view are needed.
  bool HoldsFor(const RenderOptions& options, const View& view) const {
    return sampled_.Has(view, options) && meshes_.Has(view, options);
  }

 private:
  void Put(const RenderFrame& frame, const std::vector<const View*>& views) override;
  void DropView(const View& view) override;
  void DropAll() override;
  size_t BytesOf(const View& view) const override;
  size_t MostBytesOf(const RenderFrame& frame) const override;

  MeshCache meshes_;
  SampledViews sampled_;
};

}  // namespace dtr::simd
