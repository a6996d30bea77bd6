// dtr/gl/deferred.h -- SPEC 5.1: the surface that the deferred method starts from. Only dtr/gl's
// own .cpp files include this.
#pragma once
#include <cstdint>
#include <vector>

#include "dtr/gl/drawing.h"
#include "dtr/gl/mesh_store.h"
#include "dtr/gl/program.h"
#include "dtr/render/frame.h"

namespace dtr::gl {

/// Draws the views' reduced meshes into one depth per pixel; keeps its buffer from frame to frame.
class CoarseDepth {
 public:
  /// The nearest surface of all views of the frame. Their meshes must have been prepared with these
  /// options.
  void Draw(const RenderFrame& frame, const Band& band, const MeshStore& meshes,
            ProgramCache& programs, const Targets& targets);

  /// Inverse depth in the novel camera as the bits of a float, 0 where nothing is; rows of the
  /// targets' width, the band's first row first. Valid after Draw.
  GLuint buffer() const { return buffer_.name(); }

 private:
  /// What a group of invocations draws, as coarse_depth.glsl says.
  struct Batch {
    std::uint32_t first = 0, count_and_sharing = 0;
  };
  void AddBatches(int first, int count, int log2_sharing);
  void DrawByShaders(const RenderFrame& frame, const Band& band, const MeshStore& meshes,
                     ProgramCache& programs);

  Buffer buffer_, batch_buffer_;
  GLsizeiptr pixels_ = 0;
  std::vector<Batch> batches_;
};

}  // namespace dtr::gl
