// dtr/io/image_formats.h -- the formats of images that can be read.
#pragma once
#include <string>

namespace dtr::io {

/// OpenImageIO's names of formats, each with its extensions: "jpeg:jpg,jpe,jpeg;png:png;...".
std::string ImageFormatList();

}  // namespace dtr::io
