// pipeline/core/cameras/known_poses.h -- cameras from a file instead of from SfM.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/sfm/run/sfm.h"
#include "dtr/io/formats/cameras_json.h"
#include "pipeline/core/calibrate.h"
#include "pipeline/core/photos/camera_groups.h"

namespace dtr::pipeline {

/// Photos as COLMAP gets them, with the groups that share intrinsics; `folder` is what
/// capture::PrepareSfmImages fills.
std::vector<sfm::SfmImageInput> SfmInputs(const capture::Capture& capture,
                                          const CameraGroups& groups,
                                          const std::filesystem::path& folder);
sfm::SfmOptions SfmOptionsFor(const CalibrateOptions& options,
                              const std::optional<sfm::SfmPart>& part = {});

/// Whether other processes work in the folder of structure from motion at the same time.
bool IsShared(const std::optional<sfm::SfmPart>& part);
/// capture::PrepareSfmImages into `folder`, unless a process before did that for several.
void PreparePhotos(const capture::Capture& photos, const CalibrateOptions& options,
                   const std::optional<sfm::SfmPart>& part, const std::filesystem::path& folder,
                   Progress& progress);

/// Cameras of a file, with lines about it that are worth telling.
struct PosesFile {
  io::CameraList list;
  std::vector<std::string> notes;
  /// The same with points, where the file says which photos show them; of COLMAP alone: `list` has
  /// no cameras then.
  std::optional<calib::SfmModel> model;
};

/// Reads cameras of any format of CameraFormatTable() for photos; `format`: its
/// name, empty: by the content. Throws UsageError where it is not recognised, Error for a broken
/// file or one of other photos.
PosesFile ReadPoses(const capture::Capture& capture, const std::filesystem::path& poses,
                    const std::string& format);

/// The cameras of `list`, tested (given_cameras.h), with the points that photos show, triangulated
/// with the cameras fixed. With options.refine_poses they are then adjusted where that pays. Of
/// `options` threads, seed, memory, poses, sfm, refine_poses and held_out (for each photo) are
/// used; photos that are held out give no points, unless cameras are to be adjusted.
CalibratedPhotos WithPointsOfPhotos(const io::CameraList& list, const capture::Capture& photos,
                                    const CalibrateOptions& options,
                                    const std::filesystem::path& workspace, Progress& progress);

/// The same of cameras whose file brings the points: `model`, of `photos`.
CalibratedPhotos WithPointsOfFile(calib::SfmModel model, const capture::Capture& photos,
                                  const CalibrateOptions& options,
                                  const std::filesystem::path& workspace, Progress& progress);

/// Cameras from options.poses: the folder of a COLMAP model, or a file as of ReadPoses.
/// Where these bring no points, points are triangulated with the cameras held fixed, from photos
/// that are not held out. Cameras far from the origin get a world origin
/// near them (io::RecentreWorld). Photos that the file does not name stay without a camera. Throws
/// Error when the file is broken or names too few of the photos. `part`: as of CalibratePhotos.
CalibratedPhotos FromKnownPoses(const capture::Capture& capture, const CalibrateOptions& options,
                                const std::filesystem::path& workspace,
                                const std::optional<sfm::SfmPart>& part, Progress& progress);

/// Adds the poses of held-out photos to a model that was made without them. Nothing else of the
/// model changes; photos that cannot be registered are left out. `panoramas`: the rig that all
/// photos are views of, or null: then all views of a panorama stand as it says, where most of them
/// were found to be.
void RegisterHeldOutPhotos(const capture::Capture& held_out,
                           const std::vector<sfm::SfmImageInput>& sources,
                           const CameraGroups& groups, const std::filesystem::path& workspace,
                           const sfm::SfmOptions& options, const SetRig* panoramas,
                           calib::SfmModel& model, Progress& progress);

}  // namespace dtr::pipeline
