#include "dtr/simd/resolver.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "dtr/base/parallel_for.h"
#include "dtr/render/blend_weights.h"
#include "dtr/render/colour.h"
#include "dtr/render/exposure.h"

namespace dtr::simd {
namespace {

// exp(80) fits float32 and so does the sum of its like: no logarithms need to be compared
// (SPEC 4.6).
constexpr double kLargestLogWeight = 80;
// Larger ones multiply what quick angles are off by.
constexpr double kLargestFactor = 1e5;
constexpr int kRowsTogether = 16;

bool WeightsFitFloat(const BlendParameters& blend) {
  switch (blend.blend) {
    case BlendWeight::kInverseAngle:
      return std::abs(LogWeight(blend, 0, 0)) <= kLargestLogWeight &&
             std::abs(LogWeight(blend, std::numbers::pi, 0)) <= kLargestLogWeight;
    case BlendWeight::kCosine:
      return blend.exponent <= kLargestFactor;
    case BlendWeight::kExponential:
      return blend.falloff <= kLargestFactor;
    case BlendWeight::kAngle:
    case BlendWeight::kKNearest:
      return true;
  }
  return false;
}

/// Where false, a sample has a usable pixel of the image at its centre, and no colour is asked for
/// whose four pixels are all masked.
bool MaskNeedsTest(const View& view, const RenderOptions& options) {
  const bool masked = !view.mask.empty() || view.mask_file;  // the mask may be gone: CanDraw
  return masked && (view.depth_scale != 1 || options.resolution != 1);
}

PixelView PlaceView(const View& view, const ViewPlacement& placed, double cut_factor,
                    const RenderOptions& options, const SampledView& sampled) {
  PixelView out{};
  const PinholeCamera camera = view.DepthCamera();
  const double step = sampled.step, shift = sampled.offset + 0.5 - 0.5 * step;
  Eigen::Matrix3d grid_from_view;
  grid_from_view << camera.fx_px() / step, 0, (camera.cx_px() - shift) / step,  //
      0, camera.fy_px() / step, (camera.cy_px() - shift) / step,                //
      0, 0, 1;
  const Eigen::Matrix3d grid_from_novel = grid_from_view * placed.rotation.transpose();
  const Eigen::Vector3d away = -grid_from_novel * placed.translation;
  float* const rows[3] = {out.grid_x, out.grid_y, out.grid_z};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) rows[i][j] = static_cast<float>(grid_from_novel(i, j));
    rows[i][3] = static_cast<float>(away[i]);
    out.centre[i] = static_cast<float>(placed.translation[i]);
  }
  out.centre_squared = static_cast<float>(placed.translation.squaredNorm());
  out.columns = sampled.columns, out.rows = sampled.rows, out.stride = sampled.columns + 2;
  out.codes = sampled.codes.empty() ? nullptr : sampled.codes.data();
  out.values = sampled.values.data();
  out.whole_blocks = sampled.whole_blocks.data();
  out.cells = sampled.cells.empty() ? nullptr : sampled.cells.data();
  out.cell_stride = sampled.cell_stride;
  out.depth_offset = static_cast<float>(sampled.depth_offset);
  out.depth_factor = static_cast<float>(sampled.depth_factor);
  const InverseDepthThresholds thresholds = ThresholdsOf(view, options);
  out.level_range =
      options.absolute_depth_break ? -1.0f : static_cast<float>(thresholds.depth_break);
  out.pixel = static_cast<float>(thresholds.pixel);
  out.delta = static_cast<float>(thresholds.delta);
  out.cut_factor = static_cast<float>(cut_factor);
  out.fade_gain = static_cast<float>(placed.fading.gain);
  out.fade_offset = static_cast<float>(placed.fading.offset);
  out.clipped = static_cast<float>(placed.clipped);
  out.rgba = reinterpret_cast<const std::uint32_t*>(sampled.rgba.data());
  out.masked = MaskNeedsTest(view, options);
  out.width_px = view.camera.width_px(), out.height_px = view.camera.height_px();
  const double scale = view.depth_scale;
  for (int axis = 0; axis < 2; ++axis) {
    out.image_per_sample[axis] = static_cast<float>(scale * step);
    out.image_offset[axis] = static_cast<float>(scale * shift - 0.5);
  }
  return out;
}

