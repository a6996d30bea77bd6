#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <set>
#include <sstream>

#include "capture/ingest.h"

namespace dtr::capture {
namespace {

std::string LowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  return text;
}

// OpenImageIO tells "jpeg:jpg,jpe,jpeg;png:png;..."
std::set<std::string> ReadableExtensions() {
  // Formats of films, volumes and terminals.
  static const std::set<std::string> kNoPhotos{"ffmpeg", "field3d", "null", "openvdb",
                                               "ptex",   "term",    "zfile"};
  std::istringstream formats(OIIO::get_string_attribute("extension_list"));
  std::set<std::string> extensions;
  for (std::string format; std::getline(formats, format, ';');) {
    const size_t colon = format.find(':');
    if (colon == std::string::npos || kNoPhotos.count(format.substr(0, colon)) != 0) continue;
    std::istringstream names(format.substr(colon + 1));
    for (std::string name; std::getline(names, name, ',');) extensions.insert(LowerCase(name));
  }
  return extensions;
}

}  // namespace

bool IsImageExtension(const std::string& extension) {
  static const std::set<std::string> kExtensions = ReadableExtensions();
  const bool dot = !extension.empty() && extension.front() == '.';
  return kExtensions.count(LowerCase(dot ? extension.substr(1) : extension)) != 0;
}

}  // namespace dtr::capture
