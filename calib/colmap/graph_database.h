// calib/colmap/graph_database.h -- features and matches of our own in a database as COLMAP's
// mapper and its viewers read it.
#pragma once
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "calib/lens_camera.h"
#include "calib/sfm/view_graph.h"

namespace dtr::colmap {

/// A photo as a database names it.
struct DatabaseImage {
  std::string name;
  int camera = 0;  ///< index into the cameras given with it
};

/// Writes a database (layout of COLMAP 3.8) with these cameras and images and no feature. Ids are
/// indices + 1. What is at `database` is replaced. `focal_is_known` per camera: what COLMAP calls a
/// prior. Throws Error when it cannot be written, as do the other writers.
void CreateGraphDatabase(const std::filesystem::path& database,
                         std::span<const calib::LensCamera> cameras,
                         const std::vector<bool>& focal_is_known,
                         std::span<const DatabaseImage> images);

/// Adds features of images (indices into those of CreateGraphDatabase), in the place of any before.
void AddFeatures(const std::filesystem::path& database, std::span<const size_t> images,
                 std::span<const sfm::Features> features);

/// Features of an image by its id. Throws Error where the database has no record of them, is no
/// COLMAP database, or its records do not fit each other.
sfm::Features ReadFeatures(const std::filesystem::path& database, std::uint32_t image_id);
std::vector<sfm::Keypoint> ReadKeypoints(const std::filesystem::path& database,
                                         std::uint32_t image_id);
/// The `first` descriptors of an image, of which there must be `keypoints`, or all where it has
/// fewer.
std::vector<sfm::Descriptor> ReadDescriptors(const std::filesystem::path& database,
                                             std::uint32_t image_id, size_t keypoints,
                                             size_t first);

/// Replaces cameras and matches of a database by the graph's: of every pair the matches that agree
/// with its geometry, both as what was matched and as what was verified.
void WriteViewGraph(const std::filesystem::path& database, const sfm::ViewGraph& graph);

/// The graph that WriteViewGraph wrote, images in the order of ids. Throws Error as ReadFeatures
/// does.
sfm::ViewGraph ReadViewGraph(const std::filesystem::path& database);

}  // namespace dtr::colmap
