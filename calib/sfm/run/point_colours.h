// calib/sfm/run/point_colours.h -- the colours of a model's points.
#pragma once
#include "calib/sfm/run/workspace.h"

namespace dtr::sfm {

/// Gives each point the mean colour (sRGB values, as COLMAP does) of the pixels where its images,
/// under the workspace's own names, observe it. Each photo is read once, several at a time.
void ColourPoints(Workspace& workspace, calib::SfmModel& model);

}  // namespace dtr::sfm
