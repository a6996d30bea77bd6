// dtr/gl/packed_depth.h -- a view's grid of samples as shaders read it. Only dtr/gl's own .cpp
// files and its tests include this.
#pragma once
#include <cstdint>
#include <vector>

#include "dtr/render/triangulation.h"

namespace dtr::gl {

/// The image of a grid of samples that own_depth.glsl reads: `values` with the last row and
/// column once more, and below them whether a block is whole or masked (its values are 0 then,
/// which whole ones' never are): of block (x, y) bit (y + 1) % kBlocksPerTexel of the texel (x + 1,
/// rows + 1 + (y + 1) / kBlocksPerTexel), as a number.
inline constexpr int kBlocksPerTexel = 16;
template <typename T>
std::vector<T> PackedDepth(const std::vector<T>& values, const SampleGrid& samples,
                           const BreakRule& breaks);
extern template std::vector<std::uint16_t> PackedDepth(const std::vector<std::uint16_t>&,
                                                       const SampleGrid&, const BreakRule&);
extern template std::vector<float> PackedDepth(const std::vector<float>&, const SampleGrid&,
                                               const BreakRule&);

}  // namespace dtr::gl
