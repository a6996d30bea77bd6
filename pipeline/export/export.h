// pipeline/export/export.h -- a set's cameras, points, images, depth and surfaces for other
// programs.
#pragma once
#include <cstddef>
#include <filesystem>
#include <string>

#include "dtr/base/progress.h"
#include "dtr/types/camera.h"

namespace dtr::pipeline {

enum class DepthFileFormat {
  kExr,    ///< float32, one channel Y
  kPfm,    ///< float32, rows from the bottom
  kPng16,  ///< 16 bits, of a unit that cameras.json says
  kNpy     ///< float32, C order
};

/// The pixels that an exported depth map is of.
enum class DepthGrid {
  kSet,   ///< the set's depth map: undistorted
  kPhoto  ///< the original photo, with its distortion
};

struct ExportRequest {
  std::filesystem::path set;
  std::filesystem::path output;  ///< folder or file to write
  bool force = false;            ///< replaces a file, never a folder
  bool text = false;             ///< COLMAP's text files instead of binary
  double memory_gb = 4;          ///< for depth maps that are held at a time
  bool completed = false;        ///< with completed depth, not only what was measured
  int min_views = 2;             ///< clouds, meshes: views that show a point at the same depth
  double voxel = 0;              ///< meshes: its width, scene units; 0: twice the median pixel's
  size_t max_count = 0;          ///< splats: Gaussians at most; 0: no bound
  bool full_sh = false;          ///< splats: with the coefficients (all 0) of degrees 1 to 3
  DepthFileFormat depth_format = DepthFileFormat::kExr;
  DepthKind depth_kind = DepthKind::kPlaneZ;
  DepthGrid depth_grid = DepthGrid::kSet;
};

struct ExportReport {
  size_t images = 0;               ///< views that were used
  size_t points = 0;               ///< points, vertices or Gaussians
  size_t triangles = 0;            ///< of meshes
  size_t depth_maps = 0;           ///< files of depth
  bool points_from_depth = false;  ///< as the set has no sparse points
};

/// Writes a COLMAP model with its images, which keep the names of the photos but for the extension
/// of what the set stores. Throws UsageError when the output exists, Error for a broken set.
ExportReport ExportColmap(const ExportRequest& request, Progress& progress);

// Of all that follow: what a set without depth or of several time steps cannot give is an Error, an
// output that exists a UsageError; a failed validation is noted and stands in the file or beside
// it; nothing half-written appears. Coordinates that floats cannot hold are written relative to
// the set's origin, which is noted and stands there too. docs/EXPORT.md has every field.

/// Writes a point cloud, one PLY file: the depth maps fused (pipeline/export/detail/fuse.h) with
/// normals, colours, standard deviations and numbers of views. Doubles where the set has an origin.
ExportReport ExportPly(const ExportRequest& request, Progress& progress);

/// Writes a folder: depth, standard deviation and validity of every photo with depth, in a file of
/// each under the photo's own name; undistorted images; cameras.json, which says what the numbers
/// mean. `depth_grid` kPhoto: at the pixels of the original photo, Error where the set does not
/// know its lens.
ExportReport ExportDepth(const ExportRequest& request, Progress& progress);

/// Writes a folder for nerfstudio: transforms.json, images, depth (16-bit PNG of the stated unit),
/// masks, sparse_pc.ply.
ExportReport ExportNerfstudio(const ExportRequest& request, Progress& progress);

/// Writes the same cloud as one LAS 1.4 file (point format 2): whole steps of a power of ten in the
/// user's world; views as user data, view number as source id, sigma as extra bytes.
ExportReport ExportLas(const ExportRequest& request, Progress& progress);

/// Writes a triangle mesh with normals and vertex colours, one file, .ply or .glb by its extension
/// (pipeline/export/detail/mesh.h). Error where `min_views` views show no surface.
ExportReport ExportMesh(const ExportRequest& request, Progress& progress);

/// Writes 3D Gaussians, one file, .ply (Kerbl et al. 2023), .splat or .glb (KHR_gaussian_splatting)
/// by its extension: those of the fused samples, completed ones too
/// (pipeline/export/detail/gaussians.h), and the sky and a backdrop
/// (pipeline/export/detail/backdrop.h); with `max_count` at most so many, Error where that cannot
/// be met.
ExportReport ExportSplat(const ExportRequest& request, Progress& progress);

/// Writes a folder for MVSNet and its successors: images, cams, depths and pair.txt of the views
/// with depth.
ExportReport ExportMvsnet(const ExportRequest& request, Progress& progress);

/// Writes a folder for OpenMVS: scene.mvs (its interface archive, version 5, with the points that
/// two of its images see), depthNNNN.dmap with normals and confidence, images and masks of the
/// views with depth.
ExportReport ExportOpenmvs(const ExportRequest& request, Progress& progress);

/// Writes a folder for MPEG's immersive video (ISO/IEC 23090-12) programs TMIV and RVS, and
/// OpenDIBR: sequence.json, texture (10 bits, BT.709) and depth (16 bits, inverse depth) as raw
/// 4:2:0 frames of the views with depth.
ExportReport ExportMiv(const ExportRequest& request, Progress& progress);

}  // namespace dtr::pipeline
