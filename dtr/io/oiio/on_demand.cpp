// Codecs() of programs that load OpenImageIO with the first image.
#include "dtr/base/library.h"
#include "dtr/io/image_codecs.h"

namespace dtr::io {

const ImageCodecs& Codecs() {
  using Function = const ImageCodecs*();
  static const ImageCodecs& codecs = *reinterpret_cast<Function*>(
      FunctionOfLibrary("dtr_images.so", "dtr_image_codecs", "images cannot be read or written"))();
  return codecs;
}

}  // namespace dtr::io
