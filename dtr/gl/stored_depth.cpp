#include "dtr/gl/stored_depth.h"

#include <optional>

#include "dtr/gl/layer_sizes.h"
#include "dtr/types/inverse_depth_code.h"

namespace dtr::gl {
namespace {

/// That the view's depth was stored in; none where it was in no code of inverse depth.
std::optional<InverseDepthCode> CodeOf(const View& view) {
  if (!InverseDepthCode::IsRange(view.near_z, view.far_z)) return std::nullopt;
  if (view.depth_coding == DepthCoding::kPng16InverseDepth) {
    return InverseDepthCode(view.near_z, view.far_z);
  }
  const bool in_steps = view.depth_coding == DepthCoding::kZstdInverseDepth &&
                        view.depth_steps >= 1 && view.depth_steps <= InverseDepthCode::kSteps;
  if (!in_steps) return std::nullopt;
  return InverseDepthCode(view.near_z, view.far_z, view.depth_steps);
}

/// Empty where some depth is not exactly that of a code.
std::vector<std::uint16_t> ExactCodes(const View& view, const SampleGrid& samples) {
  const std::optional<InverseDepthCode> found = CodeOf(view);
  if (!found) return {};
  const InverseDepthCode& code = *found;
  const Grid<double>& w = samples.inverse_depth;
  std::vector<std::uint16_t> codes(w.data().size());
  size_t k = 0;
  for (int j = 0; j < w.height(); ++j) {
    const float* row = view.depth.row(samples.offset + j * samples.step) + samples.offset;
    for (int i = 0; i < w.width(); ++i, ++k) {
      if (!(w(i, j) > 0)) continue;
      const float depth_z = row[static_cast<std::ptrdiff_t>(i) * samples.step];
      codes[k] = code.Encode(depth_z);
      if (code.Decode(codes[k]) != depth_z) return {};
    }
  }
  return codes;
}

}  // namespace

StoredDepth StoreDepth(const View& view, const SampleGrid& samples) {
  StoredDepth stored;
  if (samples.inverse_depth.empty()) return stored;
  stored.codes = ExactCodes(view, samples);
  if (stored.codes.empty()) {
    const std::vector<double>& w = samples.inverse_depth.data();
    stored.values.assign(w.begin(), w.end());
    return stored;
  }
  const InverseDepthCode code = *CodeOf(view);
  stored.offset = code.first();
  stored.factor = code.step() * UINT16_MAX;
  return stored;
}

template <typename T>
std::vector<T> DepthPicture(const std::vector<T>& values, const SampleGrid& samples,
                            const BreakRule& breaks) {
  const Grid<double>& inverse_depth = samples.inverse_depth;
  const int columns = inverse_depth.width(), rows = inverse_depth.height();
  const LayerSize size = DepthPictureSize(columns, rows);
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
template std::vector<std::uint16_t> DepthPicture(const std::vector<std::uint16_t>&,
                                                 const SampleGrid&, const BreakRule&);
template std::vector<float> DepthPicture(const std::vector<float>&, const SampleGrid&,
                                         const BreakRule&);

}  // namespace dtr::gl