/// What all rows of the frame have in common. `linear`: light of each 8-bit value.
PixelRow RowOf(const RenderFrame& frame, const float* linear) {
  const PinholeCamera& novel = frame.novel;
  const BlendParameters blend = BlendParametersOf(frame.options, novel.fx_px(), frame.scene.bounds);
  PixelRow row{};
  row.width_px = novel.width_px();
  row.inverse_fx = static_cast<float>(1 / novel.fx_px());
  row.inverse_fy = static_cast<float>(1 / novel.fy_px());
  row.cx = static_cast<float>(novel.cx_px()), row.cy = static_cast<float>(novel.cy_px());
  row.pixel_angle_rad = static_cast<float>(blend.pixel_angle_rad);
  row.least_inverse_depth = static_cast<float>(blend.least_inverse_depth);
  row.blend = blend.blend;
  row.exponent = static_cast<float>(blend.exponent);
  row.falloff = static_cast<float>(blend.falloff);
  row.max_angle_rad = static_cast<float>(blend.max_angle_rad);
  row.blend_k = blend.blend_k;
  row.precise_weights = !WeightsFitFloat(blend);
  row.nearest_views = frame.per_pixel ? frame.options.views : 0;
  row.absolute_delta = static_cast<float>(frame.options.absolute_delta.value_or(-1));
  row.clipped = frame.AnyClipped();
  row.linear = frame.options.blend_in_linear_light ? linear : nullptr;
  return row;
}

}  // namespace

void Resolver::Draw(const RenderFrame& frame, const Band& band, const SampledViews& sampled,
                    const std::vector<float>& surface,
                    const std::optional<WindowDepthMapping>& mapping) {
  std::vector<PixelView> views;
  for (size_t i = 0; i < frame.views.size(); ++i) {
    const View& view = *frame.views[i];
    views.push_back(PlaceView(view, frame.placements[i], frame.cut_factors[i], frame.options,
                              sampled.Of(view)));
  }
  width_px_ = frame.novel.width_px();
  band_ = band;
  const auto width = static_cast<size_t>(width_px_);
  const size_t pixels = width * static_cast<size_t>(band.count);
  image_.resize(pixels);
  depth_.resize(pixels);
  marks_.resize(pixels);
  if (mapping) window_.resize(pixels);
  const std::vector<float> linear(LinearFromSrgb8().begin(), LinearFromSrgb8().end());
  const std::optional<ExposureCurve> curve = CurveOf(frame.exposure);
  const PixelRow any_row = RowOf(frame, linear.data());
  // A thread's rows lie together: they read the same pixels of the views.
  const int pieces = (band.count + kRowsTogether - 1) / kRowsTogether;
  ParallelFor(0, pieces, [&](int piece) {
    const int end = std::min((piece + 1) * kRowsTogether, band.count);
    for (int y = piece * kRowsTogether; y < end; ++y) {
      const size_t first = static_cast<size_t>(y) * width;
      PixelRow row = any_row;
      row.y = static_cast<float>(band.first + y) + 0.5f;
      row.surface = &surface[first];
      row.image = &image_[first], row.depth = &depth_[first], row.marks = &marks_[first];
      ResolvePixelRow(row, views);
    }
    const size_t from = static_cast<size_t>(piece * kRowsTogether) * width;
    const size_t count = static_cast<size_t>(end) * width - from;
    if (curve) curve->Apply({&image_[from], count});
    if (mapping) {
      MapToWindow(*mapping, {&depth_[from], count}, {}, {&window_[from], count});
    }
  });
}

void Resolver::CopyTo(RenderResult& result) const {
  StoreRows(band_, width_px_, reinterpret_cast<const std::uint8_t*>(image_.data()),
            reinterpret_cast<const std::uint8_t*>(marks_.data()), result);
  std::copy(depth_.begin(), depth_.end(), result.depth.row(band_.first));
}

}  // namespace dtr::simd
