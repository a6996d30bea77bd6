// dtr/gl/resolve.h -- the pass over the pixels that makes one image of the views. Only dtr/gl's
// own .cpp files include this.
#pragma once
#include <string>
#include <vector>

#include "dtr/gl/drawing.h"
#include "dtr/gl/program.h"
#include "dtr/gl/view_store.h"
#include "dtr/render/frame.h"

namespace dtr::gl {

/// SPEC 4.2 to 4.7, 5.2 and 6, as a compute shader: GPUs of data centres run compute on all their
/// multiprocessors, fragments on a few (docs/accuracy/SPEED.md). Once per image SetViews, then Draw
/// for every band.
class Resolver {
 public:
  /// Asks the driver for its limits: a context must be current.
  Resolver();

  /// Puts what the shader knows of each view on the GPU. The views must have been prepared. Throws
  /// dtr::Error where their images and depths lie in more texture arrays than there are units for.
  void SetViews(const RenderFrame& frame, ViewStore& store);

  /// From the layers of `targets` (two passes) or the depth in `coarse_depth` (deferred; a storage
  /// buffer) into the results of `targets`.
  void Draw(const RenderFrame& frame, const Band& band, const ViewStore& store,
            ProgramCache& programs, const Targets& targets, GLuint coarse_depth);

 private:
  bool BlocksFitUniforms(int views) const;
  int SlotOf(std::vector<int>& bound, int array) const;
  const Program& ProgramFor(const RenderFrame& frame, ProgramCache& programs) const;

  GLint max_uniform_bytes_ = 0;
  Buffer view_buffer_;
  std::vector<int> image_arrays_, depth_arrays_;  ///< store numbers, by the slot they are bound to
};

}  // namespace dtr::gl
