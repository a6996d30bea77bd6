// pipeline/detail/depth/depth_stage.h -- depth for the source views of a set, written view by view.
#pragma once
#include <cstdint>
#include <filesystem>

#include "dtr/base/progress.h"
#include "dtr/io/set_io.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/sparse_scene.h"
#include "pipeline/depth_settings.h"

namespace dtr::pipeline {

struct DepthStageOptions {
  int threads = 0;
  std::uint64_t seed = 0;
  /// Where normals of the source views go, named as the depth maps, .exr, as stereo::NormalsOf
  /// gives them; empty: nowhere.
  std::filesystem::path normals = {};
};

/// Writes the pixels of a view, or finds them written by an earlier, interrupted run, and frees
/// them.
void StoreImage(View& view, LengthUnit unit, io::SetWriter& writer);

/// Computes the depth of every source view with the engine chosen ("none": none, all holes are
/// rejected later by renderers) and writes it through `writer`, which has the views' images
/// (StoreImage). Views finished by an earlier, interrupted run are taken from the writer. Only
/// source views and the points they alone know reach the engine. Pixels are in memory only as long
/// as they are worked with, within the memory chosen: UsageError when that is too little. Returns
/// the quality settings used: `quality` or, with a time budget, what fitted into that.
stereo::QualitySettings DepthStage(DtrSet& set, const SparseScene& sparse,
                                   const DepthChoice& choice,
                                   const stereo::QualitySettings& quality,
                                   const DepthStageOptions& options, io::SetWriter& writer,
                                   Progress& progress);

}  // namespace dtr::pipeline
