// dtr/report/encode.h -- bytes as a page carries them.
#pragma once
#include <string>
#include <string_view>

#include "dtr/types/grid.h"

namespace dtr::report {

/// Base64 of RFC 4648, with padding, in one line.
std::string Base64(std::string_view bytes);

/// `text` with &, <, >, " and ' as entities; control characters and bytes that are no UTF-8 become
/// U+FFFD, so that a hostile photo name can neither end an element nor spoil the page's encoding.
std::string EscapeHtml(std::string_view text);

/// JPEG file of an RGB image, quality 1..100, deterministic. Throws Error for images without
/// pixels, without 3 channels or above JPEG's 65500 pixels per side.
std::string EncodeJpeg(const ImageRgb8& image, int quality);

}  // namespace dtr::report
