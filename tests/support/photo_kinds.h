// tests/support/photo_kinds.h -- an image as other programs and cameras would write it.
#pragma once
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include <jpeglib.h>  // needs cstdio before it

#include "dtr/io/image_io.h"
#include "dtr/types/grid.h"

namespace dtr::testing {

/// Values as they are, without this project's writers.
template <typename T>
void WriteForeign(const std::filesystem::path& file, const OIIO::ImageSpec& spec,
                  const std::vector<T>& values) {
  const auto out = OIIO::ImageOutput::create(file.string());
  ASSERT_TRUE(out && out->open(file.string(), spec)) << file;
  ASSERT_TRUE(out->write_image(OIIO::BaseTypeFromC<T>::value, values.data()));
  ASSERT_TRUE(out->close());
}

/// One channel, the green one.
inline void WriteGrey(const std::filesystem::path& file, const ImageRgb8& image) {
  Mask grey(image.width(), image.height());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) grey(x, y) = image(x, y, 1);
  }
  io::WriteMask(file, grey);
}

inline void WriteSixteenBits(const std::filesystem::path& file, const ImageRgb8& image) {
  std::vector<std::uint16_t> values;
  for (const std::uint8_t value : image.data()) {
    values.push_back(static_cast<std::uint16_t>(257 * value));
  }
  WriteForeign(file, {image.width(), image.height(), 3, OIIO::TypeDesc::UINT16}, values);
}

/// Alpha that would change every colour if it were multiplied in.
inline void WriteAlpha(const std::filesystem::path& file, const ImageRgb8& image) {
  io::WriteImageWithAlpha(file, image, Mask(image.width(), image.height(), 1, 200));
}

/// Linear light in floats, as renderers and cameras' raw converters give.
inline void WriteLinear(const std::filesystem::path& file, const ImageRgb8& image) {
  std::vector<float> values;
  for (const std::uint8_t value : image.data()) {
    const double s = value / 255.0;  // IEC 61966-2-1
    values.push_back(
        static_cast<float>(s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4)));
  }
  WriteForeign(file, {image.width(), image.height(), 3, OIIO::TypeDesc::FLOAT}, values);
}

/// Stored lying on its side: EXIF orientation 6, whose stored left edge is the top.
inline void WriteTurned(const std::filesystem::path& file, const ImageRgb8& image) {
  const int height = image.height();
  std::vector<std::uint8_t> values;
  for (int y = 0; y < image.width(); ++y) {  // upright (x, y) is stored at (y, width - 1 - x)
    for (int x = 0; x < height; ++x) {
      for (int c = 0; c < 3; ++c) values.push_back(image(image.width() - 1 - y, x, c));
    }
  }
  OIIO::ImageSpec spec(height, image.width(), 3, OIIO::TypeDesc::UINT8);
  spec.attribute("Orientation", 6);
  WriteForeign(file, spec, values);
}

inline void WriteProgressive(const std::filesystem::path& file, const ImageRgb8& image) {
  OIIO::ImageSpec spec(image.width(), image.height(), 3, OIIO::TypeDesc::UINT8);
  spec.attribute("CompressionQuality", 100);
  spec.attribute("jpeg:progressive", 1);
  spec.attribute("jpeg:subsampling", "4:4:4");
  WriteForeign<std::uint8_t>(file, spec, {image.data().begin(), image.data().end()});
}

/// How a JPEG is coded. Adobe's marker says that inks are inverted, and that colours are not
/// transformed.
struct JpegKind {
  J_COLOR_SPACE space, coded;
  bool adobe = false;
  int across = 1, down = 1;  ///< luma is sampled so often as the chroma
};

/// Values of `kind.space`, pixel by pixel.
inline void WriteJpegAs(const std::filesystem::path& file, int width_px, int height_px,
                        std::vector<JSAMPLE> values, const JpegKind& kind) {
  std::FILE* out = std::fopen(file.c_str(), "wb");
  ASSERT_NE(out, nullptr);
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  jpeg_stdio_dest(&jpeg, out);
  jpeg.image_width = static_cast<JDIMENSION>(width_px);
  jpeg.image_height = static_cast<JDIMENSION>(height_px);
  jpeg.input_components = kind.space == JCS_CMYK ? 4 : 3;
  jpeg.in_color_space = kind.space;
  jpeg_set_defaults(&jpeg);
  jpeg_set_colorspace(&jpeg, kind.coded);
  jpeg_set_quality(&jpeg, 100, TRUE);
  jpeg.write_Adobe_marker = kind.adobe ? TRUE : FALSE;
  jpeg.write_JFIF_header = kind.coded == JCS_YCbCr && !kind.adobe ? TRUE : FALSE;
  for (int i = 0; i < jpeg.num_components; ++i) {
    const bool luma = i == 0 || i == 3;
    jpeg.comp_info[i].h_samp_factor = luma ? kind.across : 1;
    jpeg.comp_info[i].v_samp_factor = luma ? kind.down : 1;
  }
  jpeg_start_compress(&jpeg, TRUE);
  for (int y = 0; y < height_px; ++y) {
    JSAMPROW row =
        values.data() + static_cast<std::ptrdiff_t>(jpeg.input_components) * width_px * y;
    jpeg_write_scanlines(&jpeg, &row, 1);
  }
  jpeg_finish_compress(&jpeg);
  jpeg_destroy_compress(&jpeg);
  std::fclose(out);
}

/// Four values a pixel, as printers mix colours; `marker`: with Adobe's marker.
inline void WriteInks(const std::filesystem::path& file, int width_px, int height_px,
                      const std::vector<JSAMPLE>& inks, bool marker) {
  WriteJpegAs(file, width_px, height_px, inks, {JCS_CMYK, JCS_CMYK, marker});
}

/// The image in cyan, magenta and yellow, without black.
inline void WriteCmyk(const std::filesystem::path& file, const ImageRgb8& image) {
  std::vector<JSAMPLE> inks;
  for (size_t i = 0; i < image.data().size(); ++i) {
    inks.push_back(static_cast<JSAMPLE>(255 - image.data()[i]));
    if (i % 3 == 2) inks.push_back(0);
  }
  WriteInks(file, image.width(), image.height(), inks, false);
}

}  // namespace dtr::testing
