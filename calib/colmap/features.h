// calib/colmap/features.h -- feature extraction by COLMAP.
#pragma once
#include <filesystem>
#include <vector>

#include "calib/colmap/program.h"
#include "calib/sfm/run/feature_plan.h"
#include "calib/sfm/run/workspace.h"

namespace dtr::colmap {

/// What one run of the extractor is given: photos of one group.
struct ExtractionRun {
  size_t group = 0;
  std::vector<size_t> images;  ///< indices into Workspace::images()
};

/// All photos of the groups, in their order, in batches of kPhotosPerBatch or a quarter of those
/// before, whichever is more: what is copied to keep them is then a few times the whole at most.
std::vector<std::vector<ExtractionRun>> InBatches(const std::vector<sfm::CameraGroup>& groups);

/// Extracts into `database`, one extractor run per group or part of one; parts of a group share the
/// camera that its first made. Throws as RunStep, and Error when a photo could not be read
/// by COLMAP.
void ExtractFeatures(sfm::Workspace& workspace, const std::filesystem::path& database,
                     const std::vector<sfm::CameraGroup>& groups, const sfm::ExtractionPlan& plan,
                     std::uint64_t seed);

/// The same, batch by batch: after each, `database` holds it whole, and an interrupted extraction
/// of a workspace with the same fingerprint goes on after the last of them.
void ExtractFeaturesResumably(sfm::Workspace& workspace, const std::filesystem::path& database,
                              const std::vector<sfm::CameraGroup>& groups,
                              const sfm::ExtractionPlan& plan, std::uint64_t seed);

}  // namespace dtr::colmap
