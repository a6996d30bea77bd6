#include "dtr/gl/view_store.h"

#include <algorithm>

#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"
#include "dtr/gl/driver.h"
#include "dtr/gl/packed_depth.h"
#include "dtr/render/stored_depth.h"
#include "dtr/render/texture.h"
#include "dtr/render/triangulation.h"

namespace dtr::gl {
namespace {

constexpr int kFloatsPerPoint = 3, kFloatsPerSplat = 5;

Geometry UploadMesh(const View& view, const ViewMesh& mesh) {
  Geometry geometry;
  geometry.array = VertexArray::Make();
  geometry.points = Buffer::Make();
  geometry.indices = Buffer::Make();
  glBindVertexArray(geometry.array.name());
  glBindBuffer(GL_ARRAY_BUFFER, geometry.points.name());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(mesh.points.size() * sizeof(float)),
               mesh.points.data(), GL_STATIC_DRAW);
  glEnableVertexAttribArray(0);
  glVertexAttribPointer(0, kFloatsPerPoint, GL_FLOAT, GL_FALSE, 0, nullptr);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, geometry.indices.name());
  glBufferData(GL_ELEMENT_ARRAY_BUFFER,
               static_cast<GLsizeiptr>(mesh.indices.size() * sizeof(std::uint32_t)),
               mesh.indices.data(), GL_STATIC_DRAW);
  geometry.index_count = static_cast<GLsizei>(mesh.indices.size());
  geometry.bytes = mesh.points.size() * sizeof(float) + mesh.indices.size() * sizeof(std::uint32_t);
  ThrowOnError(view.name + ": its mesh");
  return geometry;
}

/// Floats for shaders to read.
Buffer UploadStorage(const View& view, const std::vector<float>& values) {
  const size_t bytes = values.size() * sizeof(float), limit = MostStorageBytes();
  if (bytes > limit) {
    throw Error(view.name + ": expected surface samples within this driver's storage block of " +
                std::to_string(limit) + " bytes, found " + std::to_string(bytes) +
                "; use `renderer` cpu or a larger `resolution`");
  }
  Buffer buffer = Buffer::Make();
  glBindBuffer(GL_SHADER_STORAGE_BUFFER, buffer.name());
  glBufferData(GL_SHADER_STORAGE_BUFFER, static_cast<GLsizeiptr>(bytes), values.data(),
               GL_STATIC_DRAW);
  ThrowOnError(view.name + ": its surface");
  return buffer;
}

Geometry UploadSplats(const View& view, const std::vector<float>& splats) {
  std::vector<std::uint32_t> indices;
  const auto count = static_cast<std::uint32_t>(splats.size() / kFloatsPerSplat);
  indices.reserve(6 * static_cast<size_t>(count));
  for (std::uint32_t i = 0; i < count; ++i) {
    for (const std::uint32_t corner : {0u, 1u, 3u, 0u, 3u, 2u}) indices.push_back(4 * i + corner);
  }
  Geometry geometry;
  geometry.array = VertexArray::Make();
  geometry.indices = Buffer::Make();
  glBindVertexArray(geometry.array.name());
  geometry.points = UploadStorage(view, splats);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, geometry.indices.name());
  glBufferData(GL_ELEMENT_ARRAY_BUFFER,
               static_cast<GLsizeiptr>(indices.size() * sizeof(std::uint32_t)), indices.data(),
               GL_STATIC_DRAW);
  geometry.index_count = static_cast<GLsizei>(indices.size());
  geometry.bytes = splats.size() * sizeof(float) + indices.size() * sizeof(std::uint32_t);
  ThrowOnError(view.name + ": its splats");
  return geometry;
}

}  // namespace

void ViewStore::Clear() {
  views_.clear();
  arrays_.Clear();
}

void ViewStore::Empty(Stored& stored) {
  if (stored.image) arrays_.Give(*stored.image);
  DropDepth(stored);
  stored = Stored{};
}

void ViewStore::DropDepth(Stored& stored) {
  if (stored.deferred && stored.deferred->second.columns > 0) {
    arrays_.Give(stored.deferred->second.depth);
  }
  stored.deferred.reset();
}

void ViewStore::DropUnusedBy(const RenderOptions& options, const View& view) {
  const bool deferred = options.method == RenderMethod::kDeferred;
  Stored& stored = Find(view);
  if (!deferred) DropDepth(stored);
  std::erase_if(stored.geometry, [&](const auto& geometry) {
    return deferred || geometry.first != options.primitive;
  });
}

void ViewStore::Drop(const View& view) {
  const auto found = views_.find(&view);
  if (found == views_.end()) return;
  Empty(found->second);
  views_.erase(found);
}

size_t ViewStore::BytesOf(const View& view) const {
  const auto found = views_.find(&view);
  if (found == views_.end()) return 0;
  const Stored& stored = found->second;
  size_t bytes = 0;
  for (const auto& [primitive, geometry] : stored.geometry) bytes += geometry.second.bytes;
  if (stored.image) bytes += arrays_.LayerBytes(*stored.image);
  if (stored.deferred && stored.deferred->second.columns > 0) {
    bytes += arrays_.LayerBytes(stored.deferred->second.depth);
  }
  return bytes;
}

ViewStore::Stored& ViewStore::Find(const View& view) {
  Stored& stored = views_[&view];
  const void *image = view.image.data().data(), *depth = view.depth.grid().data().data();
  if (stored.image_data != image || stored.depth_data != depth) {
    Empty(stored);
    stored.image_data = image;
    stored.depth_data = depth;
  }
  return stored;
}

