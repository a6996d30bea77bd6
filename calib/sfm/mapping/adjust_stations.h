// calib/sfm/mapping/adjust_stations.h -- internal to calib/sfm/mapping: adjustment where images of
// one station stand in one point.
#pragma once
#include <vector>

#include "calib/bundle/bundle.h"
#include "calib/sfm/mapping/adjust_map.h"
#include "calib/sfm/view_graph.h"

namespace dtr::sfm {

/// As AdjustMap, with one pose per station (`nodes`: NodesOf), taken from its first image in the
/// bundle, and all lenses held (calib::AdjustRig, with its own treatment of outliers; of `options`
/// progress alone is used). `image_of`: per image of the bundle, its index in the graph.
bool AdjustStations(const ViewGraph& graph, const std::vector<int>& nodes,
                    const std::vector<int>& image_of, const AdjustMapOptions& options,
                    calib::Bundle* bundle);

}  // namespace dtr::sfm
