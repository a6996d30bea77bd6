// cli/pipeline/depth_stage.h -- depth for the source views of a set, written view by view.
#pragma once
#include <cstdint>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/io/set_io.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/sparse_scene.h"
#include "dtr/types/view.h"
#include "stereo/engine.h"

namespace dtr::pipeline {

struct DepthStageOptions {
  int threads = 0;
  std::uint64_t seed = 0;
  double memory_gb = 4;
};

/// Computes the depth of every source view with `engine` (null: none, all holes are refused later
/// by renderers) and writes every view, held-out ones without depth, through `writer`. Views
/// finished by an earlier, interrupted run are taken from the writer. Only source views and the
/// points they alone know reach the engine.
void DepthStage(std::vector<View>& views, const SparseScene& sparse, const stereo::Engine* engine,
                const DepthStageOptions& options, LengthUnit unit, io::SetWriter& writer,
                Progress& progress);

}  // namespace dtr::pipeline
