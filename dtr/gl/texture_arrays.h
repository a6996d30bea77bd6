// dtr/gl/texture_arrays.h -- layers of texture arrays, one array for images of one size. Only
// dtr/gl's own .cpp files include this.
#pragma once
#include <cstddef>
#include <vector>

#include "dtr/gl/layer_sizes.h"
#include "dtr/gl/objects.h"

namespace dtr::gl {

/// Where a view's image or depth lies.
struct ImageSlot {
  int array = 0;  ///< index of a texture array
  int layer = 0;
};

/// Bytes of a pixel of GL_RGBA8, GL_R32F or GL_R16.
size_t BytesPerPixel(GLenum format);

class TextureArrays {
 public:
  /// A layer that nobody uses; where there is none, in a new array of `new_layers` (fewer where the
  /// driver's limits say so). Throws dtr::Error, naming the limit, for images that no array of
  /// this driver holds, and where the GPU's memory is full.
  ImageSlot Take(GLenum format, int width_px, int height_px, int new_layers);
  /// Gives a layer back; an array without a used one is deleted.
  void Give(const ImageSlot& slot);

  GLuint name(int array) const { return arrays_[static_cast<size_t>(array)].texture.name(); }
  size_t LayerBytes(const ImageSlot& slot) const;
  LayerSize SizeOf(const ImageSlot& slot) const;
  void Clear() { arrays_.clear(); }

 private:
  struct Array {
    Texture texture;  ///< none: deleted, the index is free
    GLenum format = GL_NONE;
    int width_px = 0, height_px = 0;
    std::vector<bool> used;  ///< by layer
  };
  std::vector<Array> arrays_;
};

}  // namespace dtr::gl
