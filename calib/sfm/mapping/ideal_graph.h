// calib/sfm/mapping/ideal_graph.h -- internal to calib/sfm/mapping: a graph whose cameras are known
// and of models that are not adjusted here, as pinhole cameras see it.
#pragma once
#include "calib/sfm/view_graph.h"
#include "calib/sfm_model.h"

namespace dtr::sfm {

/// The graph with pinhole cameras in the place of those that cannot be adjusted (CanAdjust), and
/// pixels where these see the features. Features that no pinhole camera sees lose their matches.
ViewGraph IdealGraph(const ViewGraph& graph);

/// Puts the graph's own cameras and pixels back into a model that was made of its IdealGraph.
void PutBackCameras(const ViewGraph& graph, calib::SfmModel* model);

}  // namespace dtr::sfm
