#include "dtr/eval/render_sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "dtr/base/error.h"
#include "dtr/render/option_names.h"

namespace dtr::eval {
namespace {

// Order of the axes; those of a weight come after it (SweepStage::applies).
enum Axis : size_t {
  kMethod,
  kViews,
  kResolution,
  kBlend,
  kTolerance,
  kDelta,
  kPointSize,
  kExponent,
  kFalloff,
  kBlendK,
  kMaxAngle
};
constexpr const char* kSplats = "splat";  // two-pass with the other primitive

std::string MethodName(const RenderOptions& options) {
  const bool splats =
      options.method == RenderMethod::kTwoPass && options.primitive == Primitive::kSplat;
  return splats ? kSplats : NameOf(options.method);
}

/// `usual` first, then those of `values` that are something else.
template <typename T>
std::vector<std::string> Values(const T& usual, const std::vector<T>& values) {
  std::vector<std::string> names{fmt::format("{}", usual)};
  for (const T& value : values) {
    if (value != usual) names.push_back(fmt::format("{}", value));
  }
  return names;
}

std::vector<std::string> BlendValues(BlendWeight usual) {
  std::vector<std::string> names;
  for (const BlendWeight blend : kBlendWeights) names.emplace_back(NameOf(blend));
  return Values(std::string(NameOf(usual)), names);
}

std::string DegreesName(double radians) {
  return fmt::format("{:.6g}", radians * 180 / std::numbers::pi);
}

/// Values given are tried as they are; ours begin with the option's.
std::vector<std::string> CountValues(int usual, const std::vector<int>& given,
                                     const std::vector<int>& ours, int most) {
  std::vector<int> values;
  for (const int value : given.empty() ? ours : given) {
    if (value <= most || !given.empty()) values.push_back(value);
  }
  return Values(given.empty() ? usual : given.front(), values);
}

}  // namespace

double RmsLevels(double psnr_db) {
  constexpr double kEqual = 1e-6;  // what stands for 0 on a logarithmic axis
  return std::max(255 * std::pow(10, -psnr_db / 20), kEqual);
}

RenderSweep::RenderSweep(const DtrSet& set, const RenderSweepOptions& options,
                         TimedRenderer& renderer, const Progress& progress)
    : options_(options), renderer_(renderer), progress_(progress) {
  bool left_out = false;
  places_ = PlacesToCompare(set, options.bench, options.bench.cameras, left_out);
  const RenderOptions& usual = options.bench.render;
  const int sources = static_cast<int>(places_.front().scene.views.size());
  constexpr int kNoLimit = 1 << 10;
  axes_ = {
      {"method",
       Values(MethodName(usual), std::vector<std::string>{"deferred", "two-pass", kSplats})},
      {"views", CountValues(usual.views, options.bench.views, {1, 2, 3, 4, 6, 8, 12}, sources)},
      {"resolution", CountValues(usual.resolution, options.bench.resolutions, {1, 2, 4}, kNoLimit)},
      {"blend", BlendValues(usual.blend)},
      {"mesh-tolerance", Values(usual.mesh_tolerance_px, std::vector{0.25, 0.5, 1.0, 2.0})},
      {"delta", Values(usual.delta_px, std::vector{0.5, 1.0, 2.0})},
      {"point-size", Values(usual.point_size, std::vector{0.75, 1.0, 1.5})},
      {"exponent", Values(usual.exponent, std::vector{2.0, 8.0, 32.0})},
      {"falloff", Values(usual.falloff, std::vector{2.0, 8.0, 32.0})},
      {"blend-k", Values(usual.blend_k, std::vector{1, 2, 4})},
      {"max-angle",
       Values(DegreesName(usual.max_angle_rad), std::vector<std::string>{"30", "60", "90"})}};
}

bool RenderSweep::Applies(const SweepSetting& setting, size_t axis) const {
  const RenderOptions options = OptionsOf(setting);
  const bool two_pass = options.method == RenderMethod::kTwoPass;
  switch (axis) {
    case kBlend:
      return options.views > 1;
    case kTolerance:
      return !two_pass;
    case kDelta:
      return two_pass && !options.absolute_delta;
    case kPointSize:
      return two_pass && options.primitive == Primitive::kSplat;
    case kExponent:
      return options.views > 1 && options.blend == BlendWeight::kCosine;
    case kFalloff:
      return options.views > 1 && options.blend == BlendWeight::kExponential;
    case kBlendK:
      return options.views > 1 && (options.blend == BlendWeight::kInverseAngle ||
                                   options.blend == BlendWeight::kKNearest);
    default:  // max-angle among them: it says which views are valid, under every weight
      return true;
  }
}

RenderOptions RenderSweep::OptionsOf(const SweepSetting& setting) const {
  const auto value = [&](Axis axis) -> const std::string& {
    return axes_[axis].values.at(static_cast<size_t>(setting.at(axis)));
  };
  RenderOptions options = options_.bench.render;
  const bool splats = value(kMethod) == kSplats;
  options.method = value(kMethod) == NameOf(RenderMethod::kDeferred) ? RenderMethod::kDeferred
                                                                     : RenderMethod::kTwoPass;
  options.primitive = splats ? Primitive::kSplat : Primitive::kMesh;
  options.views = std::stoi(value(kViews));
  options.resolution = std::stoi(value(kResolution));
  for (const BlendWeight blend : kBlendWeights) {
    if (value(kBlend) == NameOf(blend)) options.blend = blend;
  }
  options.mesh_tolerance_px = std::stod(value(kTolerance));
  options.delta_px = std::stod(value(kDelta));
  options.point_size = std::stod(value(kPointSize));
  options.exponent = std::stod(value(kExponent));
  options.falloff = std::stod(value(kFalloff));
  options.blend_k = std::stoi(value(kBlendK));
  if (setting.at(kMaxAngle) != 0) {  // the default's degrees need not come back as the same bits
    options.max_angle_rad = std::stod(value(kMaxAngle)) * std::numbers::pi / 180;
  }
  options.fill_holes = options.smooth_edges = false;  // timed apart
  return options;
}

std::vector<std::string> RenderSweep::Cameras() const {
  std::vector<std::string> names;
  for (const Place& place : places_) names.push_back(place.photo->name);
  return names;
}

SweepMeasurement RenderSweep::Measure(const SweepSetting& setting) const {
  const RenderOptions options = OptionsOf(setting);
  const RowSums sums =
      MeasureRows(places_, {options}, options_.bench.repeats, renderer_, progress_).front();
  const BenchRow row = sums.Mean(options);
  if (!row.psnr_db) throw Error("bench: no photo has a pixel to compare with");
  if (sums.cut()) {
    throw Error(fmt::format(
        "bench: {} views: memory holds fewer of them; give `gpu_memory`, or fewer `views`",
        options.views));
  }
  const Times& cost = renderer_.HasGpuClock() ? row.frame : row.cpu;
  SweepMeasurement measured;
  measured.cost = cost.median_ms;
  measured.cost_least = cost.min_ms;
  measured.cost_most = cost.max_ms;
  measured.psnr_db = *row.psnr_db;
  measured.error = RmsLevels(*row.psnr_db);
  measured.figures = {{"views_used", row.views_used},
                      {"coverage", row.coverage},
                      {"wall_ms", row.frame.median_ms},
                      {"read_back_cpu_ms", row.read_back_cpu.median_ms},
                      {"fill_cpu_ms", row.fill_cpu.median_ms}};
  if (row.psnr_covered_db) measured.figures["psnr_covered_db"] = *row.psnr_covered_db;
  return measured;
}

SweepStage RenderSweep::Stage() const {
  SweepStage stage;
  stage.name = "render";
  stage.cost_name = renderer_.HasGpuClock() ? "GPU ms a frame" : "CPU ms a frame";
  stage.error_name = "RMS error, 8-bit levels";
  stage.axes = axes_;
  stage.applies = [this](const SweepSetting& setting, size_t axis) {
    return Applies(setting, axis);
  };
  stage.measure = [this](const SweepSetting& setting) { return Measure(setting); };
  return stage;
}

}  // namespace dtr::eval
