#include "dtr/io/image_io.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/lower_case.h"
#include "dtr/io/alpha.h"
#include "dtr/io/colour_coding.h"
#include "dtr/io/file_colours.h"
#include "dtr/io/heif_exif.h"
#include "dtr/io/heif_items.h"
#include "dtr/io/jpeg_pixels.h"
#include "dtr/io/oiio_files.h"
#include "dtr/io/photo_colours.h"
#include "dtr/io/whole_images.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;

std::optional<double> PositiveNumber(const ImageFacts& facts, const char* name) {
  const float value = facts.Float(name, 0);
  if (!std::isfinite(value) || value <= 0) return std::nullopt;
  return value;
}

// Degrees from EXIF's three rationals (degrees, minutes, seconds); south and west are negative.
std::optional<double> GpsAngle(const ImageFacts& facts, const char* name, const char* ref_name,
                               char negative) {
  const std::vector<float> parts = facts.Floats(name);
  if (parts.size() < 3) return std::nullopt;
  const double angle_deg = parts[0] + parts[1] / 60.0 + parts[2] / 3600.0;
  if (!std::isfinite(angle_deg) || angle_deg < 0 || angle_deg > 180) return std::nullopt;
  const std::string ref = facts.Text(ref_name);
  return !ref.empty() && ref[0] == negative ? -angle_deg : angle_deg;
}

std::optional<GpsPosition> GpsOf(const ImageFacts& facts) {
  const auto latitude = GpsAngle(facts, "GPS:Latitude", "GPS:LatitudeRef", 'S');
  const auto longitude = GpsAngle(facts, "GPS:Longitude", "GPS:LongitudeRef", 'W');
  if (!latitude || !longitude || std::abs(*latitude) > 90) return std::nullopt;
  GpsPosition gps{*latitude, *longitude, std::nullopt, std::nullopt};
  const double altitude_m = facts.Float("GPS:Altitude", NAN);
  const bool below = facts.Int("GPS:AltitudeRef", 0) == 1;
  if (std::isfinite(altitude_m)) gps.altitude_m = below ? -altitude_m : altitude_m;
  gps.horizontal_error_m = PositiveNumber(facts, "GPS:HPositioningError");
  return gps;
}

// EXIF tag 0xA20E counts pixels per unit 0xA210: 2 = inch, 3 = centimetre.
std::optional<double> FocalPlanePxPerMm(const ImageFacts& facts) {
  const auto resolution = PositiveNumber(facts, "Exif:FocalPlaneXResolution");
  if (!resolution) return std::nullopt;
  const int unit = facts.Int("Exif:FocalPlaneResolutionUnit", 2);
  if (unit == 2) return *resolution / 25.4;
  if (unit == 3) return *resolution / 10.0;
  return std::nullopt;
}

// LibRaw's multipliers, relative to green.
std::optional<RawBalance> RawBalanceOf(const ImageFacts& facts) {
  const std::vector<float> factors = facts.Floats("raw:cam_mul");
  if (factors.size() < 3) return std::nullopt;
  RawBalance balance{};
  const double green = factors[1];
  for (size_t c = 0; c < 3; ++c) {
    balance[c] = factors[c] / green;
    if (!(balance[c] > 0) || !std::isfinite(balance[c])) return std::nullopt;
  }
  return balance;
}

int ExifOrientationOf(const ImageFacts& facts) {
  const int orientation = facts.Int("Orientation", 1);
  return orientation >= 1 && orientation <= 8 ? orientation : 1;
}

// Channels to read: RGB of colour images, the one channel of grey ones; alpha and more are left.
int ColourChannels(const ImageFacts& facts) { return facts.channels >= 3 ? 3 : 1; }

// Pixels as 8-bit sRGB with the file's number of colour channels, without what alpha hides.
Grid<std::uint8_t> ReadColours(OpenedImage& in, const fs::path& file, const PhotoColours& colours,
                               const Alpha& alpha) {
  const ImageFacts& facts = in.facts();
  const int channels = ColourChannels(facts);
  Grid<std::uint8_t> pixels(facts.width, facts.height, channels);
  if (facts.sample == Sample::kUint8 && !colours.converts()) {
    ReadPixels(in, file, 0, channels, Sample::kUint8, pixels.data().data());
    alpha.Straighten(pixels.data(), channels);
    return pixels;
  }
  const bool linear = IsFloat(facts.sample);
  std::vector<float> values(pixels.data().size());
  ReadPixels(in, file, 0, channels, Sample::kFloat, values.data());
  if (!std::all_of(values.begin(), values.end(),
                   [](float value) { return std::isfinite(value); })) {
    throw Error(file.string() + ": expected finite colours, found NaN or infinity");
  }
  alpha.Straighten(values, channels);
  if (colours.converts()) {
    colours.Convert(values, channels, pixels.data());
    return pixels;
  }
  for (size_t i = 0; i < values.size(); ++i) {
    pixels.data()[i] =
        linear ? Srgb8FromLinear(values[i])
               : static_cast<std::uint8_t>(std::lround(std::clamp(values[i], 0.0f, 1.0f) * 255.0f));
  }
  return pixels;
}