ViewStore::GeometryKey ViewStore::KeyOf(const RenderOptions& options) {
  return {options.primitive, options.resolution, options.depth_break_px,
          options.absolute_depth_break};
}

void ViewStore::Prepare(const std::vector<const View*>& views, const RenderOptions& options) {
  const GeometryKey key = KeyOf(options);
  std::vector<const View*> missing;
  for (const View* view : views) {
    const auto& geometry = Find(*view).geometry;
    const auto found = geometry.find(options.primitive);
    if (found == geometry.end() || found->second.first != key) missing.push_back(view);
  }
  const bool splats = options.primitive == Primitive::kSplat;
  std::vector<ViewMesh> lists(missing.size());
  ParallelFor(0, static_cast<int>(missing.size()), [&](int i) {
    const auto k = static_cast<size_t>(i);
    if (splats) {
      lists[k].points = MakeSplats(*missing[k], options);
    } else {
      lists[k] = MakeViewMesh(*missing[k], options);
    }
  });
  for (size_t k = 0; k < missing.size(); ++k) {
    Find(*missing[k])
        .geometry.insert_or_assign(
            options.primitive, std::pair(key, splats ? UploadSplats(*missing[k], lists[k].points)
                                                     : UploadMesh(*missing[k], lists[k])));
    lists[k] = {};
  }
}

const Geometry& ViewStore::GeometryOf(const View& view, const RenderOptions& options) {
  Prepare({&view}, options);
  return Find(view).geometry.at(options.primitive).second;
}

void ViewStore::PrepareDeferred(const std::vector<const View*>& views, const RenderOptions& options,
                                const LayerSizes& sizes, const LayersFor& new_layers) {
  const GeometryKey key = KeyOf(options);
  std::vector<const View*> missing;
  for (const View* view : views) {
    const auto& deferred = Find(*view).deferred;
    const bool there =
        deferred && deferred->first == key &&
        (deferred->second.columns == 0 ||
         SizeOf(deferred->second.depth) ==
             sizes.LayerFor(PackedDepthSize(deferred->second.columns, deferred->second.rows)));
    if (!there) missing.push_back(view);
  }
  std::vector<SampleGrid> grids(missing.size());
  std::vector<StoredDepth> depths(missing.size());
  ParallelFor(0, static_cast<int>(missing.size()), [&](int i) {
    const auto k = static_cast<size_t>(i);
    const View& view = *missing[k];
    grids[k] = MakeSampleGrid(view, options.resolution);
    depths[k] = StoreDepth(view, grids[k]);
    const BreakRule breaks = BreakRuleOf(view, options);
    StoredDepth& depth = depths[k];
    if (!depth.codes.empty()) depth.codes = PackedDepth(depth.codes, grids[k], breaks);
    if (!depth.values.empty()) depth.values = PackedDepth(depth.values, grids[k], breaks);
  });
  for (size_t k = 0; k < missing.size(); ++k) {
    const View& view = *missing[k];
    const Grid<double>& w = grids[k].inverse_depth;
    Stored& stored = Find(view);
    DropDepth(stored);
    Deferred deferred;
    deferred.columns = w.width(), deferred.rows = w.height();
    deferred.step = grids[k].step, deferred.offset = grids[k].offset;
    if (!w.empty()) {
      const bool coded = !depths[k].codes.empty();
      deferred.depth_offset = depths[k].offset, deferred.depth_factor = depths[k].factor;
      const LayerSize size = PackedDepthSize(w.width(), w.height());
      if (coded) {
        deferred.largest_bits = UINT16_MAX;
        deferred.depth = Put(view, depths[k].codes.data(), {GL_R16, GL_RED, GL_UNSIGNED_SHORT, 1},
                             size, sizes, new_layers);
      } else {
        deferred.depth = Put(view, depths[k].values.data(), {GL_R32F, GL_RED, GL_FLOAT, 1}, size,
                             sizes, new_layers);
      }
    }
    stored.deferred.emplace(key, deferred);
    grids[k] = {};
    depths[k] = {};
  }
}

const ViewStore::Deferred* ViewStore::DeferredOf(const View& view) {
  const auto& stored = Find(view).deferred;
  return stored && stored->second.columns > 0 ? &stored->second : nullptr;
}

void ViewStore::PrepareImages(const std::vector<const View*>& views, const LayerSizes& sizes,
                              const LayersFor& new_layers) {
  for (const View* view : views) {
    Stored& stored = Find(*view);
    const LayerSize size{view->image.width(), view->image.height()};
    if (stored.image && SizeOf(*stored.image) == sizes.LayerFor(size)) continue;
    if (stored.image) arrays_.Give(*stored.image);
    stored.image.reset();
    stored.image = Put(*view, SampledImage(*view).data(), {GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, 4},
                       size, sizes, new_layers);
  }
}

template <typename T>
ImageSlot ViewStore::Put(const View& view, const T* values, const PixelFormat& format,
                         const LayerSize& size, const LayerSizes& sizes,
                         const LayersFor& new_layers) {
  const LayerSize layer = sizes.LayerFor(size), taken = SizeWithEdge(size, layer);
  const ImageSlot slot =
      arrays_.Take(format.stored, layer.width_px, layer.height_px, new_layers(view));
  std::vector<T> with_edge;
  if (taken != size) with_edge = WithEdge(values, size, format.channels, taken);
  glBindTexture(GL_TEXTURE_2D_ARRAY, texture_array(slot.array));
  glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, slot.layer, taken.width_px, taken.height_px, 1,
                  format.given, format.type, taken == size ? values : with_edge.data());
  ThrowOnError(view.name + (format.channels == 1 ? ": its depth" : ": its image"));
  return slot;
}

}  // namespace dtr::gl
