// dtr/simd/sampled_views.h -- views as ResolvePixelRow reads them, in the processor's memory. Only
// dtr/simd's own .cpp files include this.
#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "dtr/base/huge_pages.h"
#include "dtr/render/options.h"
#include "dtr/render/triangulation.h"
#include "dtr/types/view.h"

namespace dtr::simd {

/// A view's samples, with a border as PixelView says, and its image.
struct SampledView {
  int columns = 0, rows = 0, step = 1,
      offset = 0;                   ///< of the grid of samples; columns 0: none left
  HugeVector<std::uint16_t> codes;  ///< one of the two
  HugeVector<float> values;
  std::vector<std::uint32_t> whole_blocks;  ///< as PixelView has them
  std::vector<std::uint32_t> cells;         ///< likewise; empty where none would be null
  int cell_stride = 0;
  double depth_offset = 0, depth_factor = 1;  ///< 1/z from a code or a value
  HugeVector<std::uint8_t> rgba;  ///< SampledImage, and what PixelView asks for after it
  size_t bytes() const {
    return codes.size() * sizeof(codes[0]) + values.size() * sizeof(values[0]) +
           (whole_blocks.size() + cells.size()) * sizeof(whole_blocks[0]) + rgba.size();
  }
};

/// Keeps one per view; another resolution or rule of depth breaks replaces it.
class SampledViews {
 public:
  /// Makes the missing ones of several views, on all cores. A view without pixels needs to have one
  /// (std::logic_error), which stays when they come back.
  void Prepare(const std::vector<const View*>& views, const RenderOptions& options);
  /// After Prepare.
  const SampledView& Of(const View& view) const { return views_.at(&view).sampled; }

  /// True when nothing would be made of its pixels.
  bool Has(const View& view, const RenderOptions& options) const;

  size_t BytesOf(const View& view) const;
  void Drop(const View& view) { views_.erase(&view); }
  void Clear() { views_.clear(); }

 private:
  struct Stored {
    int resolution = 0;
    BreakRule breaks;
    /// Null after a frame in which the pixels were not there: those that come back are the same.
    const void *image_data = nullptr, *depth_data = nullptr;
    SampledView sampled;
    bool IsFor(const View& view, const RenderOptions& options) const;
  };
  std::map<const View*, Stored> views_;
};

}  // namespace dtr::simd
