// dtr/gl/quick_resolve.h -- the deferred method's pass over the pixels, where it can be quick. Only
// dtr/gl's own .cpp files include this.
#pragma once
#include <array>

#include "dtr/gl/drawing.h"
#include "dtr/gl/frame.h"
#include "dtr/gl/program.h"
#include "dtr/gl/view_store.h"

namespace dtr::gl {

/// Resolver's results for most frames of the deferred method, on software rasterisers several times
/// as fast; both are held to the reference by the same tests. Once per picture SetViews, then Draw
/// for every band.
class QuickResolver {
 public:
  QuickResolver();

  /// As Resolver::SetViews. False for frames that it does not draw: two passes, the per-pixel rule,
  /// linear light, the report's absolute Delta, weights that may be 0 or leave single precision,
  /// masks on other grids than the samples', more views than kMostViews, images or depths of
  /// several sizes.
  bool SetViews(const Frame& frame, ViewStore& store);

  /// As Resolver::Draw.
  void Draw(const Frame& frame, const Band& band, const ViewStore& store, ProgramCache& programs,
            const Targets& targets, GLuint coarse_depth);

 private:
  static constexpr int kMostViews = 16;  // the shader spells them out

  void FitPacked(const Targets& targets);
  void SkipEmpty(const Band& band, ProgramCache& programs, const Targets& targets);
  void Unpack(const Band& band, const Targets& targets);

  VertexArray empty_array_;
  Buffer view_buffer_, pixels_;
  int image_array_ = 0, depth_array_ = 0;  ///< of the store
  int columns_ = 0, rows_ = 0;             ///< of the packed targets
  std::array<Texture, 3> packed_;          ///< image, depth and marks
  Texture skip_;
  Framebuffer framebuffer_;
};

}  // namespace dtr::gl
