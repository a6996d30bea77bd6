// pipeline/core/depth/depth_engine.h -- the engine that was chosen, ready for the views of a set.
#pragma once
#include <filesystem>
#include <memory>
#include <span>

#include "dtr/base/progress.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/sparse_scene.h"
#include "pipeline/core/depth_settings.h"
#include "stereo/engine.h"

namespace dtr::pipeline {

/// What an engine may have to be told of the set.
struct DepthSources {
  std::span<const View> views;                 ///< of the set
  std::span<const int> sources;                ///< indices of the source views
  std::span<const stereo::StereoView> stereo;  ///< the source views
  const SparseScene* scene = nullptr;          ///< views are indices into `sources`
  Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();
  std::filesystem::path set_folder;   ///< where the views' image files lie
  std::filesystem::path work_folder;  ///< for files an engine leaves
};

/// Rejects, before anything costs time, a choice that cannot be carried out on this machine:
/// UsageError for a workspace without engine `colmap`, a time budget without `patchmatch`, or a
/// depth prior for another engine than `patchmatch` and `prior`, which needs one; Error
/// when `colmap` shall compute and has no CUDA.
void RequireEngine(const DepthChoice& choice);

/// The engine of a choice; null for "none". Engine `colmap` without a workspace has one filled by
/// the program, in the work folder. Throws as ColmapEngine and RunPatchMatchStereo do.
std::unique_ptr<stereo::Engine> MakeDepthEngine(const DepthChoice& choice,
                                                const stereo::QualitySettings& quality,
                                                const DepthSources& of, Progress& progress);

}  // namespace dtr::pipeline
