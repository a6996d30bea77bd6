// dtr/gl/mesh_store.h -- the views' reduced meshes on the GPU (SPEC 5.1). Only dtr/gl's own .cpp
// files include this.
#pragma once
#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "dtr/gl/objects.h"
#include "dtr/render/adaptive_mesh.h"
#include "dtr/render/options.h"
#include "dtr/types/view.h"

namespace dtr::gl {

/// A view's reduced mesh, ready for CoarseRaster or for coarse_triangles.comp and
/// coarse_cells.comp.
struct CoarseMesh {
  Buffer triangles;   ///< three AdaptiveMesh::Vertex each
  Buffer cells;       ///< AdaptiveMesh::Cell
  AdaptiveMesh mesh;  ///< where shaders draw it only its grid and its tiles: the rest is above
  size_t bytes = 0;   ///< on the GPU
};

/// Keeps one mesh per view; other options replace it.
class MeshStore {
 public:
  using Warn = std::function<void(const std::string&)>;

  /// `for_shaders`: on the GPU; else in memory, for CoarseRaster. `warn` is told of stored meshes
  /// that are of no use.
  MeshStore(bool for_shaders, Warn warn) : for_shaders_(for_shaders), warn_(std::move(warn)) {}

  /// Makes the missing meshes of several views, on all cores. Throws dtr::Error, naming the limit,
  /// for a mesh that the driver cannot hold. A view without pixels needs to have one
  /// (std::logic_error), which stays when they come back.
  void Prepare(const std::vector<const View*>& views, const RenderOptions& options);

  /// After Prepare.
  const CoarseMesh& MeshOf(const View& view) const { return views_.at(&view).mesh; }

  /// True when nothing would be made of its pixels.
  bool Has(const View& view, const RenderOptions& options) const;

  size_t BytesOf(const View& view) const;
  void Drop(const View& view) { views_.erase(&view); }
  void Clear() { views_.clear(); }

 private:
  struct Key {
    int resolution = 0;
    MeshRule rule;
    /// Null after a frame in which the pixels were not there: those that come back are the same.
    const void* depth_data = nullptr;
    bool operator==(const Key&) const = default;
  };
  struct Stored {
    Key key;
    CoarseMesh mesh;
  };
  static Key KeyOf(const View& view, const RenderOptions& options);

  const bool for_shaders_;
  const Warn warn_;
  std::map<const View*, Stored> views_;
};

}  // namespace dtr::gl
