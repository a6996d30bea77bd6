// dtr/io/image_io.h -- photos and masks in, images out.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "dtr/io/panorama_xmp.h"
#include "dtr/io/rendered_mark.h"
#include "dtr/types/grid.h"

namespace dtr::io {

/// Where a photo says it was taken, WGS84 (EXIF tags 0x8825).
struct GpsPosition {
  double latitude_deg = 0;           ///< north positive
  double longitude_deg = 0;          ///< east positive
  std::optional<double> altitude_m;  ///< above sea level
  /// Radius that the place is known to on the map (EXIF GPSHPositioningError), where it is said.
  std::optional<double> horizontal_error_m = std::nullopt;
};

/// White balance of a raw file: factors of red, green (1) and blue of the sensor.
using RawBalance = std::array<double, 3>;

/// What a file says about its image, before any pixel is read.
struct ImageHeader {
  int width_px = 0, height_px = 0;  ///< as stored, before the EXIF orientation
  int channels = 0;
  bool has_alpha = false;    ///< one of the channels is alpha, which may be opaque throughout
  int bits = 0;              ///< per channel
  bool is_float = false;     ///< float samples: linear light by convention
  std::string format;        ///< OpenImageIO's name of the format: "jpeg", "png", ...
  int exif_orientation = 1;  ///< 1..8; 1 = upright
  std::optional<double> focal_mm;
  std::optional<double> focal_35mm;  ///< 35 mm equivalent, as the camera wrote it
  /// Pixels per millimetre on the sensor, horizontal, where the file tells it.
  std::optional<double> focal_plane_px_per_mm;
  std::string make, model, lens_model;
  std::string date_time;  ///< "YYYY:MM:DD HH:MM:SS" of the exposure, or empty
  std::optional<GpsPosition> gps;
  std::optional<PanoramaXmp> panorama;  ///< what it states about being a 360 degree panorama
  /// Of raw files: what the camera chose for this photo.
  std::optional<RawBalance> raw_balance;
  bool converted = false;  ///< integer samples that are not sRGB's: ReadImage converts them
  double read_bytes = 0;   ///< memory that ReadImageAndMask takes at its peak, its result included
  /// One line for each thing that the file holds or states and that ReadImage does not use.
  std::vector<std::string> remarks;
};

/// What reading an image may take where nothing else is said, 1e9 bytes.
inline constexpr double kImageMemoryGb = 4;

/// Reads a file's header. Throws Error when the file is no image OpenImageIO knows, where ReadImage
/// could not convert its colours, and before anything is allocated for an image that its decoder
/// would unpack beyond `memory_gb` (0: no bound) only to tell its header.
/// EXIF values that make no sense (zero, negative, NaN) are left out, as cameras write zeros there.
ImageHeader ReadImageHeader(const std::filesystem::path& file, double memory_gb = kImageMemoryGb);

/// What ReadImageHeader takes: 0 but for formats whose decoders unpack the whole image.
double BytesToReadHeader(const std::filesystem::path& file);

/// Whether a file begins as PNG, JPEG, TIFF, OpenEXR, WebP, HEIF or AVIF, whatever it is called.
bool HoldsPhoto(const std::filesystem::path& file);

/// Default of the reading limits: 400 Mpx hold every camera sold, and 1.2 GB of memory at RGB.
inline constexpr std::uint64_t kImageLimitPx = 400'000'000;

struct ImageReadOptions {
  bool apply_exif_orientation = false;  ///< turn the image upright
  /// Of raw files: in place of what the camera chose for each photo; of others nothing.
  std::optional<RawBalance> raw_balance = {};
  std::uint64_t limit_px = kImageLimitPx;  ///< larger images are rejected before allocation
  /// So are those that reading would take more for, 1e9 bytes; 0: whoever calls has seen to that.
  double memory_gb = kImageMemoryGb;
};

/// Reads an image as 8-bit sRGB of 3 channels.
/// Grey becomes RGB. Alpha is no part of the result, and neither are colours hidden by it: see
/// ReadImageAndMask, which gives the mask too. CMYK JPEG is converted without a colour
/// profile, taken to be inverted where it bears Adobe's marker, as Adobe's programs write it.
/// Integer samples are converted by the file's ICC profile (lcms2, relative colorimetric), by the
/// numbers of cICP or nclx (HDR: see SrgbConverter), by PNG's gAMA and cHRM or by EXIF's Adobe RGB;
/// those of other files are taken as sRGB-coded. Float and half samples (EXR, HDR, float TIFF) are
/// taken as linear light in the primaries of the file, else sRGB's. All are clipped to [0, 1] and
/// rounded to 8 bits.
/// Raw files are developed by LibRaw without automatic brightness.
/// NaN and infinity among them are rejected. Only the first image of a file is read.
/// Throws Error when the file is no image, is damaged or cut short, or is larger than the limits.
ImageRgb8 ReadImage(const std::filesystem::path& file, const ImageReadOptions& options = {});

/// How many pixels of an image its alpha does not leave opaque.
struct AlphaCounts {
  std::int64_t transparent_px = 0;
  std::int64_t partial_px = 0;  ///< neither transparent nor opaque
  bool any() const { return transparent_px > 0 || partial_px > 0; }
};

/// An image with what its alpha channel says of it.
struct ImageAndMask {
  ImageRgb8 image;
  Mask mask;  ///< empty: all of the image is usable
  AlphaCounts alpha;
};

/// ReadImage with the alpha channel as a mask: pixels are usable from an alpha of one half up,
/// where most of the light is the object's. Premultiplied colours are divided by alpha. What is not
/// usable has colours that continue the usable ones smoothly, never those that the file hides
/// there: no filter, feature or JPEG can bring them back. An image that is transparent throughout
/// has a mask of zeros. Throws like ReadImage.
ImageAndMask ReadImageAndMask(const std::filesystem::path& file,
                              const ImageReadOptions& options = {});

/// The alpha of several photos.
struct AlphaTotals {
  std::int64_t masked_photos = 0;   ///< of which alpha leaves some pixels out
  std::int64_t partial_photos = 0;  ///< with pixels that are partly transparent
  std::int64_t partial_px = 0;
  void Add(const AlphaCounts& photo, bool masks);
  /// One line for people; empty where there is nothing to say.
  std::string Line() const;
};

/// Reads a mask: the first channel, usable (255) from half of full scale up, else 0. A mask that
/// went through JPEG thus keeps its shape. Where the mask itself has alpha, that must be at least
/// one half too. Throws like ReadImage.
Mask ReadMask(const std::filesystem::path& file, std::uint64_t limit_px = kImageLimitPx,
              double memory_gb = kImageMemoryGb);

inline constexpr int kDefaultJpegQuality = 95;

/// Writes a PNG (lossless) or JPEG (4:4:4, `jpeg_quality` 1..100), by the file's extension.
/// Atomic, and the same bytes for the same image: no times, no names. `mark`: what the file says
/// of itself.
/// Throws UsageError for another extension, Error when the file cannot be written.
void WriteImage(const std::filesystem::path& file, const ImageRgb8& image,
                int jpeg_quality = kDefaultJpegQuality, Mark mark = Mark::kNone);

/// A PNG file in memory. Throws Error where the image has not 3 channels.
std::string EncodePng(const ImageRgb8& image, Mark mark = Mark::kNone);

/// The same as PNG, whatever the file is called.
void WritePng(const std::filesystem::path& file, const ImageRgb8& image);

/// Writes a PNG with an alpha channel (not multiplied in). `alpha` must have the image's size.
void WriteImageWithAlpha(const std::filesystem::path& file, const ImageRgb8& image,
                         const Mask& alpha, Mark mark = Mark::kNone);

/// Writes an 8-bit grey PNG.
void WriteMask(const std::filesystem::path& file, const Mask& mask, Mark mark = Mark::kNone);

/// What a camera would have written about its lens.
struct ExifFocal {
  std::optional<double> focal_mm;
  std::optional<double> focal_35mm;  ///< rounded to whole millimetres, as EXIF stores it
  std::string make, model;
};

/// Writes a JPEG (4:4:4) with EXIF, as a camera would: for photos made by generators.
void WriteJpegWithExif(const std::filesystem::path& file, const ImageRgb8& image, int quality,
                       const ExifFocal& exif);

/// The image or mask as it must be turned for EXIF orientation 1..8 (others: unchanged), of any
/// number of channels.
Grid<std::uint8_t> ApplyExifOrientation(const Grid<std::uint8_t>& image, int exif_orientation);

/// The orientation that undoes another: 6 and 8 undo each other, all others themselves.
int InverseExifOrientation(int exif_orientation);

}  // namespace dtr::io
