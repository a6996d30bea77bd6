// dtr/gl/gpu_views.h -- the views that lie on the GPU, within a number of bytes. Only dtr/gl's own
// .cpp files include this.
#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "dtr/gl/frame.h"
#include "dtr/gl/mesh_store.h"
#include "dtr/gl/sampled_views.h"
#include "dtr/gl/view_store.h"

namespace dtr::gl {

/// Puts on the GPU what images are drawn from; the views used longest ago make room. What counts
/// is what views use: geometry, meshes, and their layers of texture arrays. The arrays are as long
/// as views of one size fit, so their empty layers are room for the next views.
class GpuViews {
 public:
  /// `meshes_for_shaders` and `warn` as MeshStore; else meshes take no room on the GPU.
  GpuViews(size_t room_bytes, bool meshes_for_shaders, MeshStore::Warn warn)
      : room_bytes_(room_bytes), meshes_(meshes_for_shaders, std::move(warn)) {}

  /// Puts there what the frame's method draws of its views, nearest first; those that do not fit
  /// beside nearer ones leave the frame (at least one view stays). This depends on the views and
  /// the bytes alone, not on what was drawn before. While a view is put there, it may lie beside as
  /// much as fits. Returns how many views fit.
  size_t Prepare(Frame& frame, const std::vector<const View*>& nearest_first);

  size_t bytes() const;
  ViewStore& store() { return store_; }
  const MeshStore& meshes() const { return meshes_; }
  /// Of frames that are drawn on the processor; counted as what lies on the GPU, for it takes the
  /// place of that.
  const SampledViews& sampled() const { return sampled_; }
  /// After Prepare, for the deferred method: false where R leaves no sample of the view.
  bool HasSamples(const Frame& frame, const View& view);
  /// True when all of the frame's views fit, whatever they look like: none makes room for another.
  bool AllFit(const Frame& frame) const;
  /// Of a frame that the processor draws and that fits: true when no pixels of the view are needed.
  bool HoldsFor(const RenderOptions& options, const View& view) const {
    return sampled_.Has(view, options) && meshes_.Has(view, options);
  }
  void Clear();

 private:
  struct Used {
    size_t bytes = 0;
    std::uint64_t last = 0;  ///< number of the frame; odd: a frame will use it again
  };

  size_t PutWithinRoom(Frame& frame, const std::vector<const View*>& nearest_first);
  void Put(const Frame& frame, const std::vector<const View*>& views);
  void PutTextures(const Frame& frame, const std::vector<const View*>& views);
  size_t BytesOf(const View& view) {
    return store_.BytesOf(view) + meshes_.BytesOf(view) + sampled_.BytesOf(view);
  }
  /// As many views of this view's size as the scene has and the room holds.
  int LayersFor(const Frame& frame, const View& view);
  bool DropOldest();
  void Drop(const View& view);
  void DropUnused(const Frame& frame, const View& view);

  const size_t room_bytes_;
  LayerSizes sizes_;  ///< of the present frame's scene: the same for each of its cameras
  ViewStore store_;
  MeshStore meshes_;
  SampledViews sampled_;
  std::map<const View*, Used> used_;  ///< the views on the GPU
  std::uint64_t now_ = 0;
};

}  // namespace dtr::gl
