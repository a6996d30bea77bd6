#include "dtr/render/stored_depth.h"

#include <optional>

#include "dtr/types/inverse_depth_code.h"

namespace dtr {
namespace {

/// That the view's depth was stored in; none where it was in no code of inverse depth.
std::optional<InverseDepthCode> CodeOf(const View& view) {
  if (!view.depth_state.empty()) return std::nullopt;  // two codes, of two ranges
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

}  // namespace dtr
