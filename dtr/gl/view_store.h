// dtr/gl/view_store.h -- what lies on the GPU of each view: its geometry and its image, put there
// when the view is first drawn. Only dtr/gl's own .cpp files include this.
#pragma once
#include <map>
#include <memory>
#include <optional>
#include <tuple>
#include <vector>

#include "dtr/gl/objects.h"
#include "dtr/gl/view_mesh.h"
#include "dtr/render/scene.h"

namespace dtr::gl {

/// A view's triangles or splats, ready to draw.
struct Geometry {
  VertexArray array;
  Buffer points, indices;
  GLsizei index_count = 0;
};

/// SPEC 5: a view's coarse surface and full-resolution depth.
struct CoarseGeometry {
  Buffer blocks, splats;
  int block_count = 0, splat_count = 0;
};

/// Where a view's image or depth lies.
struct ImageSlot {
  int array = 0;  ///< index of a texture array of the store
  int layer = 0;
};

class ViewStore {
 public:
  /// The geometry for these options; made at the first call with them. A view keeps one mesh and
  /// one set of splats: other thresholds or another resolution replace them.
  const Geometry& GeometryOf(const View& view, const RenderOptions& options);

  /// Makes the meshes or splats of several views at once, on all cores.
  void Prepare(const std::vector<const View*>& views, const RenderOptions& options);

  /// SPEC 5: the same for the deferred method: coarse surfaces and depth arrays.
  void PrepareDeferred(const std::vector<const View*>& views, const RenderOptions& options);
  struct Deferred {
    CoarseGeometry coarse;
    ImageSlot depth;
    int columns = 0, rows = 0, step = 1, offset = 0;  ///< of the grid of samples
  };
  /// After PrepareDeferred with the same options; null where R leaves no sample.
  const Deferred* DeferredOf(const View& view);

  /// `expected_views`: how many views of this size may follow; sets the first array's length.
  ImageSlot ImageOf(const View& view, int expected_views);
  GLuint texture_array(int index) const {
    return arrays_[static_cast<size_t>(index)].texture.name();
  }
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
  struct ImageArray {
    Texture texture;
    GLenum format = GL_NONE;
    int width_px = 0, height_px = 0, layers = 0, used = 0;
  };

  Stored& Find(const View& view);
  static GeometryKey KeyOf(const RenderOptions& options);
  ImageSlot NewSlot(GLenum format, int width_px, int height_px, int expected_views);

  std::map<const View*, Stored> views_;
  std::vector<ImageArray> arrays_;
};

}  // namespace dtr::gl
