#include "pipeline/bench/storage_sweep.h"

#include <algorithm>
#include <utility>

#include "dtr/base/machine.h"
#include "dtr/eval/timed_renderer.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/set_io.h"
#include "dtr/render/scene.h"
#include "pipeline/bench/detail/set_quality.h"
#include "pipeline/bench/detail/sweep_axes.h"
#include "pipeline/core/depth_settings.h"
#include "pipeline/core/run/finishing.h"

namespace dtr::pipeline {
namespace {

enum StorageAxis : size_t { kDepth, kImage, kSigma, kMesh };
constexpr const char *kPng = "png", *kJpeg = "jpeg", *kKept = "kept", *kLeftOut = "left-out";
/// Our bands (FORMAT 4.1) within a bound in pixels of disparity.
constexpr struct {
  const char* name;
  double error_px;
} kBands[] = {{"zstd-0.125px", 0.125}, {"zstd-0.25px", 0.25}, {"zstd-0.5px", 0.5}, {"zstd-1px", 1}};
constexpr struct {
  const char* name;
  int quality;
} kJpegs[] = {{"jpeg-95", 95}, {"jpeg-85", 85}, {"jpeg-70", 70}};
constexpr double kMillimetreFarthest = 65.535;                   // what 16 bits of millimetres hold
constexpr double kHalfNearest = 0x1p-14, kHalfFarthest = 65504;  // with half's 11 bits

/// The axis' values with the set's own first.
std::vector<std::string> OwnFirst(const std::string& own, std::vector<std::string> values) {
  const auto found = std::find(values.begin(), values.end(), own);
  if (found == values.end()) {
    values.insert(values.begin(), own);
  } else {
    std::rotate(values.begin(), found, found + 1);
  }
  return values;
}

struct Stored {
  std::string depth = io::NameOf(DepthCoding::kPng16InverseDepth), image = kPng;
  bool sigma = false, mesh = false, millimetres = false, half = true;
};

/// How the first source view lies on disk, and whether all would fit millimetres and half floats.
Stored HowItLies(const DtrSet& set) {
  Stored stored;
  stored.millimetres = set.unit == LengthUnit::kMetre;
  bool first = true;
  for (const View& view : set.frames.front().views) {
    if (view.role != ViewRole::kSource || !view.depth_file) continue;
    stored.millimetres = stored.millimetres && view.far_z <= kMillimetreFarthest;
    stored.half = stored.half && view.near_z >= kHalfNearest && view.far_z <= kHalfFarthest;
    if (!std::exchange(first, false)) continue;
    stored.depth = io::NameOf(view.depth_coding);
    stored.image = view.image_file && view.image_file->path.ends_with(".png") ? kPng : kJpeg;
    stored.sigma = view.sigma_file.has_value();
    stored.mesh = view.mesh_file.has_value();
  }
  return stored;
}

/// The depth of a view with its pixels in memory, in the coding of that name.
void RecodeDepth(View& view, const std::string& coding, LengthUnit unit, io::SetWriter& writer) {
  const auto* band = std::find_if(std::begin(kBands), std::end(kBands),
                                  [&](const auto& entry) { return coding == entry.name; });
  if (band != std::end(kBands)) {
    // As in `dtr prune`, a view of too wide a range for that bound keeps its coding.
    (void)io::TrySetDepthError(view, band->error_px * ThresholdsOf(view, {}).pixel);
  } else {
    view.depth_coding = io::DepthCodingFromName(coding);
    io::ClampToRange(view);
  }
  view.depth_file.reset();
  writer.RecodeDepth(view, unit);
}

/// The image of a view with its pixels in memory, in the coding of that name.
void RecodeImage(View& view, const std::string& coding, LengthUnit unit, io::SetWriter& writer) {
  for (const auto& jpeg : kJpegs) {
    if (coding == jpeg.name) return writer.WriteJpeg(view, jpeg.quality);
  }
  View pixels = view;
  pixels.mask = {};
  pixels.depth = {};
  pixels.inverse_depth_sigma.reset();
  writer.WriteView(pixels, unit);
  view.image_file = pixels.image_file;
}

std::uint64_t BytesOf(const DtrSet& set) {
  std::uint64_t bytes = 0;
  for (const View& view : set.frames.front().views) {
    if (view.role != ViewRole::kSource) continue;
    for (const std::optional<StoredFile>* file :
         {&view.image_file, &view.depth_file, &view.completed_file, &view.sigma_file,
          &view.mask_file, &view.mesh_file}) {
      if (*file) bytes += (*file)->bytes;
    }
  }
  return bytes;
}

}  // namespace

StorageSweep::StorageSweep(StorageSweepOptions options, Progress& progress)
    : options_(std::move(options)), progress_(progress) {
  const Stored stored = HowItLies(io::ReadSet(options_.set));
  std::vector<std::string> codings;
  for (const DepthCoding coding : {DepthCoding::kPng16InverseDepth, DepthCoding::kExrFloat}) {
    codings.emplace_back(io::NameOf(coding));
  }
  if (stored.half) codings.emplace_back(io::NameOf(DepthCoding::kExrHalf));
  if (stored.millimetres) codings.emplace_back(io::NameOf(DepthCoding::kPng16Millimetre));
  for (const auto& band : kBands) codings.emplace_back(band.name);
  std::vector<std::string> images{kPng};
  for (const auto& jpeg : kJpegs) images.emplace_back(jpeg.name);
  axes_ = {{"depth", OwnFirst(stored.depth, codings)}, {"image", OwnFirst(stored.image, images)}};
  // What the set has not, it cannot keep.
  axes_.push_back({"sigma", {stored.sigma ? kKept : kLeftOut}});
  if (stored.sigma) axes_.back().values.emplace_back(kLeftOut);
  axes_.push_back({"mesh", {stored.mesh ? kKept : kLeftOut}});
  if (stored.mesh) axes_.back().values.emplace_back(kLeftOut);
}

const std::string& StorageSweep::Value(const eval::SweepSetting& setting, size_t axis) const {
  return axes_[axis].values.at(static_cast<size_t>(setting.at(axis)));
}

void StorageSweep::Write(View& view, const eval::SweepSetting& setting, LengthUnit unit,
                         io::SetWriter& writer) const {
  // The first value of depth and image is how the set lies: those files stay as they are.
  const bool source = view.role == ViewRole::kSource;
  const bool same_depth = setting.at(kDepth) == 0 || !source;
  const bool same_image = setting.at(kImage) == 0 || !source;
  if (!same_depth || !same_image) {
    io::LoadOptions load;
    load.sigma = false;
    io::LoadPixels(options_.set, view, load);
  }
  if (Value(setting, kSigma) != kKept) view.sigma_file.reset();
  // Meshes are of the depth as it is stored.
  if (!same_depth || Value(setting, kMesh) != kKept) view.mesh_file.reset();
  View copied = view;
  if (!same_depth) copied.depth_file.reset();
  // Masks are stored the same way beside any image.
  if (!same_image) copied.image_file.reset();
  writer.CopyFiles(options_.set, copied);
  if (!same_depth) RecodeDepth(view, Value(setting, kDepth), unit, writer);
  if (!same_image) RecodeImage(view, Value(setting, kImage), unit, writer);
  view.image = {};
  view.mask = {};
  view.depth = {};
}

eval::SweepMeasurement StorageSweep::Measure(const eval::SweepSetting& setting) const {
  const ScratchFolder scratch(options_.work);
  const std::filesystem::path made = scratch / "storage.dtr";
  DtrSet set = io::ReadSet(options_.set);
  {
    io::SetWriter writer(made, R"({"sweep":"storage"})", true);
    for (View& view : set.frames.front().views) {
      progress_.ThrowIfInterrupted();
      Write(view, setting, set.unit, writer);
    }
    if (Value(setting, kMesh) == kKept && setting.at(kDepth) != 0) {
      NotesOnly notes(progress_);
      WriteMeshes(set, writer, kDefaultMemoryGb, notes);
    }
    // The calibration's points are no part of what is rendered from.
    set.sparse_file.reset();
    writer.Finish(set);
  }
  eval::SweepMeasurement measured;
  measured.cost = static_cast<double>(BytesOf(set));
  measured.cost_least = measured.cost_most = measured.cost;
  std::vector<double> load_ms;
  constexpr int kLoads = 3;
  DtrSet loaded;
  for (int i = 0; i < kLoads; ++i) {
    const double start_ms = ProcessCpuMilliseconds();
    loaded = LoadToEvaluate(made, false, progress_);
    load_ms.push_back(ProcessCpuMilliseconds() - start_ms);
  }
  measured.figures["load_cpu_ms"] = eval::TimesOf(load_ms).median_ms;
  EvaluateImages(loaded, options_.render, options_.make_renderer(), measured);
  return measured;
}

eval::SweepStage StorageSweep::Stage() const {
  eval::SweepStage stage;
  stage.name = "storage";
  stage.cost_name = "bytes of the source views";
  stage.error_name = "RMS error, 8-bit levels";
  stage.cost_is_time = false;
  stage.axes = axes_;
  stage.applies = [](const eval::SweepSetting&, size_t) { return true; };
  stage.measure = [this](const eval::SweepSetting& setting) { return Measure(setting); };
  return stage;
}

}  // namespace dtr::pipeline
