// calib/sfm/run/own_steps.h -- the steps of structure from motion by calib/sfm, in a workspace.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/sfm/run/feature_plan.h"
#include "calib/sfm/run/match_summary.h"
#include "calib/sfm/run/sfm_steps.h"
#include "calib/sfm/view_graph.h"

namespace dtr::sfm {

/// The lens of each group as far as it is known before photos are matched; the focal length is
/// EXIF's, or a guess.
struct GroupLenses {
  std::vector<calib::LensCamera> lenses;
  std::vector<bool> focal_is_known;
};
GroupLenses LensesOf(const Workspace& workspace, const std::vector<CameraGroup>& groups);

/// Features of a photo on its upright grid, none where `mask_file` is black (empty: everywhere).
/// Of photos with a longer side than max_image_size_px a smaller image is looked at; pixels are the
/// photo's. Throws Error when a file cannot be read.
Features FeaturesOf(const std::filesystem::path& photo, const std::filesystem::path& mask_file,
                    int max_image_size_px, int max_features);

/// Among the inputs of the step "features": work that an earlier store holds begins again.
inline constexpr char kStoreVersion[] = "\nstore 1";

/// Features of all photos into the workspace's kFeatureFile (store.h), batch by batch: an
/// interrupted step of the same fingerprint goes on after the last of them. Features that a process
/// with a part has found are taken over. `part`: of kFeatures, those of a part of the photos into a
/// file of its own; a later one than kPairs needs the file of all and throws Error.
void OwnFeatures(Workspace& workspace, const std::vector<CameraGroup>& groups,
                 const ExtractionPlan& plan, const std::optional<SfmPart>& part);

/// Matches of these features into the workspace's kMatchFile, with the lenses that they determine:
/// those of `photos` where they are known, else focal lengths and distortion are estimated. With
/// `part` only this, into a journal.
void OwnMatches(Workspace& workspace, const PhotosToMatch& photos, Matching matching,
                const SfmOptions& options, const std::optional<SfmPart>& part);

/// The graph that OwnMatches left, images in the workspace's order under their own names. Throws
/// Error where the store is damaged.
ViewGraph ReadGraph(const Workspace& workspace);
MatchSummary SummaryOf(const Workspace& workspace);

/// What the global mapper made of the workspace's matches.
struct GloballyMapped {
  calib::SfmModel model;  ///< without images: none could be placed
  /// Why the model must not be taken as it is: a clause; empty where it passes.
  std::string why_not;
  std::map<std::string, std::string> why_without_camera;
};
/// `fixed`: intrinsics that hold, in the place of what the matches determine. `focals_hold`: the
/// matches' focal lengths do.
GloballyMapped MapHere(Workspace& workspace, const SfmOptions& options,
                       const std::optional<GroupLenses>& fixed = {}, bool focals_hold = false);

}  // namespace dtr::sfm