bool IsOrdinaryJpeg(const OpenedImage& in) {
  const int channels = in.facts().channels;
  return in.format() == "jpeg" && (channels == 1 || channels == 3);
}

// The same of a JPEG. `in` is closed, so that no image is held twice.
Grid<std::uint8_t> ReadJpegColours(OpenedImage& in, const fs::path& file,
                                   const PhotoColours& colours) {
  in.Close();
  Grid<std::uint8_t> pixels = ReadJpegPixels(file);
  if (!colours.converts()) return pixels;
  std::vector<float> values(pixels.data().size());
  std::transform(pixels.data().begin(), pixels.data().end(), values.begin(),
                 [](std::uint8_t value) { return static_cast<float>(value) / 255; });
  colours.Convert(values, pixels.channels(), pixels.data());
  return pixels;
}

ImageRgb8 RgbFromGrey(const Grid<std::uint8_t>& grey) {
  ImageRgb8 rgb(grey.width(), grey.height(), 3);
  for (size_t i = 0; i < grey.data().size(); ++i) {
    std::fill_n(rgb.data().begin() + static_cast<std::ptrdiff_t>(3 * i), 3, grey.data()[i]);
  }
  return rgb;
}

void ExpectRgb(const fs::path& file, const ImageRgb8& image) {
  if (image.empty() || image.channels() != 3) {
    throw Error(file.string() + ": expected an image of 3 channels to write, found " +
                std::to_string(image.empty() ? 0 : image.channels()));
  }
}

ImageToWrite Image8(int width, int height, int channels, Mark mark) {
  ImageToWrite image{width, height, channels};
  if (mark == Mark::kRendered) image.attributes.emplace_back("Software", kRenderedSoftware);
  return image;
}

ImageToWrite Rgb8(const ImageRgb8& image, Mark mark = Mark::kNone) {
  return Image8(image.width(), image.height(), 3, mark);
}

std::string EncodeJpeg(const ImageRgb8& image, int quality, ImageToWrite photo) {
  photo.attributes.emplace_back("CompressionQuality", std::clamp(quality, 1, 100));
  photo.attributes.emplace_back("jpeg:subsampling", "4:4:4");
  return EncodeImage(".jpg", photo, Sample::kUint8, image.data().data());
}

bool IsCmyk(const ImageFacts& facts) { return facts.Text("jpeg:ColorSpace") == "CMYK"; }

// With EXIF that OpenImageIO left in the file. HEIF turns images by properties of its own, which
// the decoder applies (ISO 23008-12, 6.5.10).
std::unique_ptr<ImageFacts> FactsWithExif(const OpenedImage& in, const fs::path& file) {
  const bool is_heif = IsHeif(file);
  return in.FactsWith(is_heif ? ReadHeifExif(file) : ReadWebpExif(file), is_heif);
}

// What a file holds beside the image that is read.
void AddRemarks(OpenedImage& in, ImageHeader& header) {
  const ImageFacts& facts = in.facts();
  const int used = ColourChannels(facts) + (facts.alpha_channel >= 0 ? 1 : 0);
  if (facts.channels > used && !IsCmyk(facts)) {
    header.remarks.push_back("of its " + std::to_string(facts.channels) +
                             " channels only the colours are used");
  }
  // The layers of a PSD are in its first image.
  if (header.format != "psd" && in.HasSecondImage()) {
    header.remarks.push_back("holds more than one image; the first is used");
  }
}

// At the peak of ReadImageAndMask, in its three parts: reading, masking, rotating.
double ReadBytesOf(const OpenedImage& in, const fs::path& file, bool converts) {
  const ImageFacts& facts = in.facts();
  const bool has_alpha = AlphaChannelOf(facts) >= 0;
  const double colours = ColourChannels(facts), alpha = has_alpha ? sizeof(float) : 0;
  const bool as_floats = converts || facts.sample != Sample::kUint8;
  constexpr double kRgb = 3, kMask = 1;
  constexpr double kCoarser = (3 * sizeof(float) + 1) / 3.0;  // FillUnusable: all halvings
  const double reading = colours * (as_floats ? 1 + sizeof(float) : 1) + alpha;
  const double masking =
      kRgb + (colours < kRgb ? colours : 0) + (has_alpha ? alpha + kMask + kCoarser : 0);
  const double rotating = 2 * kRgb + (has_alpha ? alpha + 2 * kMask : 0);
  const double bytes_per_px = std::max({reading, masking, rotating});
  return DecoderBytes(in, file) + bytes_per_px * facts.width * facts.height;
}

}  // namespace

