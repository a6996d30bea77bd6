#include "dtr/gl/texture_arrays.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "dtr/base/error.h"

namespace dtr::gl {
namespace {

// An array texture takes its memory at once on some drivers; a larger one would be rejected whole.
constexpr size_t kMaxArrayBytes = size_t{1} << 30;

size_t LayerBytesOf(GLenum format, int width_px, int height_px) {
  return BytesPerPixel(format) * static_cast<size_t>(width_px) * static_cast<size_t>(height_px);
}

void RequireSize(int width_px, int height_px) {
  GLint max_size = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &max_size);
  if (width_px <= max_size && height_px <= max_size) return;
  throw Error("OpenGL: expected images of at most " + std::to_string(max_size) +
              " pixels a side, found " + std::to_string(width_px) + "x" +
              std::to_string(height_px) + "; use `renderer` cpu or simd");
}

Texture MakeArray(GLenum format, int width_px, int height_px, int layers) {
  Texture texture = Texture::Make();
  glBindTexture(GL_TEXTURE_2D_ARRAY, texture.name());
  glTexStorage3D(GL_TEXTURE_2D_ARRAY, 1, format, width_px, height_px, layers);
  // Colours may be mixed by the texture unit; depths never are.
  const GLint filter = format == GL_RGBA8 ? GL_LINEAR : GL_NEAREST;
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, filter);
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAG_FILTER, filter);
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  ThrowOnError("room for " + std::to_string(layers) + " images of " + std::to_string(width_px) +
               "x" + std::to_string(height_px) + " pixels");
  return texture;
}

}  // namespace

size_t BytesPerPixel(GLenum format) {
  switch (format) {
    case GL_RGBA8:
    case GL_R32F:
      return 4;
    case GL_R16:
      return 2;
    default:
      throw std::logic_error("BytesPerPixel: a format that no view is stored in");
  }
}

ImageSlot TextureArrays::Take(GLenum format, int width_px, int height_px, int new_layers) {
  for (size_t i = 0; i < arrays_.size(); ++i) {
    Array& array = arrays_[i];
    if (!array.texture || array.format != format || array.width_px != width_px ||
        array.height_px != height_px) {
      continue;
    }
    const auto layer = std::find(array.used.begin(), array.used.end(), false);
    if (layer == array.used.end()) continue;
    *layer = true;
    return {static_cast<int>(i), static_cast<int>(layer - array.used.begin())};
  }
  RequireSize(width_px, height_px);
  GLint max_layers = 0;
  glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &max_layers);
  const auto by_bytes = static_cast<int>(
      std::max<size_t>(1, kMaxArrayBytes / LayerBytesOf(format, width_px, height_px)));
  const int layers = std::min({std::max(new_layers, 1), max_layers, by_bytes});
  Array array{MakeArray(format, width_px, height_px, layers), format, width_px, height_px,
              std::vector<bool>(static_cast<size_t>(layers), false)};
  array.used[0] = true;
  const auto free = std::find_if(arrays_.begin(), arrays_.end(),
                                 [](const Array& candidate) { return !candidate.texture; });
  const auto index = static_cast<int>(free - arrays_.begin());
  if (free == arrays_.end()) {
    arrays_.push_back(std::move(array));
  } else {
    *free = std::move(array);
  }
  return {index, 0};
}

void TextureArrays::Give(const ImageSlot& slot) {
  Array& array = arrays_[static_cast<size_t>(slot.array)];
  array.used[static_cast<size_t>(slot.layer)] = false;
  if (std::find(array.used.begin(), array.used.end(), true) == array.used.end()) array = Array{};
}

LayerSize TextureArrays::SizeOf(const ImageSlot& slot) const {
  const Array& array = arrays_[static_cast<size_t>(slot.array)];
  return {array.width_px, array.height_px};
}

size_t TextureArrays::LayerBytes(const ImageSlot& slot) const {
  const Array& array = arrays_[static_cast<size_t>(slot.array)];
  return LayerBytesOf(array.format, array.width_px, array.height_px);
}

}  // namespace dtr::gl
