// calib/colmap/placement.h -- points of posed photos, and poses of photos in a model, by COLMAP.
#pragma once
#include <filesystem>

#include "calib/colmap/program.h"

namespace dtr::colmap {

/// See ColmapSteps::Triangulate and Register.
calib::SfmModel TriangulateByColmap(sfm::Workspace& workspace, const calib::SfmModel& posed,
                                    const sfm::SfmOptions& options);
void RegisterByColmap(sfm::Workspace& workspace, const sfm::RegistrationInput& input,
                      const std::vector<sfm::CameraGroup>& groups, const sfm::ExtractionPlan& plan,
                      const sfm::SfmOptions& options, const std::filesystem::path& registered);

}  // namespace dtr::colmap
