#include "dtr/io/small_jpeg.h"

#include <algorithm>
#include <csetjmp>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <memory>
#include <stdexcept>

#include <jpeglib.h>  // needs cstdio before it

#include "dtr/base/error.h"

namespace dtr::io {
namespace {

// Of brightness and colours at quality 50. All frequencies alike: for rendering from photos, errors
// count, not how visible they are in one photo.
constexpr unsigned kSteps[] = {30, 40};

// libjpeg ends the program on errors unless error_exit jumps; its text is kept.
struct ErrorText {
  jpeg_error_mgr manager{};  // first: libjpeg knows it by this
  std::jmp_buf back{};
  char text[JMSG_LENGTH_MAX] = "";
};

void Jump(j_common_ptr jpeg) {
  auto* error = reinterpret_cast<ErrorText*>(jpeg->err);
  jpeg->err->format_message(jpeg, error->text);
  std::longjmp(error->back, 1);
}

// Nothing in here has a destructor: libjpeg jumps over it.
bool Encode(const ImageRgb8& image, int quality, jpeg_compress_struct& jpeg, ErrorText& error,
            unsigned char*& bytes, unsigned long& size) {
  if (setjmp(error.back) != 0) return false;
  jpeg_create_compress(&jpeg);
  jpeg_mem_dest(&jpeg, &bytes, &size);
  jpeg.image_width = static_cast<JDIMENSION>(image.width());
  jpeg.image_height = static_cast<JDIMENSION>(image.height());
  jpeg.input_components = 3;
  jpeg.in_color_space = JCS_RGB;
  jpeg_set_defaults(&jpeg);
  for (int which = 0; which < 2; ++which) {
    unsigned steps[DCTSIZE2];
    std::fill(std::begin(steps), std::end(steps), kSteps[which]);
    jpeg_add_quant_table(&jpeg, which, steps, jpeg_quality_scaling(quality), TRUE);
  }
  for (int c = 0; c < 3; ++c) jpeg.comp_info[c].h_samp_factor = jpeg.comp_info[c].v_samp_factor = 1;
  jpeg_simple_progression(&jpeg);  // with Huffman tables made for each scan
  jpeg_start_compress(&jpeg, TRUE);
  while (jpeg.next_scanline < jpeg.image_height) {
    // libjpeg reads it alone.
    JSAMPROW row = const_cast<JSAMPROW>(image.row(static_cast<int>(jpeg.next_scanline)));
    jpeg_write_scanlines(&jpeg, &row, 1);
  }
  jpeg_finish_compress(&jpeg);
  return true;
}

}  // namespace

std::string SmallJpeg(const ImageRgb8& image, int quality) {
  if (image.empty() || image.channels() != 3) {
    throw std::invalid_argument("SmallJpeg: expected an image of 3 channels");
  }
  ErrorText error;
  jpeg_compress_struct jpeg{};
  jpeg.err = jpeg_std_error(&error.manager);
  error.manager.error_exit = Jump;
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const bool encoded = Encode(image, quality, jpeg, error, bytes, size);
  jpeg_destroy_compress(&jpeg);
  const std::unique_ptr<unsigned char, decltype(&std::free)> owner(bytes, &std::free);
  if (!encoded) throw Error(std::string("cannot code a JPEG: ") + error.text);
  return {reinterpret_cast<const char*>(bytes), size};
}

}  // namespace dtr::io
