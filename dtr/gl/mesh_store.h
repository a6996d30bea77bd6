// dtr/gl/mesh_store.h -- the views' reduced meshes on the GPU (SPEC 5.1). Only dtr/gl's own .cpp
// files include this.
#pragma once
#include <cstddef>
#include <map>
#include <vector>

#include "dtr/gl/objects.h"
#include "dtr/render/mesh_cache.h"

namespace dtr::gl {

/// A view's reduced mesh, ready for coarse_triangles.comp and coarse_cells.comp.
struct CoarseMesh {
  Buffer triangles;  ///< three AdaptiveMesh::Vertex each
  Buffer cells;      ///< AdaptiveMesh::Cell
  size_t bytes = 0;  ///< on the GPU
};

/// A MeshCache whose triangles and cells lie on the GPU; in memory are grids and tiles alone.
class MeshStore {
 public:
  /// As MeshCache.
  explicit MeshStore(MeshCache::Warn warn);
  MeshStore(const MeshStore&) = delete;
  MeshStore& operator=(const MeshStore&) = delete;

  /// As MeshCache; also throws dtr::Error, naming the limit, for a mesh that the driver cannot
  /// hold.
  void Prepare(const std::vector<const View*>& views, const RenderOptions& options) {
    cache_.Prepare(views, options);
  }

  /// After Prepare.
  const CoarseMesh& MeshOf(const View& view) const { return meshes_.at(&view); }
  const AdaptiveMesh& LayoutOf(const View& view) const { return cache_.MeshOf(view); }

  size_t BytesOf(const View& view) const;
  void Drop(const View& view);
  void Clear();

 private:
  std::map<const View*, CoarseMesh> meshes_;
  MeshCache cache_;
};

}  // namespace dtr::gl
