#include "cli/pipeline/storage_sweep.h"

#include <algorithm>
#include <utility>

#include "cli/pipeline/finishing.h"
#include "cli/pipeline/set_quality.h"
#include "dtr/base/machine.h"
#include "dtr/eval/timed_renderer.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/set_io.h"

namespace dtr::pipeline {
namespace {

enum Axis : size_t { kDepth, kImage, kSigma, kMesh };
constexpr const char *kPng = "png", *kJpeg = "jpeg", *kKept = "kept", *kLeftOut = "left-out";
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

std::uint64_t BytesOf(const DtrSet& set) {
  std::uint64_t bytes = 0;
  for (const View& view : set.frames.front().views) {
    if (view.role != ViewRole::kSource) continue;
    for (const std::optional<StoredFile>* file :
         {&view.image_file, &view.depth_file, &view.sigma_file, &view.mask_file, &view.mesh_file}) {
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
  axes_ = {{"depth", OwnFirst(stored.depth, codings)},
           {"image", OwnFirst(stored.image, {kPng, kJpeg})}};
  // What the set has not, it cannot keep.
  axes_.push_back({"sigma", {stored.sigma ? kKept : kLeftOut}});
  if (stored.sigma) axes_.back().values.emplace_back(kLeftOut);
  axes_.push_back({"mesh", {stored.mesh ? kKept : kLeftOut}});
  if (stored.mesh) axes_.back().values.emplace_back(kLeftOut);
}

eval::SweepMeasurement StorageSweep::Measure(const eval::SweepSetting& setting) const {
  const auto value = [&](Axis axis) {
    return axes_[axis].values.at(static_cast<size_t>(setting.at(axis)));
  };
  const TemporaryFolder scratch{ScratchFolder(options_.work)};
  const TemporaryFolder made{scratch.folder / "storage.dtr"};
  // Nothing is resumed: the folder is this run's own.
  std::filesystem::remove_all(made.folder.string() + ".partial");
  DtrSet set = io::ReadSet(options_.set);
  {
    io::SetWriter writer(made.folder, R"({"sweep":"storage"})", true,
                         value(kImage) == kPng ? io::ImageCoding::kPng : io::ImageCoding::kJpeg);
    io::LoadOptions load;
    load.sigma = value(kSigma) == kKept;
    load.threads = options_.threads;
    for (View& view : set.frames.front().views) {
      progress_.ThrowIfInterrupted();
      io::LoadPixels(options_.set, view, load);
      view.depth_file.reset();
      view.sigma_file.reset();
      view.mesh_file.reset();
      if (view.role == ViewRole::kSource) {
        view.depth_coding = io::DepthCodingFromName(value(kDepth));
        io::ClampToRange(view);
      }
      writer.WriteView(view, set.unit);
      view.image = {};
      view.mask = {};
      view.depth = {};
      view.inverse_depth_sigma.reset();
      view.mesh.reset();
    }
    if (value(kMesh) == kKept) WriteMeshes(set, writer, options_.threads);
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
    loaded = LoadToJudge(made.folder, false, options_.threads, progress_);
    load_ms.push_back(ProcessCpuMilliseconds() - start_ms);
  }
  measured.figures["load_cpu_ms"] = eval::TimesOf(load_ms).median_ms;
  JudgePictures(loaded, options_.render, options_.make_renderer(), measured);
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
