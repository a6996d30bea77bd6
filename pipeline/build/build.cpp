#include "pipeline/build/build.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>

#include "calib/sparse_from_sfm.h"
#include "dtr/base/delete.h"
#include "dtr/base/error.h"
#include "dtr/base/machine.h"
#include "dtr/eval/json.h"
#include "dtr/io/hand_over.h"
#include "dtr/io/run_record_json.h"
#include "dtr/io/set_io.h"
#include "dtr/io/validation_result.h"
#include "pipeline/build/advise.h"
#include "pipeline/build/build_part.h"
#include "pipeline/build/detail/build_inputs.h"
#include "pipeline/build/detail/build_json.h"
#include "pipeline/build/detail/build_options.h"
#include "pipeline/build/detail/part_files.h"
#include "pipeline/build/detail/stages.h"
#include "pipeline/core/calibrate.h"
#include "pipeline/core/depth/depth_engine.h"
#include "pipeline/core/depth/depth_stage.h"
#include "pipeline/core/photos/undistort_photos.h"
#include "pipeline/core/reports/set_page.h"
#include "pipeline/core/run/finishing.h"
#include "pipeline/core/run/recorded_notes.h"
#include "pipeline/core/run/run_log.h"
#include "pipeline/validate/validate.h"
#include "stereo/engine.h"

namespace dtr::pipeline {
namespace {

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

void RejectShared(bool given, const char* what) {
  if (given) throw UsageError(std::string("a build in parts: ") + what);
}

void RequireShareable(const BuildOptions& options) {
  RejectShared(options.depth.time_budget_s.has_value(),
               "`time_budget` measures how much one machine does; give `preset`");
  RejectShared(options.depth.engine == "colmap" || options.depth.engine == "prior",
               "expected `engine` patchmatch, sgbm or none");
  RejectShared(options.depth.prior.given(),
               "depth priors do not go with it; leave out `depth_prior`");
  RejectShared(!options.force_stage.empty(),
               "`force_stage` does not go with it; delete the partial set to begin again");
}

// The stages of `dtr build`, and what they pass on.
class StillBuild {
 public:
  // `part`: null: the whole.
  StillBuild(const BuildOptions& options, Progress& listener, const BuildPart* part = nullptr)
      : options_(options),
        part_(part),
        progress_(listener),
        quality_(QualityOf(options.depth)),
        memory_gb_(options.depth.memory_gb.value_or(kDefaultMemoryGb)) {}

  std::vector<Stage> Stages() {
    return {{"capture",
             [this] { Capture(false); },
             {"work/capture", "work/frames"},
             [this] { return std::vector{SfmStep("capture", false, sfm::SfmStage::kPhotos)}; }},
            {"calibration",
             [this] { Calibrate({}); },
             {"work/calibration"},
             [this] { return CalibrationSteps(); }},
            {"undistortion",
             [this] { Undistort({}); },
             {"images", "mask", "held_out", "work/views"},
             [this] {
               return std::vector<Step>{
                   {{"undistortion", true}, [this](const Part& part) { TakeViews(part); }}};
             }},
            {"depth",
             [this] { FindDepth({}); },
             {"depth", "sigma", "mesh", "work/planes", "work/estimates", "work/effort.json",
              "work/colmap"},
             [this] { return DepthSteps(); }},
            {"finishing", [this] { Finish(); }}};
  }

  // Those of all stages that processes can share.
  std::vector<Step> Steps() {
    RequireShareable(options_);
    std::vector<Step> steps;
    for (const Stage& stage : Stages()) {
      if (!stage.steps) continue;
      for (Step& step : stage.steps()) steps.push_back(std::move(step));
    }
    return steps;
  }

  BuildReport Run() {
    RunStages(Stages(), io::SetWriter::WorkFolderOf(options_.output), log_);
    return std::move(report_);
  }

  void RunPart() {
    const std::vector<Step> steps = Steps();
    RequirePart(*part_, {steps.begin(), steps.end()});
    for (const Step& step : steps) {
      if (step.name != part_->stage) continue;
      Capture(step.has_parts);
      step.run(part_->part);
    }
  }

 private:
  Step SfmStep(const char* name, bool has_parts, sfm::SfmStage stage, bool is_counted = false) {
    return {{name, has_parts},
            [=, this](const Part& part) {
              Calibrate(sfm::SfmPart{stage, part});
              MarkBegun(writer_->work_folder());  // given cameras with points leave nothing
            },
            is_counted};
  }