double BytesToReadHeader(const fs::path& file) {
  const auto whole = LookAtWholeImage(file);
  return whole ? whole->bytes() : 0;
}

ImageHeader ReadImageHeader(const fs::path& file, double memory_gb) {
  const auto in = OpenImage(file, {UINT64_MAX, memory_gb});
  const auto stated = FactsWithExif(*in, file);
  const ImageFacts& facts = *stated;
  ImageHeader header;
  header.width_px = facts.width;
  header.height_px = facts.height;
  // OpenImageIO tells the channels that it will convert a CMYK JPEG to, not those of the file.
  header.channels = IsCmyk(facts) ? 4 : facts.channels;
  header.has_alpha = AlphaChannelOf(facts) >= 0;
  header.bits = facts.Int("oiio:BitsPerSample", static_cast<int>(facts.sample_bytes * 8));
  header.is_float = IsFloat(facts.sample);
  header.format = in->format();
  header.exif_orientation = ExifOrientationOf(facts);
  header.focal_mm = PositiveNumber(facts, "Exif:FocalLength");
  header.focal_35mm = PositiveNumber(facts, "Exif:FocalLengthIn35mmFilm");
  header.focal_plane_px_per_mm = FocalPlanePxPerMm(facts);
  header.make = facts.Text("Make");
  header.model = facts.Text("Model");
  header.lens_model = facts.Text("Exif:LensModel");
  header.date_time = facts.Text("Exif:DateTimeOriginal");
  header.gps = GpsOf(facts);
  header.panorama = ReadPanoramaXmp(file);
  header.raw_balance = RawBalanceOf(facts);
  const PhotoColours colours(facts, in->format(), file);
  header.converted = colours.converts();
  header.read_bytes = ReadBytesOf(*in, file, colours.converts());
  header.remarks = colours.remarks();
  AddRemarks(*in, header);
  return header;
}

ImageRgb8 ReadImage(const fs::path& file, const ImageReadOptions& options) {
  return ReadImageAndMask(file, options).image;
}

ImageAndMask ReadImageAndMask(const fs::path& file, const ImageReadOptions& options) {
  const auto in = OpenImage(file, {options.limit_px, options.memory_gb}, options.raw_balance);
  const PhotoColours colours(in->facts(), in->format(), file);
  ExpectMemory(*in, file, ReadBytesOf(*in, file, colours.converts()), options.memory_gb);
  const Alpha alpha(*in, file);
  const int orientation =
      options.apply_exif_orientation ? ExifOrientationOf(*FactsWithExif(*in, file)) : 1;
  Grid<std::uint8_t> pixels = IsOrdinaryJpeg(*in) ? ReadJpegColours(*in, file, colours)
                                                  : ReadColours(*in, file, colours, alpha);
  if (pixels.channels() == 1) pixels = RgbFromGrey(pixels);
  Mask mask = alpha.Usable();
  FillUnusable(pixels, mask);
  if (options.apply_exif_orientation) {
    pixels = ApplyExifOrientation(pixels, orientation);
    mask = ApplyExifOrientation(mask, orientation);
  }
  return {std::move(pixels), std::move(mask), alpha.counts()};
}

Mask ReadMask(const fs::path& file, std::uint64_t limit_px, double memory_gb) {
  const auto in = OpenImage(file, {limit_px, memory_gb});
  ExpectMemory(*in, file, ReadBytesOf(*in, file, false), memory_gb);
  Mask mask(in->facts().width, in->facts().height);
  if (IsOrdinaryJpeg(*in)) {
    in->Close();
    const Grid<std::uint8_t> pixels = ReadJpegPixels(file);
    ExpectSize(*in, file, pixels.width(), pixels.height());
    const auto channels = static_cast<size_t>(pixels.channels());
    for (size_t i = 0; i < mask.data().size(); ++i) mask.data()[i] = pixels.data()[channels * i];
    for (std::uint8_t& value : mask.data()) value = value >= 128 ? 255 : 0;
    return mask;
  }
  ReadPixels(*in, file, 0, 1, Sample::kUint8, mask.data().data());
  for (std::uint8_t& value : mask.data()) value = value >= 128 ? 255 : 0;
  if (AlphaChannelOf(in->facts()) > 0) {
    const Mask opaque = Alpha(*in, file).Usable();
    for (size_t i = 0; i < opaque.data().size(); ++i) mask.data()[i] &= opaque.data()[i];
  }
  return mask;
}

