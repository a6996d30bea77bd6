#include "dtr/io/rendered_mark.h"

#include <array>
#include <fstream>
#include <string_view>

#include "dtr/base/error.h"
#include "dtr/base/regular_file.h"

namespace dtr::io {

bool IsRendered(const std::filesystem::path& file) {
  // Texts come before the pixels in all three formats.
  std::array<char, 4096> start{};
  try {
    std::ifstream in = StreamOf(file);
    in.read(start.data(), start.size());
    const std::string_view text(start.data(), static_cast<size_t>(in.gcount()));
    return text.find(kRenderedSoftware) != std::string_view::npos;
  } catch (const Error&) {
    return false;  // whoever reads it as a photo says why
  }
}

}  // namespace dtr::io
