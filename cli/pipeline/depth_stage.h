// cli/pipeline/depth_stage.h -- depth for the source views of a set, written view by view.
#pragma once
#include <cstdint>

#include "cli/pipeline/depth_settings.h"
#include "dtr/base/progress.h"
#include "dtr/io/set_io.h"
#include "dtr/types/dtr_set.h"
#include "dtr/types/sparse_scene.h"

namespace dtr::pipeline {

struct DepthStageOptions {
  int threads = 0;
  std::uint64_t seed = 0;
  double memory_gb = 4;
};

/// Computes the depth of every source view with the engine chosen ("none": none, all holes are
/// refused later by renderers) and writes every view, held-out ones without depth, through
/// `writer`. Views finished by an earlier, interrupted run are taken from the writer. Only source
/// views and the points they alone know reach the engine.
void DepthStage(DtrSet& set, const SparseScene& sparse, const DepthChoice& choice,
                const stereo::Effort& effort, const DepthStageOptions& options,
                io::SetWriter& writer, Progress& progress);

}  // namespace dtr::pipeline
