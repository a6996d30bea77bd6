// dtr/base/size_text.h -- the size of an image in messages.
#pragma once
#include <string>

namespace dtr {

/// "640x480".
inline std::string SizeText(int width_px, int height_px) {
  return std::to_string(width_px) + "x" + std::to_string(height_px);
}

}  // namespace dtr
