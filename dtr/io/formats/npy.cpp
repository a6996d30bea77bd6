#include "dtr/io/formats/npy.h"

#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>

#include "dtr/base/error.h"
#include "dtr/base/files.h"

namespace dtr::io {
namespace {

constexpr std::uintmax_t kMaxNpyBytes = 256u << 20;  // a million LLFF poses
constexpr size_t kMaxDimensions = 8;

struct Header {
  size_t item_bytes = 0;
  char kind = 'f';  // f, i or u, as numpy calls them
  bool big_endian = false;
  bool fortran_order = false;
  std::vector<size_t> shape;
};

/// The header is a Python dictionary literal of three known keys; this reads just that.
class HeaderParser {
 public:
  HeaderParser(std::string_view text, const std::string& source, const NpyOptions& options)
      : text_(text), source_(source), options_(options) {}

  Header Parse() {
    Header header;
    bool has_descr = false, has_order = false, has_shape = false;
    Expect('{');
    while (!Accept('}')) {
      const std::string key = String();
      Expect(':');
      if (key == "descr" && !has_descr) {
        Descr(header);
        has_descr = true;
      } else if (key == "fortran_order" && !has_order) {
        header.fortran_order = Bool();
        has_order = true;
      } else if (key == "shape" && !has_shape) {
        header.shape = Shape();
        has_shape = true;
      } else {
        Fail("expected the keys descr, fortran_order and shape once each, found others");
      }
      if (!Accept(',')) {
        Expect('}');
        break;
      }
    }
    SkipBlanks();
    if (position_ != text_.size()) Fail("expected the end of the header, found more");
    if (!has_descr || !has_order || !has_shape) {
      Fail("expected the keys descr, fortran_order and shape, found fewer");
    }
    return header;
  }

 private:
  [[noreturn]] void Fail(const char* what) const {
    throw Error(source_ + ": header of the .npy file: " + what);
  }
  void SkipBlanks() {
    while (position_ < text_.size() && (text_[position_] == ' ' || text_[position_] == '\n')) {
      ++position_;
    }
  }
  bool Accept(char c) {
    SkipBlanks();
    if (position_ >= text_.size() || text_[position_] != c) return false;
    ++position_;
    return true;
  }
  void Expect(char c) {
    if (!Accept(c)) Fail("expected a dictionary as numpy writes it, found other text");
  }
  bool AcceptWord(std::string_view word) {
    SkipBlanks();
    if (text_.substr(position_, word.size()) != word) return false;
    position_ += word.size();
    return true;
  }
  std::string String() {
    SkipBlanks();
    const char quote = position_ < text_.size() ? text_[position_] : '\0';
    if (quote != '\'' && quote != '"') Fail("expected a quoted text, found none");
    const size_t end = text_.find(quote, position_ + 1);
    if (end == std::string_view::npos) Fail("expected a closing quote, found none");
    const std::string value(text_.substr(position_ + 1, end - position_ - 1));
    position_ = end + 1;
    return value;
  }
  bool Bool() {
    if (AcceptWord("True")) return true;
    if (AcceptWord("False")) return false;
    Fail("fortran_order: expected True or False, found another");
  }
  void Descr(Header& header) {
    SkipBlanks();
    if (position_ < text_.size() && text_[position_] == '[') {
      Fail("descr: expected '<f4' or '<f8', found a structure");
    }
    const std::string descr = String();
    const bool three =
        descr.size() == 3 && std::string_view("<>|=").find(descr[0]) != std::string_view::npos;
    const auto is = [&](char kind, std::string_view sizes) {
      return three && descr[1] == kind && sizes.find(descr[2]) != std::string_view::npos;
    };
    // "|" and "=": of one byte, or of the machine that wrote it, which the file does not name.
    const bool ordered = three && (descr[2] == '1' || descr[0] == '<' || descr[0] == '>');
    if (!ordered || !(is('f', options_.half ? "248" : "48") ||
                      (options_.integers && (is('i', "124") || is('u', "124"))))) {
      Fail(options_.integers
               ? "descr: expected floats or integers of up to 32 bits, found another type"
               : "descr: expected float32 or float64 ('<f4', '<f8', '>f4', '>f8'), found "
                 "another type");
    }
    header.kind = descr[1];
    header.big_endian = descr[0] == '>';
    header.item_bytes = static_cast<size_t>(descr[2] - '0');
  }
  std::vector<size_t> Shape() {
    std::vector<size_t> shape;
    Expect('(');
    while (!Accept(')')) {
      SkipBlanks();
      size_t extent = 0;
      const char* begin = text_.data() + position_;
      const auto result = std::from_chars(begin, text_.data() + text_.size(), extent);
      if (result.ec != std::errc()) Fail("shape: expected whole numbers, found another");
      position_ += static_cast<size_t>(result.ptr - begin);
      if (shape.size() == kMaxDimensions) Fail("shape: expected at most 8 dimensions, found more");
      shape.push_back(extent);
      if (!Accept(',')) {
        Expect(')');
        break;
      }
    }
    return shape;
  }

