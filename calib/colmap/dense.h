// calib/colmap/dense.h -- COLMAP's dense workspaces: what lies in them, and how to have one filled.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "calib/sfm/run/sfm.h"
#include "calib/sfm_model.h"
#include "dtr/base/progress.h"
#include "dtr/types/camera.h"
#include "dtr/types/depth_image.h"
#include "dtr/types/pose.h"

namespace dtr::colmap {

/// An image of a dense workspace and its depth map.
struct DenseImage {
  std::string name;
  PinholeCamera camera{1, 1, 1, 1, 0, 0};
  Pose cam_from_world;
  std::filesystem::path depth_map;  ///< empty: the workspace has none
  bool geometric = true;            ///< false: not held to the other views' maps
};

/// The images of the model in `workspace`/sparse, sorted by name, each with
/// stereo/depth_maps/NAME.geometric.bin or, where there is none, NAME.photometric.bin. The maps are
/// not opened. Throws Error when the model is none, or a camera of it has distortion.
std::vector<DenseImage> ReadDenseWorkspace(const std::filesystem::path& workspace);

/// Reads a depth map: "width&height&channels&" in ASCII, then float32 (little endian), row-major.
/// Plane z in the units of the workspace's model; numbers that are not positive and finite are
/// holes. The number at (column, row) belongs to the pixel of that index, centre (column + 0.5,
/// row + 0.5). COLMAP itself unprojects with the bare index (its issue 1515), in the reference and
/// in the source view alike: what it matches are the pixels of these indices, and their difference,
/// which decides the depth, is right; the ray it then takes misses the pixel by half its width.
/// The size is checked against `width_px` x `height_px` and the file before anything is allocated.
/// Throws Error, naming the file, for anything else.
DepthImage ReadDenseDepth(const std::filesystem::path& file, int width_px, int height_px);

/// Writes what `colmap patch_match_stereo` needs beside the images (`workspace`/images/NAME, the
/// caller's): the model of undistorted cameras, a list that lets COLMAP choose 20 source images for
/// each, and empty folders.
void WriteDenseWorkspace(const std::filesystem::path& workspace, const calib::SfmModel& model);

/// Throws Error, saying what to do instead, unless there is a colmap built with CUDA.
void RequireCuda();

/// Runs `colmap patch_match_stereo` with geometric consistency on the workspace; its log goes to
/// `workspace`/patch_match_stereo.log. Throws as RequireCuda and RunColmap do.
sfm::StepRecord RunPatchMatchStereo(const std::filesystem::path& workspace, Progress& progress);

}  // namespace dtr::colmap
