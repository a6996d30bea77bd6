#include "dtr/gl/view_store.h"

#include <algorithm>

#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"
#include "dtr/gl/coarse_surface.h"
#include "dtr/render/triangulation.h"

namespace dtr::gl {
namespace {

// An array texture takes its memory at once on some drivers; a larger one would be refused whole.
constexpr GLsizeiptr kMaxArrayBytes = GLsizeiptr{1} << 30;
constexpr int kFloatsPerPoint = 3, kFloatsPerSplat = 5, kFloatsPerBlock = 7;
// What a block may differ from the depth map it stands for, in pixels of disparity: the refinement
// (SPEC 5.2) takes it back.
constexpr double kFlatnessPx = 0.5;

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
  ThrowOnError(view.name + ": its mesh");
  return geometry;
}

/// Floats for shaders to read.
Buffer UploadStorage(const View& view, const std::vector<float>& values) {
  const auto bytes = static_cast<GLsizeiptr>(values.size() * sizeof(float));
  GLint64 limit = 0;
  glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &limit);
  if (bytes > limit) {
    throw Error(view.name + ": expected surface samples within this driver's storage block of " +
                std::to_string(limit) + " bytes, found " + std::to_string(bytes) +
                "; use --renderer cpu or a larger --resolution");
  }
  Buffer buffer = Buffer::Make();
  glBindBuffer(GL_SHADER_STORAGE_BUFFER, buffer.name());
  glBufferData(GL_SHADER_STORAGE_BUFFER, bytes, values.data(), GL_STATIC_DRAW);
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
  ThrowOnError(view.name + ": its splats");
  return geometry;
}

/// RGB and, as alpha, whether the pixel is usable.
std::vector<std::uint8_t> Rgba(const View& view) {
  const size_t pixels = view.image.data().size() / 3;
  std::vector<std::uint8_t> rgba(4 * pixels);
  for (size_t p = 0; p < pixels; ++p) {
    for (size_t c = 0; c < 3; ++c) rgba[4 * p + c] = view.image.data()[3 * p + c];
    rgba[4 * p + 3] = view.mask.empty() || view.mask.data()[p] != 0 ? 255 : 0;
  }
  return rgba;
}

}  // namespace

void ViewStore::Clear() {
  views_.clear();
  arrays_.clear();
}

