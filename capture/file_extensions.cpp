#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "capture/ingest.h"
#include "capture/names.h"
#include "dtr/base/lower_case.h"
#include "dtr/io/image_formats.h"

namespace dtr::capture {
namespace {

// Other names of formats that OpenImageIO knows by their content.
const std::map<std::string, std::vector<std::string>>& Synonyms() {
  static const std::map<std::string, std::vector<std::string>> kSynonyms{
      {"heif", {"hif", "heifs", "avifs"}},  // .HIF: Sony and Canon
      {"jpeg", {"pjpeg", "pjp", "mpo"}},
      {"jpeg2000", {"jpx", "jpf"}},
      {"png", {"apng"}}};
  return kSynonyms;
}

// OpenImageIO tells "jpeg:jpg,jpe,jpeg;png:png;..."; `format` empty: of all that hold photos.
std::set<std::string> ReadableExtensions(const std::string& asked) {
  // Formats of films, volumes and terminals.
  static const std::set<std::string> kNoPhotos{"ffmpeg", "field3d", "null", "openvdb",
                                               "ptex",   "term",    "zfile"};
  std::istringstream formats(io::ImageFormatList());
  std::set<std::string> extensions;
  for (std::string format; std::getline(formats, format, ';');) {
    const size_t colon = format.find(':');
    if (colon == std::string::npos) continue;
    const std::string name_of_format = format.substr(0, colon);
    if (asked.empty() ? kNoPhotos.contains(name_of_format) : name_of_format != asked) continue;
    const auto more = Synonyms().find(name_of_format);
    if (more != Synonyms().end()) extensions.insert(more->second.begin(), more->second.end());
    std::istringstream names(format.substr(colon + 1));
    for (std::string name; std::getline(names, name, ',');) extensions.insert(LowerCase(name));
  }
  return extensions;
}

bool Contains(const std::set<std::string>& extensions, const std::string& extension) {
  const bool dot = !extension.empty() && extension.front() == '.';
  return extensions.contains(LowerCase(dot ? extension.substr(1) : extension));
}

}  // namespace

bool IsImageExtension(const std::string& extension) {
  static const std::set<std::string> kExtensions = ReadableExtensions("");
  return Contains(kExtensions, extension);
}

bool IsRawExtension(const std::string& extension) {
  static const std::set<std::string> kExtensions = ReadableExtensions("raw");
  return Contains(kExtensions, extension);
}

bool IsVideoExtension(const std::string& extension) {
  // .insv and .lrv are MP4 files of action cameras.
  static constexpr std::array<std::string_view, 17> kVideos{
      ".mp4",  ".mov", ".avi", ".mkv", ".m4v", ".webm", ".mts", ".m2ts", ".mpg",
      ".mpeg", ".3gp", ".3g2", ".wmv", ".mj2", ".insv", ".lrv", ".qt"};
  return std::find(kVideos.begin(), kVideos.end(), LowerCase(extension)) != kVideos.end();
}

bool IsProxyVideoExtension(const std::string& extension) { return LowerCase(extension) == ".lrv"; }

}  // namespace dtr::capture
