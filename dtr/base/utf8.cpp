#include "dtr/base/utf8.h"

namespace dtr {

bool IsUtf8(const std::string& text) {
  const auto byte = [&](size_t i) {
    return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u;
  };
  const auto in = [](unsigned b, unsigned low, unsigned high) { return b >= low && b <= high; };
  for (size_t i = 0; i < text.size();) {
    const unsigned b = byte(i), next = byte(i + 1);
    size_t length = 0;
    if (b < 0x80) length = 1;
    if (in(b, 0xc2, 0xdf) && in(next, 0x80, 0xbf)) length = 2;
    if (in(b, 0xe0, 0xef) && in(next, b == 0xe0 ? 0xa0 : 0x80, b == 0xed ? 0x9f : 0xbf)) length = 3;
    if (in(b, 0xf0, 0xf4) && in(next, b == 0xf0 ? 0x90 : 0x80, b == 0xf4 ? 0x8f : 0xbf)) length = 4;
    if (length == 0) return false;
    for (size_t j = 2; j < length; ++j) {
      if (!in(byte(i + j), 0x80, 0xbf)) return false;
    }
    i += length;
  }
  return true;
}

std::string WithoutDirectionMarks(std::string text) {
  // U+202A...U+202E and U+2066...U+2069: three bytes each.
  for (size_t at = text.find("\xe2"); at != std::string::npos; at = text.find("\xe2", at + 1)) {
    if (at + 2 >= text.size()) break;
    const auto second = static_cast<unsigned char>(text[at + 1]);
    const auto third = static_cast<unsigned char>(text[at + 2]);
    const bool turns = (second == 0x80 && third >= 0xaa && third <= 0xae) ||
                       (second == 0x81 && third >= 0xa6 && third <= 0xa9);
    if (turns) text.replace(at, 3, "\xef\xbf\xbd");
  }
  return text;
}

}  // namespace dtr
