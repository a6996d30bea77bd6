#include "dtr/gl/mesh_store.h"

#include <cstdint>
#include <stdexcept>
#include <string>

#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"
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
                "; use `renderer` cpu, a larger `mesh_tolerance` or a larger `resolution`");
  }
  Buffer buffer = Buffer::Make();
  glBindBuffer(GL_SHADER_STORAGE_BUFFER, buffer.name());
  glBufferData(GL_SHADER_STORAGE_BUFFER, static_cast<GLsizeiptr>(size), values.data(),
               GL_STATIC_DRAW);
  ThrowOnError(view.name + ": its reduced mesh");
  bytes += size;
  return buffer;
}

}  // namespace

MeshStore::Key MeshStore::KeyOf(const View& view, const RenderOptions& options) {
  return {options.resolution, MeshRuleOf(view, options), view.depth.grid().data().data()};
}

void MeshStore::Prepare(const std::vector<const View*>& views, const RenderOptions& options) {
  std::vector<const View*> missing;
  for (const View* view : views) {
    if (Has(*view, options)) {
      views_.at(view).key.depth_data = view->depth.grid().data().data();
    } else if (view->depth.empty()) {
      throw std::logic_error(view->name + ": neither its depth is there nor its mesh");
    } else {
      missing.push_back(view);
    }
  }
  std::vector<AdaptiveMesh> meshes(missing.size());
  std::vector<std::string> unfit(missing.size());
  // One view alone has all cores; of several each has one.
  const int threads_each = missing.size() > 1 ? 1 : options.threads;
  ParallelFor(0, static_cast<int>(missing.size()), options.threads, [&](int i) {
    const auto k = static_cast<size_t>(i);
    meshes[k] = MakeAdaptiveMesh(*missing[k], options, threads_each, unfit[k]);
  });
  for (size_t k = 0; k < missing.size(); ++k) {
    if (unfit[k].empty()) continue;
    warn_("WARNING: " + missing[k]->name +
          ": its stored mesh does not fit its depth map and was made again: " + unfit[k]);
  }
  for (size_t k = 0; k < missing.size(); ++k) {
    Stored stored{KeyOf(*missing[k], options), {}};
    CoarseMesh& mesh = stored.mesh;
    if (for_shaders_) {
      mesh.triangles = Upload(*missing[k], Corners(meshes[k]), mesh.bytes);
      mesh.cells = Upload(*missing[k], meshes[k].cells, mesh.bytes);
      meshes[k].vertices = {}, meshes[k].indices = {}, meshes[k].cells = {};
    }
    mesh.mesh = std::move(meshes[k]);
    views_.insert_or_assign(missing[k], std::move(stored));
  }
}

bool MeshStore::Has(const View& view, const RenderOptions& options) const {
  const auto found = views_.find(&view);
  if (found == views_.end()) return false;
  Key wanted = KeyOf(view, options);
  const void* const stored = found->second.key.depth_data;
  if (view.depth.empty() || stored == nullptr) wanted.depth_data = stored;
  return found->second.key == wanted;
}

size_t MeshStore::BytesOf(const View& view) const {
  const auto found = views_.find(&view);
  return found == views_.end() ? 0 : found->second.mesh.bytes;
}

}  // namespace dtr::gl
