// calib/sfm/run/sfm_steps.h -- the steps that structure from motion and triangulation share.
#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/sfm/run/feature_plan.h"
#include "calib/sfm/run/match_summary.h"
#include "calib/sfm/run/workspace.h"

namespace dtr::sfm {

/// The lens model of the options. Throws UsageError on an unknown name.
calib::CameraModel CameraModelOf(const SfmOptions& options);

/// COLMAP's with kColmap, else kOwnVersion: the version of a workspace. Throws Error where COLMAP
/// is needed and does not work.
std::string VersionOf(const SfmOptions& options);

/// What matching found, by whatever engine.
MatchSummary MatchedIn(const Workspace& workspace, const SfmOptions& options);

/// What is known of photos before they are matched.
struct PhotosToMatch {
  std::vector<CameraGroup> groups;
  /// Of the pairs that options.matching names only these (a < b, sorted; numbers of images()) are
  /// matched, where they are given.
  std::optional<ImagePairs> allowed = {};
  bool known_lenses = false;  ///< the groups' parameters are given, not guesses
};

/// Steps "features" and "matches" of the workspace. What was planned goes to `report`. `part`: this
/// alone.
void FeaturesAndMatches(Workspace& workspace, const PhotosToMatch& photos,
                        const SfmOptions& options, SfmReport& report,
                        const std::optional<SfmPart>& part = {});

/// Fills in what every report has: runs, version, who did not register, the error; writes it.
void CompleteReport(const Workspace& workspace, const calib::SfmModel& model, SfmReport& report);

/// File in the workspace of a model that RunSfm needed them for: what is registered in it needs
/// them, too.
inline constexpr char kForwardMotionNote[] = "forward_motion";
/// Lies in a workspace whose mapper made a model with the intrinsics fixed at EXIF's alone.
inline constexpr char kFixedIntrinsicsNote[] = "fixed_intrinsics";

/// Points that must agree with the place of a photo: COLMAP's own limit, and that of such a walk.
inline constexpr int kMinInliers = 30, kMinInliersForward = 15;

}  // namespace dtr::sfm