  std::string_view text_;
  const std::string& source_;
  const NpyOptions& options_;
  size_t position_ = 0;
};

// Elements of the shape; empty when they are more than `limit`.
std::optional<size_t> CountOf(const std::vector<size_t>& shape, size_t limit) {
  size_t count = 1;
  for (const size_t extent : shape) {
    if (extent != 0 && count > limit / extent) return std::nullopt;
    count *= extent;
  }
  return count;
}

// IEEE 754 binary16: sign, 5 bits of exponent, 10 of fraction.
double FromHalf(std::uint64_t bits) {
  const double sign = (bits & 0x8000) != 0 ? -1 : 1;
  const int exponent = static_cast<int>(bits >> 10 & 31);
  const double fraction = static_cast<double>(bits & 1023) / 1024;
  if (exponent == 31) {
    return fraction == 0 ? sign * std::numeric_limits<double>::infinity()
                         : std::numeric_limits<double>::quiet_NaN();
  }
  return sign *
         (exponent == 0 ? std::ldexp(fraction, -14) : std::ldexp(1 + fraction, exponent - 15));
}

double ValueAt(const char* bytes, const Header& header) {
  std::uint64_t bits = 0;
  for (size_t i = 0; i < header.item_bytes; ++i) {
    const size_t at = header.big_endian ? i : header.item_bytes - 1 - i;
    bits = bits << 8 | static_cast<unsigned char>(bytes[at]);
  }
  if (header.kind == 'u') return static_cast<double>(bits);
  if (header.kind == 'i') {
    const auto unused_bits = static_cast<int>(64 - 8 * header.item_bytes);
    return static_cast<double>(static_cast<std::int64_t>(bits << unused_bits) >> unused_bits);
  }
  if (header.item_bytes == 2) return FromHalf(bits);
  if (header.item_bytes == 8) return std::bit_cast<double>(bits);
  return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
}

// Index in the file, where the first index runs fastest, of element `c_index` of our C order.
size_t FortranIndex(size_t c_index, const std::vector<size_t>& shape) {
  size_t index = 0;
  std::vector<size_t> indices(shape.size());
  for (size_t d = shape.size(); d-- > 0;) {
    indices[d] = c_index % shape[d];
    c_index /= shape[d];
  }
  for (size_t d = shape.size(); d-- > 0;) index = index * shape[d] + indices[d];
  return index;
}

// The header, and where the data begin.
std::pair<Header, size_t> HeaderOf(std::string_view bytes, const std::string& source,
                                   const NpyOptions& options) {
  constexpr std::string_view kMagic("\x93NUMPY", 6);
  if (bytes.size() < 10 || bytes.substr(0, 6) != kMagic) {
    throw Error(source + ": expected a .npy file (it begins with \\x93NUMPY), found another");
  }
  const int version = static_cast<unsigned char>(bytes[6]);
  if (version < 1 || version > 3) {
    throw Error(source + ": expected .npy format 1, 2 or 3, found " + std::to_string(version));
  }
  const size_t length_bytes = version == 1 ? 2 : 4;
  const size_t header_begin = 8 + length_bytes;
  if (bytes.size() < header_begin) throw Error(source + ": expected a header, found the end");
  size_t header_bytes = 0;
  for (size_t i = length_bytes; i-- > 0;) {
    header_bytes = header_bytes << 8 | static_cast<unsigned char>(bytes[8 + i]);
  }
  if (header_bytes > bytes.size() - header_begin) {
    throw Error(source + ": expected a header of " + std::to_string(header_bytes) +
                " bytes, found the end of the file");
  }
  return {HeaderParser(bytes.substr(header_begin, header_bytes), source, options).Parse(),
          header_begin + header_bytes};
}

}  // namespace

NpyArray ParseNpy(std::string_view bytes, const std::string& source, const NpyOptions& options) {
  const auto [header, begin] = HeaderOf(bytes, source, options);
  const std::string_view data = bytes.substr(begin);
  const auto count = CountOf(header.shape, data.size() / header.item_bytes);
  if (!count || *count * header.item_bytes != data.size()) {
    throw Error(source + ": expected as many bytes as the shape says, found " +
                std::to_string(data.size()) + "; the file is damaged");
  }
  if (*count > options.max_values) {
    throw Error(source + ": expected at most " + std::to_string(options.max_values) +
                " numbers, found " + std::to_string(*count));
  }
  NpyArray array;
  array.shape = header.shape;
  array.whole_numbers = header.kind != 'f';
  array.values.resize(*count);
  for (size_t i = 0; i < *count; ++i) {
    const size_t at = header.fortran_order ? FortranIndex(i, header.shape) : i;
    array.values[i] = ValueAt(data.data() + at * header.item_bytes, header);
    if (!options.any_value && !std::isfinite(array.values[i])) {
      throw Error(source + ": expected finite numbers, found NaN or infinity at element " +
                  std::to_string(i));
    }
  }
  return array;
}

NpyArray ReadNpy(const std::filesystem::path& file, const NpyOptions& options) {
  return ParseNpy(ReadFile(file, kMaxNpyBytes), file.string(), options);
}

bool NpyHoldsWholeNumbers(const std::filesystem::path& file) {
  const std::string bytes = ReadFile(file, kMaxNpyBytes);
  return HeaderOf(bytes, file.string(), {.half = true, .integers = true}).first.kind != 'f';
}

void WriteNpy(const std::filesystem::path& file, const Grid<float>& grid) {
  static_assert(std::endian::native == std::endian::little);
  std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (" +
                       std::to_string(grid.height()) + ", " + std::to_string(grid.width()) +
                       (grid.channels() > 1 ? ", " + std::to_string(grid.channels()) : "") + "), }";
  // Magic, version and length take 10 bytes; numpy wants the array to begin at a multiple of 64.
  constexpr size_t kBefore = 10, kAlignment = 64;
  header.resize((kBefore + header.size() + 1 + kAlignment - 1) / kAlignment * kAlignment - kBefore,
                ' ');
  header.back() = '\n';
  std::string bytes("\x93NUMPY\x01\x00", 8);
  bytes += static_cast<char>(header.size() & 0xff);
  bytes += static_cast<char>(header.size() >> 8);
  bytes += header;
  bytes.append(reinterpret_cast<const char*>(grid.data().data()), 4 * grid.data().size());
  WriteFileAtomically(file, bytes);
}

}  // namespace dtr::io
