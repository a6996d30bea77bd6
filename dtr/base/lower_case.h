// dtr/base/lower_case.h -- names regardless of case. ASCII alone: a name never depends on a locale.
#pragma once
#include <filesystem>
#include <string>

namespace dtr {

/// ASCII letters in lower case.
inline std::string LowerCase(std::string text) {
  for (char& c : text) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return text;
}

/// The extension of a file's name, with its dot: ".png" of "VIEW.PNG".
inline std::string LowerExtension(const std::filesystem::path& file) {
  return LowerCase(file.extension().string());
}

}  // namespace dtr
