// calib/colmap/placement.h -- points of posed photos, and poses of photos in a model, by COLMAP.
#pragma once
#include <filesystem>

#include "calib/colmap/program.h"

namespace dtr::colmap {

/// See ColmapSteps::Triangulate and Register.
calib::SfmModel TriangulateByColmap(Workspace& workspace, const calib::SfmModel& posed,
                                    const SfmOptions& options);
void RegisterByColmap(Workspace& workspace, const RegistrationInput& input,
                      const std::vector<CameraGroup>& groups, const ExtractionPlan& plan,
                      const SfmOptions& options, const std::filesystem::path& registered);

}  // namespace dtr::colmap