  std::vector<Step> CalibrationSteps() {
    using Of = sfm::SfmStage;
    std::vector<Step> steps;
    // COLMAP looks for features and matches in a process of its own, all at once.
    if (options_.sfm.engine != sfm::SfmEngine::kColmap &&
        NeedsFeatures(options_.poses, options_.poses_format)) {
      steps = {SfmStep("features", true, Of::kFeatures), SfmStep("pairs", false, Of::kPairs),
               SfmStep("matching", true, Of::kMatching, true),
               SfmStep("verification", true, Of::kVerification, true)};
    }
    steps.push_back({{"calibration", false},
                     [this](const Part&) {
                       Calibrate({});
                       FreezeCalibration(calibrated_, writer_->work_folder());
                     },
                     false});
    return steps;
  }

  std::vector<Step> DepthSteps() {
    if (options_.depth.engine != "patchmatch" && options_.depth.engine != "sgbm") return {};
    const int passes = stereo::MakeEngine(options_.depth.engine, quality_)->Passes();
    std::vector<Step> steps = {{{"ranges", false}, [this](const Part& part) {
                                  TakeViews({});
                                  FindDepth(DepthStep{DepthStep::kRanges, part});
                                }}};
    for (int pass = passes > 0 ? 0 : 1; pass <= passes + 1; ++pass) {
      const std::string name = pass > passes ? "maps"
                               : pass == 0   ? "search"
                                             : fmt::format("pass-{}", pass);
      steps.push_back({{name, true}, [this, pass](const Part& part) {
                         TakeViews({0, 0});
                         RequireImages(set_.frames.front().views, *writer_);
                         FindDepth(DepthStep{pass, part});
                       }});
    }
    return steps;
  }

  void Capture(bool is_shared) {
    RequireEngine(options_.depth);
    RequireOptions(options_);
    std::optional<SetRig> rig;
    if (!options_.rig.empty()) rig = ReadSetRig(options_.rig);
    RequireCalibration(options_.poses, options_.poses_format, options_.sfm);
    io::SetWriter::RequireTarget(options_.output, options_.force);
    inputs_ = LookAtInputs(options_, std::move(rig), memory_gb_, progress_);
    const auto fingerprint = FingerprintOf(options_, quality_, inputs_, memory_gb_);
    before_depth_ = BeforeDepth(options_, fingerprint).dump();
    fingerprint_ = fingerprint.dump();
    if (part_ == nullptr) io::HandOver(options_.output, before_depth_, fingerprint_);
    if (is_shared) {
      writer_.emplace(io::SetWriter::Join(options_.output, fingerprint_, options_.force));
    } else {
      writer_.emplace(options_.output, fingerprint_, options_.force);
    }
    if (part_ != nullptr) lock_ = LockPart(writer_->work_folder(), *part_);
    if (!options_.force_stage.empty()) ForgetStage();
    if (inputs_.is_derived) DerivePhotos(options_, is_shared, *writer_, inputs_, progress_);
    ReportPhotos(inputs_.photos, report_, progress_);
  }

  // Removes what the stage and all after it left, so that the run does them again.
  void ForgetStage() {
    const auto stages = Stages();
    const auto from = std::find_if(stages.begin(), stages.end(), [&](const Stage& stage) {
      return stage.name == options_.force_stage && !stage.leaves.empty();
    });
    if (from == stages.end()) {
      throw UsageError(fmt::format("`force_stage` {}: expected one of {}", options_.force_stage,
                                   fmt::join(StagesKept(), ", ")));
    }
    // Records of parts, and the cameras frozen for them, would speak of what is gone; then later
    // stages first: should this be cut off, what is left is the work of an earlier moment.
    const auto remove = [&](const std::string& path) { RemoveTree(writer_->folder() / path); };
    for (const char* of_parts : {"work/parts", "work/frozen_cameras"}) remove(of_parts);
    for (auto stage = stages.end(); stage-- != from;) {
      for (const std::string& path : stage->leaves) remove(path);
    }
  }

  void Calibrate(const std::optional<sfm::SfmPart>& part) {
    CalibrateOptions calibrate;
    calibrate.poses = options_.poses;
    calibrate.poses_format = options_.poses_format;
    calibrate.held_out = inputs_.held_out;
    calibrate.strict = options_.holdout_strict;
    calibrate.seed = options_.seed;
    calibrate.memory_gb = memory_gb_;
    calibrate.refine = options_.refine;
    calibrate.refine_poses = options_.refine_poses;
    calibrate.rig = inputs_.rig;
    calibrate.metres = options_.metres;
    calibrate.sfm = options_.sfm;
    calibrated_ = CalibratePhotos(inputs_.photos, calibrate, writer_->work_folder() / "calibration",
                                  progress_, part);
    log_.AddEarlier(calibrated_.earlier_wall_s, calibrated_.earlier_cpu_s);
    ReportCalibration(calibrated_, inputs_, report_);
  }

