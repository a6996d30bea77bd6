// dtr/io/small_jpeg.h -- photos as few bytes, for pages and other files that hold many.
#pragma once
#include <string>

#include "dtr/types/grid.h"

namespace dtr::io {

/// A progressive JPEG with Huffman tables of its own, colours as fine as brightness, and all
/// frequencies quantised alike: of the same size as WriteImage's it has less error.
/// `quality` 1...100. Throws std::invalid_argument unless the image has 3 channels, Error where
/// libjpeg cannot code it.
std::string SmallJpeg(const ImageRgb8& image, int quality);

}  // namespace dtr::io
