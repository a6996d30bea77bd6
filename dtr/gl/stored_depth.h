// dtr/gl/stored_depth.h -- a view's inverse depth as it lies on the GPU: the set's own 16 bits
// where they hold it exactly, else float.
#pragma once
#include <cstdint>
#include <vector>

#include "dtr/render/triangulation.h"
#include "dtr/types/view.h"

namespace dtr::gl {

/// One value per sample, row by row; one of the two lists is empty.
struct StoredDepth {
  std::vector<std::uint16_t> codes;  ///< InverseDepthCode; 0: no sample
  std::vector<float> values;         ///< 1/z, 1 / scene units; 0: no sample
  /// 1/z of a texel v > 0 is offset + factor v, where codes are read as shares of 65535.
  double offset = 0, factor = 1;
};

/// Codes when the view says that its depth was stored so and each depth decodes to itself (a map
/// that was loaded; not one that was computed and never rounded). `samples`: of this view.
StoredDepth StoreDepth(const View& view, const SampleGrid& samples);

/// The image of a grid of samples that own_depth.glsl reads: `values` with the last row and
/// column once more, and below them whether a block is whole or masked (its values are 0 then,
/// which whole ones' never are): of block (x, y) bit (y + 1) % kBlocksPerTexel of the texel (x + 1,
/// rows + 1 + (y + 1) / kBlocksPerTexel), as a number.
inline constexpr int kBlocksPerTexel = 16;
template <typename T>
std::vector<T> DepthPicture(const std::vector<T>& values, const SampleGrid& samples,
                            const BreakRule& breaks);
extern template std::vector<std::uint16_t> DepthPicture(const std::vector<std::uint16_t>&,
                                                        const SampleGrid&, const BreakRule&);
extern template std::vector<float> DepthPicture(const std::vector<float>&, const SampleGrid&,
                                                const BreakRule&);

}  // namespace dtr::gl
