// calib/colmap/workspace_files.h -- COLMAP's files in a workspace.
#pragma once
#include <filesystem>

#include "calib/sfm/run/workspace.h"
#include "calib/sfm_model.h"

namespace dtr::colmap {

inline std::filesystem::path DatabaseOf(const sfm::Workspace& workspace) {
  return workspace.folder() / "database.db";
}

/// Reads a model COLMAP made here and gives the images their own names back.
calib::SfmModel ReadModelHere(const sfm::Workspace& workspace, const std::filesystem::path& folder);
/// The inverse: writes a model for COLMAP to read. Every image must be one of the workspace's.
void WriteModelHere(const sfm::Workspace& workspace, const std::filesystem::path& folder,
                    calib::SfmModel model);

}  // namespace dtr::colmap
