#include "dtr/gl/packed_depth.h"

#include "dtr/gl/layer_sizes.h"

namespace dtr::gl {

template <typename T>
std::vector<T> PackedDepth(const std::vector<T>& values, const SampleGrid& samples,
                           const BreakRule& breaks) {
  const Grid<double>& inverse_depth = samples.inverse_depth;
  const int columns = inverse_depth.width(), rows = inverse_depth.height();
  const LayerSize size = PackedDepthSize(columns, rows);
  std::vector<T> picture = WithEdge(values.data(), {columns, rows}, 1, {columns + 1, rows + 1});
  const auto width = static_cast<size_t>(size.width_px);
  picture.resize(width * static_cast<size_t>(size.height_px));
  T* const bits = &picture[width * (static_cast<size_t>(rows) + 1)];
  for (int y = 0; y <= rows; ++y) {
    T* const row = bits + width * static_cast<size_t>(y / kBlocksPerTexel);
    const int bit = 1 << (y % kBlocksPerTexel);
    for (int x = 0; x <= columns; ++x) {
      if (IsWholeBlock(inverse_depth, x - 1, y - 1, breaks) ||
          IsMaskedBlock(samples, x - 1, y - 1)) {
        row[x] = static_cast<T>(row[x] + bit);
      }
    }
  }
  return picture;
}
template std::vector<std::uint16_t> PackedDepth(const std::vector<std::uint16_t>&,
                                                const SampleGrid&, const BreakRule&);
template std::vector<float> PackedDepth(const std::vector<float>&, const SampleGrid&,
                                        const BreakRule&);

}  // namespace dtr::gl
