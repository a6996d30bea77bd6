#include "dtr/io/plain_png.h"

#include <png.h>
#include <zlib.h>

#include <bit>
#include <csetjmp>
#include <fstream>
#include <string_view>

#include "dtr/base/regular_file.h"
#include "dtr/io/file_boxes.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kSoftware = "Software";

/// The header's thirteen bytes (PNG specification, section 11.2.2).
struct Header {
  std::uint32_t width = 0, height = 0;
  int bits = 0, colour_type = 0;
  size_t row_bytes() const { return size_t{width} * static_cast<size_t>(channels() * bits / 8); }
  int channels() const { return colour_type == PNG_COLOR_TYPE_GRAY ? 1 : 3; }
};

std::optional<Header> PlainHeader(const std::string& bytes) {
  if (bytes.size() != 13) return {};
  const Header header{static_cast<std::uint32_t>(Big(bytes, 0, 4)),
                      static_cast<std::uint32_t>(Big(bytes, 4, 4)),
                      static_cast<int>(Big(bytes, 8, 1)), static_cast<int>(Big(bytes, 9, 1))};
  const auto fits = [](std::uint32_t size) { return size > 0 && size <= PNG_USER_WIDTH_MAX; };
  const bool is_plain =
      fits(header.width) && fits(header.height) && (header.bits == 8 || header.bits == 16) &&
      (header.colour_type == PNG_COLOR_TYPE_GRAY || header.colour_type == PNG_COLOR_TYPE_RGB) &&
      bytes.substr(10) == std::string(3, '\0');  // deflate, adaptive filters, not interlaced
  if (!is_plain) return {};
  return header;
}

/// Of a file that holds nothing else before its pixels than OpenImageIO writes into every PNG.
std::optional<Header> LookAtPng(const fs::path& file) {
  constexpr std::uint64_t kSignature = 8, kLongest = 256;
  FileBytes bytes(file);
  if (bytes.At(0, kSignature) != "\x89PNG\r\n\x1a\n") return {};
  std::optional<Header> header;
  for (std::uint64_t at = kSignature; at + 12 <= bytes.size();) {
    const std::string head = bytes.At(at, 8);
    const std::uint64_t length = Big(head, 0, 4);
    const std::string name = head.substr(4);
    if (name == "IDAT") return header;
    if (length > kLongest) return {};
    const std::string content = bytes.At(at + 8, length);
    if (at == kSignature) {
      if (name != "IHDR") return {};
      header = PlainHeader(content);
      if (!header) return {};
    } else if (!(name == "oFFs" && content == std::string(9, '\0')) &&
               !(name == "tEXt" && content.starts_with(std::string(kSoftware) + '\0'))) {
      return {};
    }
    at += 12 + length;
  }
  return {};
}

void ReadBytes(png_structp png, png_bytep to, size_t count) {
  auto& in = *static_cast<std::ifstream*>(png_get_io_ptr(png));
  if (!in.read(reinterpret_cast<char*>(to), static_cast<std::streamsize>(count))) {
    png_error(png, "");
  }
}

void WriteBytes(png_structp png, png_bytep from, size_t count) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<char*>(from), count);
}

void Fail(png_structp png, png_const_charp) { png_longjmp(png, 1); }
void Warn(png_structp png, png_const_charp) { *static_cast<bool*>(png_get_error_ptr(png)) = true; }

// Nothing in the next two has a destructor: libpng jumps over it. False where it did.
bool ReadRows(png_structp png, png_infop info, const Header& header, std::uint8_t* to) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_read_info(png, info);
  if (to == nullptr) return true;
  if (header.bits == 16 && std::endian::native == std::endian::little) png_set_swap(png);
  for (std::uint32_t y = 0; y < header.height; ++y) {
    png_read_row(png, to + y * header.row_bytes(), nullptr);
  }
  return true;
}

bool WriteRows(png_structp png, png_infop info, const ImageToWrite& image, int colour_type,
               png_text* text, const std::uint8_t* from) {
  const int bits = image.sample == Sample::kUint16 ? 16 : 8;
  const auto row_bytes =
      static_cast<size_t>(image.width) * static_cast<size_t>(image.channels * bits / 8);
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_compression_level(png, kPngLevel);
  png_set_compression_strategy(png, Z_DEFAULT_STRATEGY);
  png_set_IHDR(png, info, static_cast<png_uint_32>(image.width),
               static_cast<png_uint_32>(image.height), bits, colour_type, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_oFFs(png, info, 0, 0, PNG_OFFSET_PIXEL);
  if (text != nullptr) png_set_text(png, info, text, 1);
  png_write_info(png, info);
  if (bits == 16 && std::endian::native == std::endian::little) png_set_swap(png);
  for (int y = 0; y < image.height; ++y) {
    png_write_row(png, from + static_cast<size_t>(y) * row_bytes);
  }
  png_write_end(png, nullptr);
  return true;
}

// Without pixels (`to` is null) it reads what stands before them. False where libpng complains.
bool Read(const fs::path& file, const Header& header, std::uint8_t* to) {
  std::ifstream in = StreamOf(file);
  bool complained = false;
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &complained, Fail, Warn);
  png_infop info = png == nullptr ? nullptr : png_create_info_struct(png);
  bool read = info != nullptr;
  if (read) {
    png_set_read_fn(png, &in, ReadBytes);
    read = ReadRows(png, info, header, to);
  }
  png_destroy_read_struct(&png, &info, nullptr);
  return read && !complained;
}

