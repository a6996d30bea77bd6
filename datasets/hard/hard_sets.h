// datasets/hard/hard_sets.h -- small sets of photos that structure from motion fails at: walks,
// walls, rotations, few photos, wrong EXIF, repeated structure. Their cameras are known exactly.
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "datasets/scene.h"
#include "dtr/types/pose.h"

namespace dtr::datasets {

/// One photo of a hard set.
struct HardPhoto {
  Pose cam_from_world;
  double focal_35mm = 28;  ///< of a frame 36 mm wide
  int width_px = 480, height_px = 320;
  double gain = 1;         ///< factor on linear light
  int blur_px = 0;         ///< half the length of a horizontal motion blur
  bool has_exif = true;    ///< a focal length in EXIF
  double exif_factor = 1;  ///< what EXIF says of the true focal length
};

struct HardSet {
  std::string name, what;  ///< what is hard, one clause
  std::shared_ptr<const Scene> scene;
  std::vector<HardPhoto> photos;
};

/// All hard sets, always the same.
std::vector<HardSet> HardSets();

/// Writes `photos/0000.jpg`, ... and `cameras.json`, the exact cameras, into `folder`, which must
/// not exist yet; the same bytes for any number of threads. Throws UsageError where it exists,
/// Error where it cannot be written.
void WriteHardSet(const HardSet& set, const std::filesystem::path& folder);

}  // namespace dtr::datasets
