// dtr/io/panorama_xmp.h -- what photos and video frames state about being a 360 degree panorama:
// Google's Photo Sphere XMP (namespace GPano).
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "dtr/types/grid.h"

namespace dtr::io {

/// The fields of GPano that say what an image shows. Sizes 0: not stated.
struct PanoramaXmp {
  std::string projection;  ///< "equirectangular" or another word, lower case
  double full_width_px = 0, full_height_px = 0;
  double cropped_width_px = 0, cropped_height_px = 0;  ///< of this image, when it was written
  double left_px = 0, top_px = 0;                      ///< of this image in the whole sphere's
  /// How the camera stood, degrees; not needed, since photos show it.
  std::optional<double> heading_deg, pitch_deg, roll_deg;

  bool operator==(const PanoramaXmp&) const = default;
};

/// The fields in the text of an XMP packet, as attributes or elements; empty where there is no
/// GPano:ProjectionType. Numbers that are none, not finite or negative sizes are left out.
std::optional<PanoramaXmp> PanoramaXmpIn(std::string_view xmp);

/// The same of a file, whatever its format: the first packet with GPano among its first and last
/// mebibyte, where cameras and stitchers write it. Empty where the file cannot be read.
std::optional<PanoramaXmp> ReadPanoramaXmp(const std::filesystem::path& file);

/// Writes a JPEG (4:4:4) that states to be a whole equirectangular panorama: for generators.
void WritePanoramaJpeg(const std::filesystem::path& file, const ImageRgb8& image, int quality);

}  // namespace dtr::io
