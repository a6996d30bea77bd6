// capture/layout_names.h -- internal to capture: what the name of an image says it is.
#pragma once
#include <string>

namespace dtr::capture {

enum class ImageKind {
  kPhoto,
  kMask,
  kInverseMask,  ///< bright where the photo is not to be used
  kDepth,
  kNormals,
  kConfidence,
  kLabels,
  kPreview
};

/// What words in a name, or in the folders above, say.
struct NamedImage {
  ImageKind kind = ImageKind::kPhoto;
  bool by_folder = false;  ///< a folder says the kind, not the file
  /// The name without words for kinds, extensions and words that mean a photo: equal for a photo
  /// and what belongs to it. `short_key` lacks a number behind the word too ("r_0_depth_0001").
  std::string key, short_key;
};

NamedImage ReadName(const std::string& name);
/// Whether any word of a folder's name, whatever stands beside it, means masks: "sky_masks".
bool IsCalledMasks(const std::string& folder);

/// The last part of a name without its extension, and without that of the photo in NAME.jpg.png.
std::string BareName(const std::string& name);
/// The folders of a name: "" for none.
std::string FolderOf(const std::string& name);

/// Whether a folder among those of a name is one that reconstruction programs write (Meshroom,
/// OpenDroneMap, OpenSfM).
bool IsProgramOutput(const std::string& name);

}  // namespace dtr::capture