  // `part`: of the views; the others have no images.
  void Undistort(const Part& part) {
    set_.unit = calibrated_.unit;
    set_.world_origin = calibrated_.world_origin;
    set_.frames.resize(1);
    RequireTwoSources(inputs_.photos, inputs_.held_out, calibrated_);
    set_.frames.front().views =
        UndistortPhotos(inputs_.photos, calibrated_, inputs_.held_out,
                        {options_.max_size_px, memory_gb_}, *writer_, progress_, part);
  }

  // The same with the cameras that the stage before has frozen.
  void TakeViews(const Part& part) {
    calibrated_ = FrozenCalibration(writer_->work_folder());
    Undistort(part);
  }

  void FindDepth(const std::optional<DepthStep>& step) {
    sparse_ = SparseOf(calibrated_, set_.frames.front().views);
    DepthStageOptions depth;
    depth.seed = options_.seed;
    depth.photos = PhotoCamerasOf(calibrated_, set_.frames.front().views);
    depth.keep_work = [&] {
      io::HandOver(options_.output, fingerprint_, before_depth_);
      progress_.Note(
          "cameras and undistorted photos are kept: the same command with another `depth_prior`, "
          "or none, continues");
    };
    const DepthStageResult found =
        DepthStage(set_, sparse_, options_.depth, quality_, depth, *writer_, progress_, step);
    report_.prior = found.prior;
    quality_ = found.quality;
  }

  void Finish() {
    FinishDepth(options_, sparse_, memory_gb_, *writer_, set_, progress_);
    std::vector<bool> is_source = inputs_.held_out;
    is_source.flip();
    set_.provenance_json =
        ProvenanceJson(options_, OptionsJson(options_, quality_),
                       PhotosJson(inputs_.photos, is_source), calibrated_, report_)
            .dump();
    const SetValidation validation =
        Validate(writer_->folder(), set_, sparse_, memory_gb_, report_, progress_);
    writer_->WriteSparse(set_, sparse_);
    WriteSetPage(*writer_, set_,
                 {.name = options_.output.stem().string(),
                  .engine = options_.depth.engine,
                  .checks = validation.tests,
                  .skipped = report_.skipped,
                  .not_registered = report_.not_registered.size(),
                  .prior = report_.prior,
                  .memory_gb = memory_gb_},
                 progress_);
    AdviseOn(writer_->folder(), set_, report_, memory_gb_, progress_);
    log_.End();
    std::vector<std::string> lines = progress_.lines();
    lines.insert(lines.end(), report_.coverage.begin(), report_.coverage.end());
    io::WriteRunRecord(writer_->folder(), log_.Record(std::move(lines)),
                       {{"screening", ScreeningJson(report_)}});
    writer_->Finish(set_);
    report_.set = std::move(set_);
    report_.written = options_.output;
    report_.calibration = calibrated_.report;
    report_.stages = log_.stages();
    report_.peak_memory_mib = static_cast<double>(PeakMemoryBytesWithPrograms()) / (1 << 20);
  }

  const BuildOptions options_;
  const BuildPart* part_;
  RecordedNotes progress_;
  stereo::QualitySettings quality_;
  const double memory_gb_;
  RunLog log_;
  BuildReport report_;
  BuildInputs inputs_;
  std::string fingerprint_, before_depth_;
  std::optional<FileLock> lock_;
  std::optional<io::SetWriter> writer_;
  CalibratedPhotos calibrated_;
  DtrSet set_;
  SparseScene sparse_;
};

}  // namespace

std::vector<std::string> StagesKept() {
  SilentProgress silent;
  std::vector<std::string> names;
  for (const Stage& stage : StillBuild({}, silent).Stages()) {
    if (!stage.leaves.empty()) names.push_back(stage.name);
  }
  return names;
}

BuildReport BuildSet(const BuildOptions& options, Progress& progress) {
  return StillBuild(ByPreset(options), progress).Run();
}

std::vector<BuildStage> BuildStages(const BuildOptions& options) {
  SilentProgress silent;
  const auto steps = StillBuild(ByPreset(options), silent).Steps();
  return {steps.begin(), steps.end()};
}

void RunBuildPart(const BuildOptions& options, const BuildPart& part, Progress& progress) {
  const double cpu_start_ms = ProcessCpuMilliseconds();
  const auto start = std::chrono::steady_clock::now();
  StillBuild(ByPreset(options), progress, &part).RunPart();
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  WriteDonePart(io::SetWriter::WorkFolderOf(options.output), part,
                {wall.count(), (ProcessCpuMilliseconds() - cpu_start_ms) / 1e3});
}

}  // namespace dtr::pipeline
