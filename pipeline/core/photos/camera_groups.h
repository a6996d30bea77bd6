// pipeline/core/photos/camera_groups.h -- which photos share intrinsics in structure from motion.
#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "capture/photo.h"
#include "pipeline/core/sfm_settings.h"

namespace dtr::pipeline {

/// Photos of one camera group (EXIF, size) that lie in several folders: one camera or several?
struct FolderPool {
  std::string group;  ///< what the photos have in common
  /// By folder ("" is the top one), those with intrinsics of their own: how many photos SfM has of
  /// it. Photos of other folders share with the largest of these.
  std::map<std::string, int> photos_of;
  std::string largest;             ///< key of photos_of
  std::vector<std::string> small;  ///< folders with too few photos for intrinsics of their own
};

/// A folder needs so many photos for intrinsics of its own: with two, one pair alone would decide.
inline constexpr int kMinPhotosPerFolder = 3;

/// Folder of a photo below the photo folder, "" for the top one.
std::string FolderOf(const std::string& photo_name);

/// Names for SfmImageInput::camera_group. Photos of different size never share intrinsics, nor do
/// photos that EXIF turned with others, whatever is asked.
///  kAuto    by capture::Photo::camera_group and folder: whether folders share is tested afterwards
///           (folder_cameras.h)
///  kFolder  one per folder; kPhoto: one per photo; kSet: one for all
class CameraGroups {
 public:
  /// `photos`: those of structure from motion. `given`: the groups of the photos are taken as they
  /// are (a rig's cameras, a camera that is known).
  CameraGroups(const std::vector<capture::Photo>& photos, CameraPer per, bool given);

  /// Of photos that were not in the list, too.
  std::string GroupOf(const capture::Photo& photo) const;
  /// With kAuto: the groups whose photos lie in several folders, where these have intrinsics of
  /// their own.
  const std::vector<FolderPool>& pools() const { return pools_; }
  /// The folder of `pool` whose intrinsics the photo has; empty for a photo of another group.
  std::optional<std::string> FolderIn(const FolderPool& pool, const capture::Photo& photo) const;

 private:
  CameraPer per_;
  bool given_;
  std::vector<FolderPool> pools_;
};

}  // namespace dtr::pipeline
