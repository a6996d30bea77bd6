// tests/support/hostile_images.h -- small files whose headers state huge images, one of each format
// that OpenImageIO decodes.
#pragma once
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace dtr::testing {

/// A GIF of that canvas. With `frame` its image is as large, without it is empty.
std::string HostileGif(int width, int height, bool frame = false);

/// Name and bytes of every other one. `padding`: zeros behind the header, in the place of pixels.
std::vector<std::pair<std::string, std::string>> HostileImages(size_t padding);

}  // namespace dtr::testing
