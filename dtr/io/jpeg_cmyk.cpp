#include "dtr/io/jpeg_cmyk.h"

#include <csetjmp>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <jpeglib.h>  // needs cstdio before it

#include "dtr/base/error.h"
#include "dtr/base/regular_file.h"

namespace dtr::io {
namespace {

constexpr int kInks = 4;

// libjpeg ends the program on errors unless told to jump; what it says is kept.
struct Complaint {
  jpeg_error_mgr manager{};  // first: libjpeg knows it by this
  std::jmp_buf back{};
  char words[JMSG_LENGTH_MAX] = "";
};

void Jump(j_common_ptr jpeg) {
  auto* complaint = reinterpret_cast<Complaint*>(jpeg->err);
  jpeg->err->format_message(jpeg, complaint->words);
  std::longjmp(complaint->back, 1);
}

void KeepQuiet(j_common_ptr) {}

std::uint8_t Light(int ink, int black) {
  return static_cast<std::uint8_t>(((255 - ink) * (255 - black) + 127) / 255);
}

// Nothing in here has a destructor: libjpeg jumps over it. True when the pixels were asked for and
// are there.
bool Decode(std::FILE* file, jpeg_decompress_struct& jpeg, Complaint& complaint,
            Grid<std::uint8_t>& rgb, std::vector<JSAMPLE>& row) {
  if (setjmp(complaint.back) != 0) return false;
  jpeg_create_decompress(&jpeg);
  jpeg_stdio_src(&jpeg, file);
  jpeg_read_header(&jpeg, TRUE);
  if (jpeg.num_components != kInks || jpeg.saw_Adobe_marker) return true;
  jpeg.out_color_space = JCS_CMYK;
  jpeg_start_decompress(&jpeg);
  const int width = static_cast<int>(jpeg.output_width);
  rgb = Grid<std::uint8_t>(width, static_cast<int>(jpeg.output_height), 3);
  row.resize(static_cast<size_t>(width) * kInks);
  while (jpeg.output_scanline < jpeg.output_height) {
    const int y = static_cast<int>(jpeg.output_scanline);
    JSAMPROW pointer = row.data();
    jpeg_read_scanlines(&jpeg, &pointer, 1);
    for (int x = 0; x < width; ++x) {
      const JSAMPLE* inks = &row[static_cast<size_t>(x) * kInks];
      for (int c = 0; c < 3; ++c) rgb(x, y, c) = Light(inks[c], inks[3]);
    }
  }
  jpeg_finish_decompress(&jpeg);
  return true;
}

}  // namespace

std::optional<Grid<std::uint8_t>> ReadPlainCmykJpeg(const std::filesystem::path& file) {
  RequireRegularFile(file);
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> in(std::fopen(file.c_str(), "rb"),
                                                           &std::fclose);
  if (!in) throw Error(file.string() + ": cannot be read");
  Complaint complaint;
  jpeg_decompress_struct jpeg{};
  jpeg.err = jpeg_std_error(&complaint.manager);
  complaint.manager.error_exit = Jump;
  complaint.manager.output_message = KeepQuiet;
  Grid<std::uint8_t> rgb;
  std::vector<JSAMPLE> row;
  const bool decoded = Decode(in.get(), jpeg, complaint, rgb, row);
  const bool whole = complaint.manager.num_warnings == 0;
  jpeg_destroy_decompress(&jpeg);
  if (!decoded || (!rgb.empty() && !whole)) {
    throw Error(file.string() + ": damaged image: expected a whole JPEG, found: " +
                (decoded ? "data that end early or are spoiled" : complaint.words) +
                "; copy the file again");
  }
  if (rgb.empty()) return std::nullopt;
  return rgb;
}

}  // namespace dtr::io