ViewStore::Stored& ViewStore::Find(const View& view) {
  Stored& stored = views_[&view];
  const void *image = view.image.data().data(), *depth = view.depth.grid().data().data();
  if (stored.image_data != image || stored.depth_data != depth) {
    stored = Stored{};
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
  ParallelFor(0, static_cast<int>(missing.size()), options.threads, [&](int i) {
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

void ViewStore::PrepareDeferred(const std::vector<const View*>& views,
                                const RenderOptions& options) {
  const GeometryKey key = KeyOf(options);
  std::vector<const View*> missing;
  for (const View* view : views) {
    const auto& deferred = Find(*view).deferred;
    if (!deferred || deferred->first != key) missing.push_back(view);
  }
  std::vector<SampleGrid> grids(missing.size());
  std::vector<CoarseSurface> surfaces(missing.size());
  RenderOptions tolerance = options;
  tolerance.depth_break_px = kFlatnessPx;
  ParallelFor(0, static_cast<int>(missing.size()), options.threads, [&](int i) {
    const auto k = static_cast<size_t>(i);
    const View& view = *missing[k];
    grids[k] = MakeSampleGrid(view, options.resolution);
    surfaces[k] = MakeCoarseSurface(
        grids[k], {ThresholdsOf(view, options).depth_break, options.absolute_depth_break},
        ThresholdsOf(view, tolerance).depth_break);
  });
  for (size_t k = 0; k < missing.size(); ++k) {
    const View& view = *missing[k];
    const Grid<double>& w = grids[k].inverse_depth;
    Stored& stored = Find(view);
    Deferred deferred;
    deferred.columns = w.width(), deferred.rows = w.height();
    deferred.step = grids[k].step, deferred.offset = grids[k].offset;
    if (!w.empty()) {
      deferred.coarse.blocks = UploadStorage(view, surfaces[k].blocks);
      deferred.coarse.splats = UploadStorage(view, surfaces[k].splats);
      deferred.coarse.block_count = static_cast<int>(surfaces[k].blocks.size()) / kFloatsPerBlock;
      deferred.coarse.splat_count = static_cast<int>(surfaces[k].splats.size()) / kFloatsPerSplat;
      // Another break threshold keeps its slot; another resolution has a grid of another size.
      const bool same_size = stored.deferred && stored.deferred->second.columns == w.width() &&
                             stored.deferred->second.rows == w.height();
      deferred.depth =
          same_size ? stored.deferred->second.depth
                    : NewSlot(GL_R32F, w.width(), w.height(), static_cast<int>(views.size()));
      const std::vector<float> values(w.data().begin(), w.data().end());
      glBindTexture(GL_TEXTURE_2D_ARRAY, texture_array(deferred.depth.array));
      glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, deferred.depth.layer, w.width(), w.height(), 1,
                      GL_RED, GL_FLOAT, values.data());
      ThrowOnError(view.name + ": its depth");
    }
    stored.deferred.emplace(key, std::move(deferred));
    grids[k] = {};
    surfaces[k] = {};
  }
}

const ViewStore::Deferred* ViewStore::DeferredOf(const View& view) {
  const auto& stored = Find(view).deferred;
  return stored && stored->second.columns > 0 ? &stored->second : nullptr;
}

ImageSlot ViewStore::NewSlot(GLenum format, int width_px, int height_px, int expected_views) {
  for (size_t i = 0; i < arrays_.size(); ++i) {
    ImageArray& array = arrays_[i];
    if (array.format == format && array.width_px == width_px && array.height_px == height_px &&
        array.used < array.layers) {
      return {static_cast<int>(i), array.used++};
    }
  }
  GLint max_layers = 0, max_size = 0;
  glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &max_layers);
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &max_size);
  if (width_px > max_size || height_px > max_size) {
    throw Error("OpenGL: expected images of at most " + std::to_string(max_size) +
                " pixels a side, found " + std::to_string(width_px) + "x" +
                std::to_string(height_px) + "; use --renderer cpu");
  }
  const GLsizeiptr layer_bytes = GLsizeiptr{4} * width_px * height_px;
  const auto by_bytes = static_cast<int>(std::max<GLsizeiptr>(1, kMaxArrayBytes / layer_bytes));
  ImageArray array{Texture::Make(),
                   format,
                   width_px,
                   height_px,
                   std::min({std::max(expected_views, 1), max_layers, by_bytes}),
                   1};
  glBindTexture(GL_TEXTURE_2D_ARRAY, array.texture.name());
  glTexStorage3D(GL_TEXTURE_2D_ARRAY, 1, format, width_px, height_px, array.layers);
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  ThrowOnError("room for " + std::to_string(array.layers) + " images");
  arrays_.push_back(std::move(array));
  return {static_cast<int>(arrays_.size()) - 1, 0};
}

ImageSlot ViewStore::ImageOf(const View& view, int expected_views) {
  Stored& stored = Find(view);
  if (stored.image) return *stored.image;
  const int width = view.image.width(), height = view.image.height();
  stored.image = NewSlot(GL_SRGB8_ALPHA8, width, height, expected_views);
  const std::vector<std::uint8_t> rgba = Rgba(view);
  glBindTexture(GL_TEXTURE_2D_ARRAY, texture_array(stored.image->array));
  glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, stored.image->layer, width, height, 1, GL_RGBA,
                  GL_UNSIGNED_BYTE, rgba.data());
  ThrowOnError(view.name + ": its image");
  return *stored.image;
}

}  // namespace dtr::gl
