// calib/colmap/sfm_steps.h -- the steps that structure from motion and triangulation share.
#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/colmap/features.h"
#include "calib/colmap/matching.h"
#include "calib/colmap/workspace.h"

namespace dtr::colmap {

/// The lens model of the options. Throws UsageError on an unknown name.
calib::CameraModel CameraModelOf(const SfmOptions& options);

/// What is known of photos before they are matched.
struct PhotosToMatch {
  std::vector<CameraGroup> groups;
  /// Of the pairs that options.matching names only these (a < b, sorted; numbers of images()) are
  /// matched, where they are given.
  std::optional<ImagePairs> allowed = {};
  bool known_lenses = false;  ///< the groups' parameters are given, not guesses
};

/// Steps "features" and "matches": fills workspace.database(). What was planned goes to `report`.
/// `part`: this alone.
void FeaturesAndMatches(Workspace& workspace, const PhotosToMatch& photos,
                        const SfmOptions& options, SfmReport& report,
                        const std::optional<SfmPart>& part = {});

/// Fills in what every report has: runs, version, who did not register, the error; writes it.
void CompleteReport(const Workspace& workspace, const calib::SfmModel& model, SfmReport& report);

/// COLMAP starts from two photos that see the scene from 16 degrees apart, or 4 where it finds
/// none, and not along the line of sight. A walk straight ahead through a street has no such pair.
/// Its points are seen under small angles throughout, so they are kept under smaller ones, too, and
/// fewer of them must agree with a pose. Adds, of what says so, the options that the command has.
void AllowForwardMotion(Arguments& arguments);

/// File in the workspace of a model that RunSfm needed them for: what is registered in it needs
/// them, too.
inline constexpr char kForwardMotionNote[] = "forward_motion";
/// Lies in a workspace whose mapper made a model with the intrinsics fixed at EXIF's alone.
inline constexpr char kFixedIntrinsicsNote[] = "fixed_intrinsics";

/// Points that must agree with the place of a photo: COLMAP's own limit, and that of such a walk.
inline constexpr int kMinInliers = 30, kMinInliersForward = 15;

}  // namespace dtr::colmap
