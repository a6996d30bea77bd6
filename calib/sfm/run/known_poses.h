// calib/sfm/run/known_poses.h -- sparse points for photos whose cameras and poses are given.
#pragma once
#include <filesystem>
#include <span>
#include <string>

#include "calib/lens_camera.h"
#include "calib/sfm/run/sfm.h"
#include "dtr/types/pose.h"

namespace dtr::sfm {

/// A photo with its known camera. The photo may be distorted as `camera` says.
struct PosedImage {
  std::string name;  ///< file below images_dir
  calib::LensCamera camera;
  Pose cam_from_world;
  std::filesystem::path mask_file = {};  ///< as SfmImageInput has
};

/// Throws Error where no pairs of as many photos have anything in common.
void RequireMatches(size_t pairs, size_t photos);

/// Features, matching and point triangulation with poses and intrinsics held fixed. The model that
/// comes back carries exactly the given cameras and poses (a camera per distinct LensCamera) and
/// all images, in order of names. Workspace, checkpoints and errors as in RunSfm;
/// options.lens_model and share_intrinsics_within_group have no say here. Throws Error also when
/// COLMAP moved a camera by more than 1e-9 (colmap/triangulator.cpp). A report that lists
/// not_registered names photos without any point. `part`: as RunSfm's.
SfmResult TriangulateWithPoses(const std::filesystem::path& images_dir,
                               std::span<const PosedImage> images,
                               const std::filesystem::path& workspace, const SfmOptions& options,
                               Progress& progress, const std::optional<SfmPart>& part = {});

/// Matches of photos whose cameras are not believed: features and matching by calib/sfm in
/// `workspace`, focal lengths by a vote. Indices into `images`, whose priors play no part. Throws
/// as RunSfm does.
std::vector<calib::MatchedPair> MatchWithoutCameras(const std::filesystem::path& images_dir,
                                                    std::span<const PosedImage> images,
                                                    const std::filesystem::path& workspace,
                                                    const SfmOptions& options, Progress& progress);

}  // namespace dtr::sfm
