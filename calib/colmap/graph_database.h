// calib/colmap/graph_database.h -- features and matches of our own in a database as COLMAP's
// mapper and its viewers read it.
#pragma once
#include <filesystem>

#include "calib/sfm/run/store.h"
#include "calib/sfm/view_graph.h"

namespace dtr::colmap {

/// Writes a database (layout of COLMAP 3.8) with the graph's cameras and images and their features,
/// and of every pair the matches that agree with its geometry, both as what was matched and as what
/// was verified. Ids are indices + 1. What is at `database` is replaced. Throws Error when it
/// cannot be written.
void WriteGraphDatabase(const std::filesystem::path& database, const sfm::ViewGraph& graph,
                        const sfm::FeatureFile& features);

}  // namespace dtr::colmap
