#include "cli/pipeline/mesh_stage.h"

#include "dtr/render/adaptive_mesh.h"
#include "dtr/render/options.h"

namespace dtr::pipeline {

void MeshStage(DtrSet& set, io::SetWriter& writer, int threads) {
  for (Frame& frame : set.frames) {
    for (View& view : frame.views) {
      if (view.role != ViewRole::kSource || view.depth.empty()) continue;
      writer.WriteMesh(view, MakeStoredMesh(view, RenderOptions{}, threads));
    }
  }
}

}  // namespace dtr::pipeline