void WriteImage(const fs::path& file, const ImageRgb8& image, int jpeg_quality, Mark mark) {
  ExpectRgb(file, image);
  const std::string extension = LowerExtension(file);
  if (extension == ".png") {
    WriteFileAtomically(file, EncodePng(image, mark));
  } else if (extension == ".jpg" || extension == ".jpeg") {
    WriteFileAtomically(file, EncodeJpeg(image, jpeg_quality, Rgb8(image, mark)));
  } else {
    throw UsageError(file.string() + ": expected a name ending in .png or .jpg, found '" +
                     extension + "'");
  }
}

std::string EncodePng(const ImageRgb8& image, Mark mark) {
  ExpectRgb("PNG", image);
  return EncodeImage(".png", Rgb8(image, mark), Sample::kUint8, image.data().data());
}

void WritePng(const fs::path& file, const ImageRgb8& image) {
  ExpectRgb(file, image);
  WriteFileAtomically(file, EncodePng(image));
}

void WriteImageWithAlpha(const fs::path& file, const ImageRgb8& image, const Mask& alpha,
                         Mark mark) {
  ExpectRgb(file, image);
  if (LowerExtension(file) != ".png") {
    throw UsageError(file.string() + ": expected a name ending in .png, as alpha needs PNG");
  }
  if (alpha.width() != image.width() || alpha.height() != image.height()) {
    throw Error(file.string() + ": expected alpha of the image's size, found " +
                std::to_string(alpha.width()) + "x" + std::to_string(alpha.height()));
  }
  Grid<std::uint8_t> rgba(image.width(), image.height(), 4);
  for (size_t i = 0; i < alpha.data().size(); ++i) {
    for (size_t c = 0; c < 3; ++c) rgba.data()[4 * i + c] = image.data()[3 * i + c];
    rgba.data()[4 * i + 3] = alpha.data()[i];
  }
  ImageToWrite written = Image8(image.width(), image.height(), 4, mark);
  written.attributes.emplace_back("oiio:UnassociatedAlpha", 1);
  WriteFileAtomically(file, EncodeImage(".png", written, Sample::kUint8, rgba.data().data()));
}

void WriteMask(const fs::path& file, const Mask& mask, Mark mark) {
  if (mask.empty() || mask.channels() != 1) {
    throw Error(file.string() + ": expected a mask of 1 channel to write");
  }
  const ImageToWrite image = Image8(mask.width(), mask.height(), 1, mark);
  WriteFileAtomically(file, EncodeImage(".png", image, Sample::kUint8, mask.data().data()));
}

void WriteJpegWithExif(const fs::path& file, const ImageRgb8& image, int quality,
                       const ExifFocal& exif) {
  ExpectRgb(file, image);
  ImageToWrite photo = Rgb8(image);
  auto& attributes = photo.attributes;
  if (!exif.make.empty()) attributes.emplace_back("Make", exif.make);
  if (!exif.model.empty()) attributes.emplace_back("Model", exif.model);
  if (exif.focal_mm) {
    attributes.emplace_back("Exif:FocalLength", static_cast<float>(*exif.focal_mm));
  }
  if (exif.focal_35mm) {
    attributes.emplace_back("Exif:FocalLengthIn35mmFilm",
                            static_cast<int>(std::lround(*exif.focal_35mm)));
  }
  WriteFileAtomically(file, EncodeJpeg(image, quality, std::move(photo)));
}

int InverseExifOrientation(int exif_orientation) {
  return exif_orientation == 6 ? 8 : exif_orientation == 8 ? 6 : exif_orientation;
}

Grid<std::uint8_t> ApplyExifOrientation(const Grid<std::uint8_t>& image, int exif_orientation) {
  if (image.empty() || exif_orientation < 2 || exif_orientation > 8) return image;
  const int w = image.width(), h = image.height();
  const bool transposed = exif_orientation >= 5;
  Grid<std::uint8_t> upright(transposed ? h : w, transposed ? w : h, image.channels());
  // Where pixel (x, y) of the upright image lies in the stored one; EXIF 2.3, tag 0x0112.
  const auto stored = [&](int x, int y) -> std::array<int, 2> {
    switch (exif_orientation) {
      case 2:
        return {w - 1 - x, y};
      case 3:
        return {w - 1 - x, h - 1 - y};
      case 4:
        return {x, h - 1 - y};
      case 5:
        return {y, x};
      case 6:
        return {y, h - 1 - x};
      case 7:
        return {w - 1 - y, h - 1 - x};
      default:
        return {w - 1 - y, x};
    }
  };
  for (int y = 0; y < upright.height(); ++y) {
    for (int x = 0; x < upright.width(); ++x) {
      const auto [sx, sy] = stored(x, y);
      for (int c = 0; c < image.channels(); ++c) upright(x, y, c) = image(sx, sy, c);
    }
  }
  return upright;
}

}  // namespace dtr::io