class PlainFacts : public ImageFacts {
 public:
  explicit PlainFacts(const Header& header) {
    width = full_width = static_cast<int>(header.width);
    height = full_height = static_cast<int>(header.height);
    channels = header.channels();
    channel_names =
        channels == 1 ? std::vector<std::string>{"Y"} : std::vector<std::string>{"R", "G", "B"};
    sample = header.bits == 16 ? Sample::kUint16 : Sample::kUint8;
    sample_name = header.bits == 16 ? "uint16" : "uint8";
    sample_bytes = static_cast<size_t>(header.bits / 8);
    pixel_bytes = sample_bytes * static_cast<size_t>(channels);
  }
  int Int(const char*, int without) const override { return without; }
  float Float(const char*, float without) const override { return without; }
  std::string Text(const char*) const override { return {}; }
  std::vector<float> Floats(const char*) const override { return {}; }
  std::vector<std::uint8_t> Bytes(const char*) const override { return {}; }
};

class PlainPng : public OpenedImage {
 public:
  PlainPng(fs::path file, const Header& header)
      : file_(std::move(file)), header_(header), facts_(header) {}

  const ImageFacts& facts() const override { return facts_; }
  std::string format() const override { return "png"; }
  std::unique_ptr<ImageFacts> FactsWith(const std::string&, bool) const override {
    return std::make_unique<PlainFacts>(header_);
  }
  bool Read(int first_channel, int end_channel, Sample sample, void* pixels,
            std::string& complaint) override {
    const bool whole = first_channel == 0 && end_channel == facts_.channels;
    if (whole && sample == facts_.sample &&
        io::Read(file_, header_, static_cast<std::uint8_t*>(pixels))) {
      return true;
    }
    // Numbers of another kind; or damage, in OpenImageIO's words.
    const auto in = Codecs().Open(file_.string(), {}, complaint);
    return in && in->Read(first_channel, end_channel, sample, pixels, complaint);
  }
  bool HasSecondImage() override { return false; }
  void Close() override {}

 private:
  const fs::path file_;
  const Header header_;
  const PlainFacts facts_;
};

std::optional<int> ColourType(int channels) {
  if (channels == 1) return PNG_COLOR_TYPE_GRAY;
  if (channels == 3) return PNG_COLOR_TYPE_RGB;
  if (channels == 4) return PNG_COLOR_TYPE_RGB_ALPHA;
  return {};
}

}  // namespace

std::unique_ptr<OpenedImage> OpenPlainPng(const fs::path& file) {
  const auto header = LookAtPng(file);
  if (!header || !Read(file, *header, nullptr)) return nullptr;
  return std::make_unique<PlainPng>(file, *header);
}

std::optional<std::string> EncodePlainPng(const ImageToWrite& image, Sample sample,
                                          const void* pixels) {
  const auto colour_type = ColourType(image.channels);
  bool is_plain = colour_type && sample == image.sample && image.channel_names.empty() &&
                  (sample == Sample::kUint8 || sample == Sample::kUint16);
  bool straight_alpha = false;
  std::string key(kSoftware), software;
  for (const auto& [name, value] : image.attributes) {
    const auto* text = std::get_if<std::string>(&value);
    const auto* number = std::get_if<int>(&value);
    if (name == kSoftware && text != nullptr) {
      software = *text;
    } else if (name == "oiio:UnassociatedAlpha" && number != nullptr) {
      straight_alpha = *number != 0;
    } else {
      is_plain = false;
    }
  }
  if (!is_plain || straight_alpha != (image.channels == 4)) return {};

  std::string bytes;
  bool complained = false;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &complained, Fail, Warn);
  png_infop info = png == nullptr ? nullptr : png_create_info_struct(png);
  bool written = info != nullptr;
  if (written) {
    png_set_write_fn(png, &bytes, WriteBytes, nullptr);
    png_text text{};
    text.compression = PNG_TEXT_COMPRESSION_NONE;
    text.key = key.data();
    text.text = software.data();
    text.text_length = software.size();
    written = WriteRows(png, info, image, *colour_type, software.empty() ? nullptr : &text,
                        static_cast<const std::uint8_t*>(pixels));
  }
  png_destroy_write_struct(&png, &info);
  if (!written || complained) return {};
  return bytes;
}

}  // namespace dtr::io
