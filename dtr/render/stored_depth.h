// dtr/render/stored_depth.h -- a view's inverse depth as fast renderers store it: the set's own 16
// bits where they hold it exactly, else float.
#pragma once
#include <cstdint>
#include <vector>

#include "dtr/render/triangulation.h"
#include "dtr/types/view.h"

namespace dtr {

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

}  // namespace dtr
