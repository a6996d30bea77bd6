#include "pipeline/build/build.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "calib/sparse_from_sfm.h"
#include "dtr/base/error.h"
#include "dtr/base/machine.h"
#include "dtr/eval/json.h"
#include "dtr/io/hand_over.h"
#include "dtr/io/run_record_json.h"
#include "dtr/io/set_io.h"
#include "dtr/io/validation_result.h"
#include "pipeline/build/advise.h"
#include "pipeline/build/detail/build_inputs.h"
#include "pipeline/build/detail/build_json.h"
#include "pipeline/build/detail/build_options.h"
#include "pipeline/build/detail/build_share.h"
#include "pipeline/build/detail/force_stage.h"
#include "pipeline/build/detail/part_files.h"
#include "pipeline/core/calibrate.h"
#include "pipeline/core/depth/depth_engine.h"
#include "pipeline/core/depth/depth_stage.h"
#include "pipeline/core/photos/undistort_photos.h"
#include "pipeline/core/reports/set_page.h"
#include "pipeline/core/run/finishing.h"
#include "pipeline/core/run/recorded_notes.h"
#include "pipeline/core/run/run_log.h"
#include "pipeline/validate/validate.h"

namespace dtr::pipeline {
namespace {

using Json = nlohmann::ordered_json;

SparseScene SparseOf(const CalibratedPhotos& calibrated, const std::vector<View>& views) {
  std::vector<std::string> names;
  std::vector<PinholeCamera> cameras;
  for (const View& view : views) {
    names.push_back(view.name);
    cameras.push_back(view.camera);
  }
  return calib::ToSparseScene(calibrated.model, names, cameras);
}

// The cameras of the photos themselves, whose depth maps are as distorted and as large as they.
PhotoCameras PhotoCamerasOf(const CalibratedPhotos& calibrated, const std::vector<View>& views) {
  std::map<std::string, const calib::LensCamera*> lens_of;
  for (const calib::SfmImage& image : calibrated.model.images) {
    lens_of[image.name] = &calibrated.model.cameras.at(image.camera_id);
  }
  PhotoCameras photos;
  for (const View& view : views) {
    const calib::LensCamera& lens = *lens_of.at(view.name);
    io::NamedCamera photo;
    photo.name = view.name;
    // What the view was undistorted onto, which need not have the lens' own principal point.
    photo.camera = view.camera.Resized(lens.width_px, lens.height_px);
    if (!lens.IsUndistorted()) photo.distortion = {calib::NameOf(lens.model), lens.params};
    photos[view.name] = std::move(photo);
  }
  return photos;
}

// The points that the source views alone would know: held-out photos move nothing.
std::vector<SparsePoint> SourcePoints(const SparseScene& sparse, const std::vector<View>& views) {
  std::vector<bool> is_source;
  for (const View& view : views) is_source.push_back(view.role == ViewRole::kSource);
  return RestrictToViews(sparse, is_source).points;
}

void RequireTwoSources(const capture::Capture& capture, const std::vector<bool>& held_out,
                       const CalibratedPhotos& calibrated) {
  int sources = 0;
  for (size_t i = 0; i < capture.photos.size(); ++i) {
    const auto& images = calibrated.model.images;
    sources += !held_out[i] && std::any_of(images.begin(), images.end(), [&](const auto& image) {
      return image.name == capture.photos[i].name;
    });
  }
  if (sources >= 2) return;
  throw Error(
      fmt::format("calibration: expected at least 2 photos to build from, found {} with a camera "
                  "({} photos have "
                  "none); take more overlapping photos or give `poses`",
                  sources, calibrated.not_registered.size()));
}

// The reprojection tests of every calibrated photo, held-out ones included.
SetValidation Validate(const std::filesystem::path& folder, DtrSet& set, const SparseScene& sparse,
                       double memory_gb, BuildReport& report, Progress& progress) {
  SetLimits limits;
  limits.memory_gb = std::min(limits.memory_gb, memory_gb);
  SetValidation validation = ValidateSet(folder, set, sparse, limits, progress);
  report.validated = true;
  report.validation_passed = validation.passed();
  set.validation_json = eval::ValidationJson(validation.tests);
  if (!report.validation_passed) {
    progress.Note(io::ValidationWarning(set));
  }
  return validation;
}

// Where the capture is thin, from the depth that was found. Kept out of set.json: it says nothing
// that `dtr advise` would not find in the set.
void AdviseOn(const std::filesystem::path& folder, DtrSet set, BuildReport& report,
              double memory_gb, Progress& progress) {
  io::CollapseDuplicates(set);
  const auto views = CoarseViewsOf(folder, set, memory_gb, progress);
  if (views.size() < 2) return;
  advise::AdviseOptions options;
  report.coverage = AdviceLines(advise::Advise(views, options, progress));
}

// What other processes did of these stages counts as an earlier run's work.
void AddParts(const std::filesystem::path& work, const std::vector<std::string>& stages,
              RunLog& log) {
  const DonePart total = TotalOf(work, stages);
  log.AddEarlier(total.wall_s, total.cpu_s);
}

// Cameras: worked out, or, for what comes after them, as they were frozen.
CalibratedPhotos CamerasOf(const capture::Capture& photos, const CalibrateOptions& calibrate,
                           const BuildShare& share, const std::filesystem::path& work,
                           Progress& progress) {
  const bool is_later = share.is_shared() && !calibrate.part;
  if (is_later || share.Is("ranges")) return FrozenCalibration(work);
  CalibratedPhotos calibrated = CalibratePhotos(photos, calibrate, work / "calibration", progress);
  if (calibrate.part) {  // given cameras with their points need none of it
    MarkBegun(work);
    throw PartDone();
  }
  if (share.Is("calibration")) FreezeCalibration(calibrated, work);
  share.EndAfter("calibration");
  return calibrated;
}

CalibrateOptions CalibrateOptionsFor(const BuildOptions& options, const BuildInputs& inputs,
                                     double memory_gb, const BuildShare& share) {
  CalibrateOptions calibrate;
  calibrate.poses = options.poses;
  calibrate.poses_format = options.poses_format;
  calibrate.held_out = inputs.held_out;
  calibrate.strict = options.holdout_strict;
  calibrate.seed = options.seed;
  calibrate.memory_gb = memory_gb;
  calibrate.refine = options.refine;
  calibrate.refine_poses = options.refine_poses;
  calibrate.rig = inputs.rig;
  calibrate.metres = options.metres;
  calibrate.sfm = options.sfm;
  calibrate.part = share.Sfm();
  return calibrate;
}

void ReportCalibration(const CalibratedPhotos& calibrated, const BuildInputs& inputs,
                       BuildReport& report) {
  report.not_registered = calibrated.not_registered;
  report.why_not_registered = calibrated.why_not_registered;
  const auto& lost = report.not_registered;
  for (size_t i = 0; i < inputs.held_out.size(); ++i) {
    const std::string& name = inputs.photos.photos[i].name;
    if (inputs.held_out[i] && std::find(lost.begin(), lost.end(), name) != lost.end()) {
      report.held_out_not_registered.push_back(name);
    }
  }
}

// What depth that was found becomes in the set.
void FinishDepth(const BuildOptions& options, const SparseScene& sparse, double memory_gb,
                 io::SetWriter& writer, DtrSet& set, Progress& progress) {
  FinishScene(set, SourcePoints(sparse, set.frames.front().views), writer, memory_gb, progress);
  if (options.depth.depth_error_px) {
    RecodeDepth(set, *options.depth.depth_error_px, writer, memory_gb, progress);
  }
  if (options.depth.completion) {
    CompleteDepth(set, sparse, writer, memory_gb, progress);
  }
  WriteMeshes(set, writer, memory_gb, progress);
}

// A process with a part of depth needs the images of all views.
void RequireImages(std::vector<View>& views, const io::SetWriter& writer) {
  for (View& view : views) {
    if (view.image_file || writer.RestoreView(view)) continue;
    throw Error(view.name +
                ": expected its undistorted image, found none; run all parts of the stage "
                "undistortion first");
  }
}

BuildReport BuildOrPart(const BuildOptions& options, Progress& listener) {
  const stereo::QualitySettings quality = QualityOf(options.depth);
  RequireEngine(options.depth);
  RequireOptions(options);
  std::optional<SetRig> rig;
  if (!options.rig.empty()) rig = ReadSetRig(options.rig);
  const double memory_gb = options.depth.memory_gb.value_or(kDefaultMemoryGb);
  BuildReport report;
  BuildShare share(options);
  RunLog log;
  RecordedNotes progress(listener);

  RequireCalibration(options.poses, options.poses_format, options.sfm);
  io::SetWriter::RequireTarget(options.output, options.force);
  log.Begin("capture");
  BuildInputs inputs = LookAtInputs(options, std::move(rig), memory_gb, progress);
  const Json fingerprint = FingerprintOf(options, quality, inputs, memory_gb);
  const std::string before_depth = BeforeDepth(options, fingerprint).dump();
  if (!options.part) io::HandOver(options.output, before_depth, fingerprint.dump());
  io::SetWriter writer = share.OpenWriter(options, fingerprint.dump());
  share.Lock(writer.work_folder());
  if (!options.force_stage.empty()) ForgetStage(writer.folder(), options.force_stage);
  if (inputs.is_derived) {
    DerivePhotos(options, share.is_shared(), writer, inputs, progress);
  }
  const capture::Capture& photos = inputs.photos;
  const std::vector<bool>& held_out = inputs.held_out;
  ReportPhotos(photos, report, progress);
  std::vector<bool> is_source = held_out;
  is_source.flip();

  log.Begin("calibration");
  const CalibratedPhotos calibrated =
      CamerasOf(photos, CalibrateOptionsFor(options, inputs, memory_gb, share), share,
                writer.work_folder(), progress);
  log.AddEarlier(calibrated.earlier_wall_s, calibrated.earlier_cpu_s);
  // Features know what their parts took.
  AddParts(writer.work_folder(), {"matching", "verification"}, log);
  ReportCalibration(calibrated, inputs, report);

  log.Begin("undistortion");
  AddParts(writer.work_folder(), {"undistortion"}, log);
  DtrSet set;
  set.unit = calibrated.unit;
  set.world_origin = calibrated.world_origin;
  set.frames.resize(1);
  std::vector<View>& views = set.frames.front().views;
  RequireTwoSources(photos, held_out, calibrated);
  views = UndistortPhotos(photos, calibrated, held_out,
                          {options.max_size_px, memory_gb, share.Undistortion()}, writer, progress);
  share.EndAfter("undistortion");
  if (share.is_shared()) RequireImages(views, writer);
  const SparseScene sparse = SparseOf(calibrated, views);

  log.Begin("depth");
  AddParts(writer.work_folder(), {"ranges", "search", "pass", "maps"}, log);
  DepthStageOptions depth_options;
  depth_options.seed = options.seed;
  depth_options.photos = PhotoCamerasOf(calibrated, views);
  depth_options.part = share.Depth();
  depth_options.keep_work = [&] {
    io::HandOver(options.output, fingerprint.dump(), before_depth);
    progress.Note(
        "cameras and undistorted photos are kept: the same command with another `depth_prior`, or "
        "none, continues");
  };
  const DepthStageResult stage =
      DepthStage(set, sparse, options.depth, quality, depth_options, writer, progress);
  report.prior = stage.prior;

  log.Begin("finishing");
  FinishDepth(options, sparse, memory_gb, writer, set, progress);
  set.provenance_json = ProvenanceJson(options, OptionsJson(options, stage.quality),
                                       PhotosJson(photos, is_source), calibrated, report)
                            .dump();
  const SetValidation validation =
      Validate(writer.folder(), set, sparse, memory_gb, report, progress);
  writer.WriteSparse(set, sparse);
  WriteSetPage(writer, set,
               {.name = options.output.stem().string(),
                .engine = options.depth.engine,
                .checks = validation.tests,
                .skipped = report.skipped,
                .not_registered = report.not_registered.size(),
                .prior = report.prior,
                .memory_gb = memory_gb},
               progress);
  AdviseOn(writer.folder(), set, report, memory_gb, progress);
  log.End();
  std::vector<std::string> lines = progress.lines();
  lines.insert(lines.end(), report.coverage.begin(), report.coverage.end());
  io::WriteRunRecord(writer.folder(), log.Record(std::move(lines)),
                     {{"screening", ScreeningJson(report)}});
  writer.Finish(set);
  report.set = std::move(set);
  report.written = options.output;
  report.calibration = calibrated.report;
  report.stages = log.stages();
  report.peak_memory_mib = static_cast<double>(PeakMemoryBytesWithPrograms()) / (1 << 20);
  return report;
}

}  // namespace

BuildReport BuildSet(const BuildOptions& asked, Progress& progress) {
  const BuildOptions options = ByPreset(asked);
  if (!options.part) return BuildOrPart(options, progress);
  const double cpu_start_ms = ProcessCpuMilliseconds();
  const auto start = std::chrono::steady_clock::now();
  try {
    BuildOrPart(options, progress);
    throw std::logic_error(
        "BuildSet: no stage ended as a part");  // nothing may be recorded as done
  } catch (const PartDone&) {
  }
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  WriteDonePart(io::SetWriter::WorkFolderOf(options.output), *options.part,
                {wall.count(), (ProcessCpuMilliseconds() - cpu_start_ms) / 1e3});
  BuildReport report;
  report.part = options.part;
  report.written = options.output;
  return report;
}

}  // namespace dtr::pipeline
