// dtr/gl/view_store.h -- what lies on the GPU of each view: its geometry and its image, put there
// when the view is first drawn. Only dtr/gl's own .cpp files include this.
#pragma once
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <tuple>
#include <vector>

#include "dtr/gl/objects.h"
#include "dtr/gl/texture_arrays.h"
#include "dtr/gl/view_mesh.h"
#include "dtr/render/scene.h"

namespace dtr::gl {

/// A view's triangles or splats, ready to draw.
struct Geometry {
  VertexArray array;
  Buffer points, indices;
  GLsizei index_count = 0;
  size_t bytes = 0;  ///< on the GPU
};

class ViewStore {
 public:
  /// The geometry for these options; made at the first call with them. A view keeps one mesh and
  /// one set of splats: other thresholds or another resolution replace them.
  const Geometry& GeometryOf(const View& view, const RenderOptions& options);

  /// Makes the meshes or splats of several views at once, on all cores.
  void Prepare(const std::vector<const View*>& views, const RenderOptions& options);

  /// How long a new texture array should be where a view needs one.
  using LayersFor = std::function<int(const View&)>;

  /// SPEC 5: the depths of the deferred method.
  void PrepareDeferred(const std::vector<const View*>& views, const RenderOptions& options,
                       const LayerSizes& sizes, const LayersFor& new_layers);
  struct Deferred {
    ImageSlot depth;
    double depth_offset = 0, depth_factor = 1;        ///< StoredDepth: 1/z from a texel
    double largest_bits = 1;                          ///< what a texel of 1 stands for as a number
    int columns = 0, rows = 0, step = 1, offset = 0;  ///< of the grid of samples
  };
  /// After PrepareDeferred with the same options; null where R leaves no sample.
  const Deferred* DeferredOf(const View& view);

  void PrepareImages(const std::vector<const View*>& views, const LayerSizes& sizes,
                     const LayersFor& new_layers);
  /// After PrepareImages.
  ImageSlot ImageOf(const View& view) { return Find(view).image.value(); }
  /// Of the layer that an image lies in, which may be larger.
  LayerSize SizeOf(const ImageSlot& slot) const { return arrays_.SizeOf(slot); }
  GLuint texture_array(int index) const { return arrays_.name(index); }

  /// What lies on the GPU of a view.
  size_t BytesOf(const View& view) const;
  void Drop(const View& view);
  /// Drops what was made of the view for other methods and primitives.
  void DropUnusedBy(const RenderOptions& options, const View& view);
  void Clear();

 private:
  /// Everything of the options that a geometry depends on.
  using GeometryKey = std::tuple<Primitive, int, double, std::optional<double>>;
  struct Stored {
    const void *image_data = nullptr, *depth_data = nullptr;
    std::map<Primitive, std::pair<GeometryKey, Geometry>> geometry;
    std::optional<ImageSlot> image;
    std::optional<std::pair<GeometryKey, Deferred>> deferred;
  };
  Stored& Find(const View& view);
  static GeometryKey KeyOf(const RenderOptions& options);
  struct PixelFormat {
    GLenum stored, given, type;
    int channels;
  };
  template <typename T>
  ImageSlot Put(const View& view, const T* values, const PixelFormat& format, const LayerSize& size,
                const LayerSizes& sizes, const LayersFor& new_layers);
  void Empty(Stored& stored);
  void DropDepth(Stored& stored);

  std::map<const View*, Stored> views_;
  TextureArrays arrays_;
};

}  // namespace dtr::gl
