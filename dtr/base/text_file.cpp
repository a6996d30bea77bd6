#include "dtr/base/text_file.h"

#include <charconv>
#include <cmath>

#include "dtr/base/error.h"
#include "dtr/base/files.h"

namespace dtr {
namespace {

constexpr std::string_view kUtf8Mark = "\xef\xbb\xbf", kLittleMark = "\xff\xfe",
                           kBigMark = "\xfe\xff";

void AppendUtf8(std::uint32_t code, std::string& out) {
  const auto put = [&](std::uint32_t byte) { out.push_back(static_cast<char>(byte)); };
  const auto tail = [&](int shift) { put(0x80 | (code >> shift & 0x3f)); };
  if (code < 0x80) {
    put(code);
  } else if (code < 0x800) {
    put(0xc0 | code >> 6);
    tail(0);
  } else if (code < 0x10000) {
    put(0xe0 | code >> 12);
    tail(6);
    tail(0);
  } else {
    put(0xf0 | code >> 18);
    tail(12);
    tail(6);
    tail(0);
  }
}

// Code units of UTF-16 behind its mark as UTF-8; false where they break off or contradict
// themselves. `out` then holds what stands before.
bool FromUtf16(std::string_view bytes, bool big_endian, std::string& out) {
  const auto unit = [&](size_t at) -> std::uint32_t {
    const auto first = static_cast<unsigned char>(bytes[at]),
               second = static_cast<unsigned char>(bytes[at + 1]);
    return big_endian ? first << 8 | second : second << 8 | first;
  };
  for (size_t at = 0; at < bytes.size(); at += 2) {
    if (at + 1 >= bytes.size()) return false;
    std::uint32_t code = unit(at);
    if (code >= 0xdc00 && code < 0xe000) return false;  // the second of a pair, alone
    if (code >= 0xd800 && code < 0xdc00) {
      at += 2;
      if (at + 1 >= bytes.size()) return false;
      const std::uint32_t low = unit(at);
      if (low < 0xdc00 || low >= 0xe000) return false;
      code = 0x10000 + ((code - 0xd800) << 10) + (low - 0xdc00);
    }
    AppendUtf8(code, out);
  }
  return true;
}

// Bytes of UTF-8 without the mark; false as of FromUtf16.
bool ToUtf8(std::string& bytes) {
  const bool little = bytes.starts_with(kLittleMark);
  if (little || bytes.starts_with(kBigMark)) {
    std::string text;
    const bool whole = FromUtf16(std::string_view(bytes).substr(2), !little, text);
    bytes = std::move(text);
    return whole;
  }
  if (bytes.starts_with(kUtf8Mark)) bytes.erase(0, kUtf8Mark.size());
  return true;
}

void UnifyLineEnds(std::string& text) {
  if (text.find('\r') == std::string::npos) return;
  size_t to = 0;
  for (size_t from = 0; from < text.size(); ++from) {
    if (text[from] != '\r') {
      text[to++] = text[from];
    } else if (from + 1 == text.size() || text[from + 1] != '\n') {
      text[to++] = '\n';
    }
  }
  text.resize(to);
}

}  // namespace

std::string TextOf(std::string bytes, const std::string& source) {
  if (!ToUtf8(bytes)) {
    throw Error(source +
                ": its UTF-16 breaks off or is damaged; copy the file again, or save it "
                "as UTF-8");
  }
  if (const size_t zero = bytes.find('\0'); zero != std::string::npos) {
    throw Error(source + ": is no text, byte " + std::to_string(zero) +
                " is 0; save it as UTF-8, or give another file");
  }
  UnifyLineEnds(bytes);
  if (!bytes.empty() && bytes.back() != '\n') bytes.push_back('\n');
  return bytes;
}

std::string ReadTextFile(const std::filesystem::path& file, std::uintmax_t limit_bytes) {
  return TextOf(ReadFile(file, limit_bytes), file.string());
}

std::string TextOfHead(std::string bytes) {
  ToUtf8(bytes);
  UnifyLineEnds(bytes);
  return bytes;
}

std::optional<double> FiniteNumber(std::string_view word) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  double number = 0;
  const char* end = word.data() + word.size();
  const auto [stop, failure] = std::from_chars(word.data(), end, number);
  if (failure != std::errc() || stop != end || !std::isfinite(number)) return std::nullopt;
  return number;
}

std::string DecimalCommaHint(std::string_view word) {
  const size_t comma = word.find(',');
  if (comma == std::string_view::npos) return "";
  std::string pointed(word);
  pointed[comma] = '.';
  if (!FiniteNumber(pointed)) return "";
  return "; write numbers with a decimal point, not a comma";
}

}  // namespace dtr
