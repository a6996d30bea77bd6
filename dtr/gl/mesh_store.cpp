#include "dtr/gl/mesh_store.h"

#include <cstdint>
#include <string>
#include <utility>

#include "dtr/base/error.h"
#include "dtr/gl/driver.h"

namespace dtr::gl {
namespace {

// As coarse_triangles.comp and coarse_cells.comp read them.
static_assert(sizeof(AdaptiveMesh::Vertex) == 8 && sizeof(AdaptiveMesh::Cell) == 16);

/// Every triangle with its own corners: shaders of software rasterisers fetch lane by lane, and
/// indices would be half of the fetches; for so few triangles they would save a third of the bytes.
std::vector<AdaptiveMesh::Vertex> Corners(const AdaptiveMesh& mesh) {
  std::vector<AdaptiveMesh::Vertex> corners;
  corners.reserve(mesh.indices.size());
  for (const std::uint32_t index : mesh.indices) corners.push_back(mesh.vertices[index]);
  return corners;
}

template <typename T>
Buffer Upload(const View& view, const std::vector<T>& values, size_t& bytes) {
  const size_t size = values.size() * sizeof(T);
  const size_t limit = MostStorageBytes();
  if (size > limit) {
    throw Error(view.name + ": expected a reduced mesh within this driver's storage block of " +
                std::to_string(limit) + " bytes, found " + std::to_string(size) +
                "; use `renderer` cpu or simd, a larger `mesh_tolerance` or a larger `resolution`");
  }
  Buffer buffer = Buffer::Make();
  glBindBuffer(GL_SHADER_STORAGE_BUFFER, buffer.name());
  glBufferData(GL_SHADER_STORAGE_BUFFER, static_cast<GLsizeiptr>(size), values.data(),
               GL_STATIC_DRAW);
  ThrowOnError(view.name + ": its reduced mesh");
  bytes += size;
  return buffer;
}

CoarseMesh Uploaded(const View& view, const AdaptiveMesh& mesh) {
  CoarseMesh uploaded;
  uploaded.triangles = Upload(view, Corners(mesh), uploaded.bytes);
  uploaded.cells = Upload(view, mesh.cells, uploaded.bytes);
  return uploaded;
}

}  // namespace

MeshStore::MeshStore(MeshCache::Warn warn)
    : cache_(std::move(warn), [this](const View& view, AdaptiveMesh& mesh) {
        meshes_.insert_or_assign(&view, Uploaded(view, mesh));
        mesh.vertices = {}, mesh.indices = {}, mesh.cells = {};
      }) {}

size_t MeshStore::BytesOf(const View& view) const {
  const auto found = meshes_.find(&view);
  return found == meshes_.end() ? 0 : found->second.bytes;
}

void MeshStore::Drop(const View& view) {
  cache_.Drop(view);
  meshes_.erase(&view);
}

void MeshStore::Clear() {
  cache_.Clear();
  meshes_.clear();
}

}  // namespace dtr::gl
