#include "dtr/io/jpeg_pixels.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include <jpeglib.h>  // needs cstdio before it

#include <jerror.h>  // needs jpeglib.h before it

#include "dtr/base/error.h"
#include "dtr/base/regular_file.h"

namespace dtr::io {
namespace {

constexpr int kInks = 4;
// Webcams and scanners leave a few bytes behind the last row. A hole leaves as much of the image as
// it swallowed, or none where decoding ran out of data, which libjpeg reports.
constexpr int kFewBytes = 64;

// libjpeg ends the program on errors unless error_exit jumps; its text is kept.
struct Complaint {
  jpeg_error_mgr manager{};  // first: libjpeg knows it by this
  std::jmp_buf back{};
  std::FILE* file = nullptr;
  bool in_pixels = false;
  char words[JMSG_LENGTH_MAX] = "";  // the first that matters; empty: none
};

Complaint& ComplaintOf(j_common_ptr jpeg) { return *reinterpret_cast<Complaint*>(jpeg->err); }

void Jump(j_common_ptr jpeg) {
  Complaint& complaint = ComplaintOf(jpeg);
  if (complaint.words[0] == '\0') jpeg->err->format_message(jpeg, complaint.words);
  std::longjmp(complaint.back, 1);
}

// Whether the `count` bytes that end about where libjpeg reads are all equal: space that was left
// free. Its position is exact to a few bytes.
bool IsFilling(std::FILE* file, const jpeg_source_mgr& source, long count) {
  constexpr long kUnsure = 4, kMost = 4096;
  const long end = std::ftell(file) - static_cast<long>(source.bytes_in_buffer) - kUnsure;
  const long size = std::min(count - 2 * kUnsure, kMost);
  std::array<char, kMost> bytes;
  if (size <= 0 || end < size) return false;
  const auto wanted = static_cast<size_t>(size);
  if (pread(fileno(file), bytes.data(), wanted, end - size) != size) return false;
  return std::all_of(bytes.begin(), bytes.begin() + size, [&](char b) { return b == bytes[0]; });
}

// Whole photos of phones have odd headers (JWRN_NOT_SEQUENTIAL), which do no harm.
bool SpoilsPixels(int code) {
  return code == JWRN_HUFF_BAD_CODE || code == JWRN_ARITH_BAD_CODE || code == JWRN_MUST_RESYNC;
}

void Hear(j_common_ptr jpeg, int level) {
  Complaint& complaint = ComplaintOf(jpeg);
  if (level >= 0 || !complaint.in_pixels || complaint.words[0] != '\0') return;
  const auto* decompress = reinterpret_cast<j_decompress_ptr>(jpeg);
  const auto row = static_cast<unsigned>(decompress->output_scanline);
  const auto rows = static_cast<unsigned>(decompress->output_height);
  if (jpeg->err->msg_code == JWRN_EXTRANEOUS_DATA) {
    const int count = jpeg->err->msg_parm.i[0];
    if (count < kFewBytes || IsFilling(complaint.file, *decompress->src, count)) return;
    std::snprintf(complaint.words, sizeof complaint.words,
                  "%d bytes left over, so that data in its middle are missing or spoiled", count);
  } else if (jpeg->err->msg_code == JWRN_JPEG_EOF || jpeg->err->msg_code == JWRN_HIT_MARKER) {
    std::snprintf(complaint.words, sizeof complaint.words, "data that end at row %u of %u", row,
                  rows);
  } else if (SpoilsPixels(jpeg->err->msg_code)) {
    jpeg->err->format_message(jpeg, complaint.words);
  }
}

std::uint8_t Light(int paper, int white) {
  return static_cast<std::uint8_t>((paper * white + 127) / 255);
}

void RgbOfInks(const std::vector<JSAMPLE>& inks, bool inverted, std::uint8_t* rgb, int width) {
  const int flip = inverted ? 0 : 255;
  for (int x = 0; x < width; ++x) {
    const JSAMPLE* ink = &inks[static_cast<size_t>(x) * kInks];
    for (int c = 0; c < 3; ++c) rgb[3 * x + c] = Light(ink[c] ^ flip, ink[3] ^ flip);
  }
}

// Nothing in here has a destructor: libjpeg jumps over it. False where it did.
bool Decode(std::FILE* file, jpeg_decompress_struct& jpeg, Complaint& complaint,
            Grid<std::uint8_t>& pixels, std::vector<JSAMPLE>& inks) {
  if (setjmp(complaint.back) != 0) return false;
  jpeg_create_decompress(&jpeg);
  jpeg_stdio_src(&jpeg, file);
  jpeg_read_header(&jpeg, TRUE);
  const bool has_inks = jpeg.num_components == kInks;
  if (has_inks) jpeg.out_color_space = JCS_CMYK;
  complaint.in_pixels = true;
  jpeg_start_decompress(&jpeg);
  const int width = static_cast<int>(jpeg.output_width);
  pixels = Grid<std::uint8_t>(width, static_cast<int>(jpeg.output_height),
                              has_inks ? 3 : jpeg.output_components);
  if (has_inks) inks.resize(static_cast<size_t>(width) * kInks);
  while (jpeg.output_scanline < jpeg.output_height) {
    std::uint8_t* row = pixels.row(static_cast<int>(jpeg.output_scanline));
    JSAMPROW pointer = has_inks ? inks.data() : row;
    jpeg_read_scanlines(&jpeg, &pointer, 1);
    if (has_inks) RgbOfInks(inks, jpeg.saw_Adobe_marker, row, width);
  }
  jpeg_finish_decompress(
      &jpeg);  // reads on to the end of the image, and complains of what is there
  return true;
}

}  // namespace

Grid<std::uint8_t> ReadJpegPixels(const std::filesystem::path& file) {
  RequireRegularFile(file);
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> in(std::fopen(file.c_str(), "rb"),
                                                           &std::fclose);
  if (!in) throw Error(file.string() + ": cannot be read");
  Complaint complaint;
  complaint.file = in.get();
  jpeg_decompress_struct jpeg{};
  const std::unique_ptr<jpeg_decompress_struct, void (*)(j_decompress_ptr)> owned(
      &jpeg, &jpeg_destroy_decompress);
  jpeg.err = jpeg_std_error(&complaint.manager);
  complaint.manager.error_exit = Jump;
  complaint.manager.emit_message = Hear;
  Grid<std::uint8_t> pixels;
  std::vector<JSAMPLE> inks;
  const bool decoded = Decode(in.get(), jpeg, complaint, pixels, inks);
  if (!decoded || complaint.words[0] != '\0') {
    throw Error(file.string() + ": damaged image: expected a whole JPEG, found: " +
                complaint.words + "; copy the file again");
  }
  return pixels;
}

}  // namespace dtr::io
