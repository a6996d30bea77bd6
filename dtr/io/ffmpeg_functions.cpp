#include "dtr/io/ffmpeg_functions.h"

#include "dtr/base/library.h"

namespace dtr {

void* FfmpegSymbol(const char* library, const char* function) {
  return FunctionOfLibrary(library, function, "videos cannot be read or written");
}

}  // namespace dtr
