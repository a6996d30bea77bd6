#include "capture/names.h"

#include <algorithm>
#include <filesystem>

#include "dtr/base/utf8.h"

namespace dtr::capture {

bool IsControl(char c) { return static_cast<unsigned char>(c) < 32 || c == 127; }

std::string Printable(std::string text) {
  const bool utf8 = IsUtf8(text);
  for (char& c : text) {
    if (IsControl(c) || (!utf8 && static_cast<unsigned char>(c) >= 0x80)) c = '?';
  }
  while (!text.empty() && (text.back() == ' ' || text.back() == '?')) text.pop_back();
  return text;
}

std::string PrintableName(const std::string& name) {
  const std::string text = Printable(name);
  return text.empty() ? "(unprintable)" : text;
}

std::string LowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  return text;
}

std::string StemOf(const std::string& name) {
  return std::filesystem::path(name).replace_extension().generic_string();
}

}  // namespace dtr::capture
