// calib/colmap/own_steps.h -- the steps of structure from motion by calib/sfm, in a workspace and a
// database that COLMAP's programs can go on with.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/colmap/features.h"
#include "calib/colmap/sfm_steps.h"
#include "calib/sfm/view_graph.h"

namespace dtr::colmap {

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
sfm::Features FeaturesOf(const std::filesystem::path& photo, const std::filesystem::path& mask_file,
                         int max_image_size_px, int max_features);

/// Features of all photos into `database`, batch by batch: an interrupted step of the same
/// fingerprint goes on after the last of them. Features that a process with a part has found are
/// taken over. `part`: of kFeatures, those of a part of the photos into a database of its own; a
/// later one than kPairs needs `database` and throws Error.
void OwnFeatures(Workspace& workspace, const std::filesystem::path& database,
                 const std::vector<CameraGroup>& groups, const ExtractionPlan& plan,
                 const std::optional<SfmPart>& part);

/// Matches of the features in `features` into the workspace's database, with the lenses that they
/// determine: those of `photos` where they are known, else focal lengths and distortion are
/// estimated. With `part` only this, into a journal.
void OwnMatches(Workspace& workspace, const std::filesystem::path& features,
                const PhotosToMatch& photos, Matching matching, const SfmOptions& options,
                const std::optional<SfmPart>& part);

/// What the global mapper made of the workspace's database, photos under their own names.
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

}  // namespace dtr::colmap
