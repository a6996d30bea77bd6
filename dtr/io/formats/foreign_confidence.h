// dtr/io/formats/foreign_confidence.h -- what phones say of the depth that they measured.
#pragma once
#include <filesystem>
#include <string>
#include <utility>

#include "dtr/types/depth_image.h"

namespace dtr::io {

/// Maps that say of each pixel of a depth map how sure the phone is: 0 is the lowest, above that
/// programs differ (ARKit has 0, 1 and 2).
struct ConfidenceMaps {
  std::filesystem::path folder;  ///< empty: there are none
  /// Their files are called as the depth maps, with this: ".png" (8 bits), or ".conf" (Record3D's:
  /// LZFSE of bytes).
  std::string extension;
  /// Where the names of depth maps begin with the first, those of the confidence maps begin with
  /// the second.
  std::pair<std::string, std::string> prefix = {};

  /// The map of a depth map of this name; empty: there is none.
  std::filesystem::path FileOf(const std::filesystem::path& depth_file) const;
};

/// Share of a map's pixels that have the lowest confidence. Throws Error for a file that is damaged
/// or cut short.
double LowConfidenceShare(const std::filesystem::path& confidence_file);

/// Makes holes of the pixels of `depth` that have the lowest confidence. Throws Error for a file
/// that is damaged or of another size than the depth map.
void LeaveOutLowConfidence(const std::filesystem::path& confidence_file, DepthImage& depth);

}  // namespace dtr::io
