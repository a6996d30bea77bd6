#include "dtr/base/file_names.h"

#include <algorithm>
#include <filesystem>

#include "dtr/base/error.h"

namespace dtr {

std::string WhyUnsafeName(const std::string& name) {
  constexpr size_t kMaxNameBytes = 1024;  // PATH_MAX is 4096; leaves room for the folder
  if (name.empty()) return "is empty";
  if (name.size() > kMaxNameBytes) return "is longer than 1024 bytes";
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 32 || c == 127; };
  if (std::any_of(name.begin(), name.end(), is_control)) return "holds control characters";
  const std::filesystem::path path(name);
  if (path.is_absolute()) return "is absolute";
  for (const auto& part : path) {
    if (part == "..") return "leaves its folder (..)";
  }
  if (!path.has_filename()) return "names a folder";
  if (path.filename() == ".") return "names a folder";
  return "";
}

void RequireSafeName(const std::string& name, const std::string& where) {
  const std::string why = WhyUnsafeName(name);
  if (why.empty()) return;
  throw Error(where + ": expected a relative path inside its folder, found \"" + Printable(name) +
              "\", which " + why);
}

std::string Printable(const std::string& text) {
  constexpr size_t kLongest = 80;
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 32 || c == 127; };
  std::string shown = text.substr(0, kLongest);
  std::replace_if(shown.begin(), shown.end(), is_control, '?');
  return shown;
}

}  // namespace dtr
