// cli/pipeline/mesh_stage.h -- reduced meshes kept with the set.
#pragma once
#include "dtr/io/set_io.h"
#include "dtr/types/dtr_set.h"

namespace dtr::pipeline {

/// Writes the reduced mesh (SPEC 5.1) of every source view that has depth in memory, as renderers
/// make it with their default options. After FinishGeometry: thresholds need the baselines.
void MeshStage(DtrSet& set, io::SetWriter& writer, int threads);

}  // namespace dtr::pipeline
