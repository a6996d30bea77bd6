// calib/colmap/mapper.h -- COLMAP's mapper on the database of a workspace.
#pragma once
#include <optional>
#include <vector>

#include "calib/colmap/program.h"

namespace dtr::colmap {

/// See ColmapSteps::Map and MapFixed.
std::vector<calib::SfmModel> MapByColmap(sfm::Workspace& workspace,
                                         const std::vector<sfm::CameraGroup>& groups,
                                         const sfm::SfmOptions& options);
std::optional<calib::SfmModel> MapFixedByColmap(sfm::Workspace& workspace,
                                                const sfm::SfmOptions& options);

/// COLMAP starts from two photos that see the scene from 16 degrees apart, or 4 where it finds
/// none, and not along the line of sight. A walk straight ahead through a street has no such pair.
/// Its points are seen under small angles throughout, so they are kept under smaller ones, too, and
/// fewer of them must agree with a pose. Adds, of what says so, the options that the command has.
void AllowForwardMotion(Arguments& arguments);

}  // namespace dtr::colmap
