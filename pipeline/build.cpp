#include "pipeline/build.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>

#include "calib/sparse_from_sfm.h"
#include "capture/duplicates.h"
#include "capture/ingest.h"
#include "capture/store.h"
#include "capture/video/frames.h"
#include "dtr/base/error.h"
#include "dtr/base/hash.h"
#include "dtr/base/machine.h"
#include "dtr/base/parallel_for.h"
#include "dtr/eval/json.h"
#include "dtr/io/hand_over.h"
#include "dtr/io/run_record_json.h"
#include "dtr/io/set_io.h"
#include "dtr/io/validation_result.h"
#include "pipeline/advise.h"
#include "pipeline/calibrate.h"
#include "pipeline/capture.h"
#include "pipeline/detail/cameras/camera_formats.h"
#include "pipeline/detail/depth/depth_engine.h"
#include "pipeline/detail/depth/depth_stage.h"
#include "pipeline/detail/pages/set_page.h"
#include "pipeline/detail/photos/holdout.h"
#include "pipeline/detail/photos/input_hash.h"
#include "pipeline/detail/photos/undistort_photos.h"
#include "pipeline/detail/reports/build_json.h"
#include "pipeline/detail/run/build_options.h"
#include "pipeline/detail/run/build_share.h"
#include "pipeline/detail/run/finishing.h"
#include "pipeline/detail/run/force_stage.h"
#include "pipeline/detail/run/part_files.h"
#include "pipeline/detail/run/recorded_notes.h"
#include "pipeline/detail/run/run_log.h"
#include "pipeline/model_grid.h"
#include "pipeline/validate.h"

namespace dtr::pipeline {
namespace {

using Json = nlohmann::ordered_json;

std::vector<std::string> NamesOf(const capture::Capture& capture) {
  std::vector<std::string> names;
  for (const capture::Photo& photo : capture.photos) names.push_back(photo.name);
  return names;
}

// Photos by name, size and content: equal values mean the same input. Hashes of held-out photos are
// for the fingerprint alone: nothing of their pixels may enter the set outside held_out/.
Json PhotosJson(const capture::Capture& capture, const std::vector<bool>& with_hash) {
  Json photos = Json::array();
  for (size_t i = 0; i < capture.photos.size(); ++i) {
    const capture::Photo& photo = capture.photos[i];
    photos.push_back(
        {{"name", photo.name}, {"width_px", photo.width_px}, {"height_px", photo.height_px}});
    if (with_hash[i]) photos.back()["sha256"] = photo.source_sha256;
    if (with_hash[i] && !photo.mask_sha256.empty()) {
      photos.back()["mask_sha256"] = photo.mask_sha256;
    }
    if (const auto& frame = photo.video_frame) {
      photos.back()["video"] = frame->video;
      photos.back()["frame"] = frame->number;
    }
  }
  return photos;
}

// What a capture holds now, as its list only tells what its photos were made of.
Json StoredHashes(const capture::Capture& capture) {
  Json hashes = Json::array();
  for (const capture::Photo& photo : capture.photos) {
    hashes.push_back(Sha256OfFile(photo.file));
    if (!photo.mask_file.empty()) hashes.push_back(Sha256OfFile(photo.mask_file));
  }
  return hashes;
}

// The sizes that photos for SfM have, or frames of the videos will.
std::vector<std::pair<int, int>> SizesOf(const BuildOptions& options,
                                         const capture::Capture& photos,
                                         const std::vector<bool>& held_out) {
  std::vector<std::pair<int, int>> sizes;
  for (const std::filesystem::path& file : capture::VideosOf(options.photos)) {
    capture::VideoReader video(file);
    if (!video.Next()) continue;
    const ImageRgb8 picture = video.Picture();
    sizes.emplace_back(picture.width(), picture.height());
  }
  for (size_t i = 0; i < photos.photos.size(); ++i) {
    if (options.holdout_strict && i < held_out.size() && held_out[i]) continue;
    sizes.emplace_back(photos.photos[i].width_px, photos.photos[i].height_px);
  }
  return sizes;
}

// What a video is known by before its frames are chosen: equal values give the same frames.
Json VideoJson(const BuildOptions& options) {
  return {{"sha256", InputHash(capture::VideosOf(options.photos))},
          {"every", options.video.every},
          {"motion", options.video.motion},
          {"max_frames", options.video.most},
          {"synchronised", options.video.synchronised}};
}

// Which photos are held out; of panoramas whole ones.
std::vector<bool> HeldOutOf(const std::string& spec, const capture::Capture& photos) {
  if (photos.photos.empty() || !photos.photos.front().face) {
    return ChooseHeldOut(spec, NamesOf(photos));
  }
  std::vector<std::string> panoramas;
  for (const capture::Photo& photo : photos.photos) {
    panoramas.push_back(photo.face ? photo.face->panorama : "");
  }
  return ChooseHeldOutPanoramas(spec, NamesOf(photos), panoramas);
}

// The frames of a video, chosen once, and the views of panoramas: a later run of the same build
// finds them in `folder`.
capture::Capture FramesOf(const BuildOptions& options, const std::filesystem::path& folder,
                          bool is_shared, Progress& progress) {
  const std::filesystem::path kept = folder / "capture", fresh = folder / "frames";
  if (!std::filesystem::exists(kept / capture::kCaptureFile)) {
    if (is_shared) {
      throw Error(kept.string() +
                  ": expected the frames that the stage capture chooses, found none; run that "
                  "stage first");
    }
    capture::VideoOptions video = options.video;
    video.threads = options.threads;
    video.memory_gb = options.depth.memory_gb.value_or(kDefaultMemoryGb);
    const capture::Capture frames = Ingest(
        options.photos, video, options.panoramas, [&] { return fresh; }, progress);
    capture::WriteCapture(
        frames, kept, {.replace = false, .threads = options.threads, .memory_gb = video.memory_gb},
        progress);
    std::filesystem::remove_all(fresh);
  }
  return capture::ReadCapture(kept);
}

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

// Photos that are there twice add nothing, and would show what is held out. Given places say that
// they are photos of their own; those of a rig belong to its time steps.
void LeaveOutSameImages(const BuildOptions& options, capture::Capture& photos, Progress& progress) {
  if (options.keep_duplicates || !options.poses.empty() || !options.rig.empty()) return;
  const auto left_out = capture::DropSameImages(
      photos, [&](const std::string& name) { return IsNamed(options.holdout, name); });
  for (const auto& [name, same_as] : left_out) {
    progress.Note(name + " left out: it has the same pixels as " + same_as);
  }
}

// Of the cameras and of the lists that their reader takes in.
std::string PosesHash(const std::filesystem::path& poses) {
  const std::vector<std::filesystem::path> files = WithCompanions(poses);
  return files.size() > 1 ? InputHash(files) : InputHash(poses);
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
                       double memory_gb, BuildReport& report, int threads, Progress& progress) {
  SetLimits limits;
  limits.memory_gb = std::min(limits.memory_gb, memory_gb);
  SetValidation validation = ValidateSet(folder, set, sparse, limits, threads, progress);
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
void AdviseOn(const std::filesystem::path& folder, DtrSet set, BuildReport& report, int threads,
              Progress& progress) {
  io::CollapseDuplicates(set);
  const auto views = CoarseViewsOf(folder, set, threads, progress);
  if (views.size() < 2) return;
  advise::AdviseOptions options;
  options.threads = threads;
  report.coverage = AdviceLines(advise::Advise(views, options, progress));
}

// One line about what screening found, if it found anything.
void SayRemarks(const BuildReport& report, size_t photos, Progress& progress) {
  if (report.screening.empty()) return;
  const auto& [name, remarks] = report.screening.front();
  progress.Note(
      fmt::format("screening: {} of {} photos have a remark and are used, first {}: {}; "
                  "dtr capture `drop` leaves such photos out",
                  report.screening.size(), photos, name, remarks.front()));
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
  const bool from_video = !capture::VideosOf(options.photos).empty();
  bool is_derived = from_video;  // photos are made, in the work folder
  capture::Capture photos;
  std::vector<bool> held_out;
  const auto look = [&] {
    LeaveOutSameImages(options, photos, progress);
    capture::RequireEnoughPhotos(photos, options.photos);
    if (!options.poses.empty())
      TakePhotosAsCamerasDo(options.poses, options.poses_format, photos, progress);
    held_out = HeldOutOf(options.holdout, photos);
    if (options.poses.empty()) {
      if (auto panoramas = RigOfPanoramas(photos)) {
        RequirePanoramaOptions(options);
        rig = std::move(panoramas);
      }
    }
    RequireMetres(options.metres, photos, options.photos.string(),
                  options.holdout_strict ? held_out : std::vector<bool>());
    if (!rig) return;
    (void)PhotosOfRig(*rig, photos);  // rejected here, before any work
    if (!calib::HasOneCentre(rig->known)) TellPhotosTheirLens(*rig, photos);
  };
  if (!from_video) {
    photos = capture::IngestPhotos(options.photos,
                                   {.threads = options.threads, .memory_gb = memory_gb}, progress);
    is_derived = capture::ArePanoramas(photos, options.panoramas);
    if (is_derived && options.poses.empty()) RequirePanoramaOptions(options);
    if (!is_derived) look();
  }
  Json fingerprint = {
      {"tool_version", DTR_VERSION},
      {"options", OptionsJson(options, quality)},
      {"time_budget_s", options.depth.time_budget_s.value_or(0)},
      {"photos", from_video ? VideoJson(options)
                            : PhotosJson(photos, std::vector<bool>(photos.photos.size(), true))},
      {"poses_sha256", PosesHash(options.poses)},
      {"workspace_sha256", InputHash(options.depth.workspace)},
      {"prior_sha256", InputHash(options.depth.prior.folder)}};
  if (!options.rig.empty()) fingerprint["rig_sha256"] = InputHash(options.rig);
  if (options.panoramas != capture::PanoramaUse::kAuto) {
    fingerprint["panoramas"] = options.panoramas == capture::PanoramaUse::kAlways;
  }
  if (std::filesystem::exists(options.photos / capture::kCaptureFile)) {
    fingerprint["stored_sha256"] = StoredHashes(photos);
  }
  if (NeedsFeatures(options.poses, options.poses_format)) {
    // COLMAP looks for features, of a size that is the one thing --memory decides of the result.
    const auto sizes = SizesOf(options, photos, held_out);
    if (!sizes.empty()) {
      fingerprint["feature_image_size_px"] =
          FeatureImageSizePx(sizes, memory_gb, options.sfm.feature_size_px);
    }
  }
  const std::string before_depth = BeforeDepth(options, fingerprint).dump();
  if (!options.part) io::HandOver(options.output, before_depth, fingerprint.dump());
  io::SetWriter writer = share.OpenWriter(options, fingerprint.dump());
  share.Lock(writer.work_folder());
  if (!options.force_stage.empty()) ForgetStage(writer.folder(), options.force_stage);
  if (is_derived) {
    photos = FramesOf(options, writer.work_folder(), share.is_shared(), progress);
    try {
      look();
    } catch (const Error&) {
      // What was asked for cannot be had of these frames: nothing goes on from here, and the
      // command that is mended must not find this one's work in its way.
      if (!std::filesystem::exists(writer.work_folder() / "calibration")) writer.Discard();
      throw;
    }
  }
  report.contents = photos.contents;
  for (const auto& skipped : photos.skipped)
    report.skipped.emplace_back(skipped.name, skipped.reason);
  for (const auto& remark : photos.remarks) {
    report.remarks.emplace_back(remark.name, remark.text);
    progress.Note(fmt::format("{}: {}", remark.name, remark.text));
  }
  for (const capture::Photo& photo : photos.photos) {
    if (!photo.screening || photo.screening->remarks.empty()) continue;
    report.screening.emplace_back(photo.name, photo.screening->remarks);
  }
  SayRemarks(report, photos.photos.size(), progress);
  std::vector<bool> is_source = held_out;
  is_source.flip();

  log.Begin("calibration");
  CalibrateOptions calibrate;
  calibrate.poses = options.poses;
  calibrate.poses_format = options.poses_format;
  calibrate.held_out = held_out;
  calibrate.strict = options.holdout_strict;
  calibrate.threads = options.threads;
  calibrate.seed = options.seed;
  calibrate.memory_gb = memory_gb;
  calibrate.refine = options.refine;
  calibrate.refine_poses = options.refine_poses;
  calibrate.rig = rig;
  calibrate.metres = options.metres;
  calibrate.sfm = options.sfm;
  calibrate.part = share.Sfm();
  const CalibratedPhotos calibrated =
      CamerasOf(photos, calibrate, share, writer.work_folder(), progress);
  log.AddEarlier(calibrated.earlier_wall_s, calibrated.earlier_cpu_s);
  // Features know what their parts took.
  AddParts(writer.work_folder(), {"matching", "verification"}, log);
  report.not_registered = calibrated.not_registered;
  report.why_not_registered = calibrated.why_not_registered;
  for (size_t i = 0; i < held_out.size(); ++i) {
    const auto& lost = report.not_registered;
    if (held_out[i] && std::find(lost.begin(), lost.end(), photos.photos[i].name) != lost.end()) {
      report.held_out_not_registered.push_back(photos.photos[i].name);
    }
  }

  log.Begin("undistortion");
  AddParts(writer.work_folder(), {"undistortion"}, log);
  DtrSet set;
  set.unit = calibrated.unit;
  set.world_origin = calibrated.world_origin;
  set.frames.resize(1);
  std::vector<View>& views = set.frames.front().views;
  RequireTwoSources(photos, held_out, calibrated);
  views = UndistortPhotos(photos, calibrated, held_out,
                          {options.max_size_px, options.threads, share.Undistortion()}, writer,
                          progress);
  share.EndAfter("undistortion");
  if (share.is_shared()) RequireImages(views, writer);
  const SparseScene sparse = SparseOf(calibrated, views);

  log.Begin("depth");
  AddParts(writer.work_folder(), {"ranges", "search", "pass", "maps"}, log);
  DepthStageOptions depth_options;
  depth_options.threads = options.threads;
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
  FinishScene(set, SourcePoints(sparse, views), writer, options.threads, progress);
  if (options.depth.depth_error_px) {
    RecodeDepth(set, *options.depth.depth_error_px, writer, options.threads, memory_gb, progress);
  }
  if (options.depth.completion) {
    CompleteDepth(set, sparse, writer, options.threads, memory_gb, progress);
  }
  WriteMeshes(set, writer, options.threads, progress);
  set.provenance_json = ProvenanceJson(options, OptionsJson(options, stage.quality),
                                       PhotosJson(photos, is_source), calibrated, report)
                            .dump();
  const SetValidation validation =
      Validate(writer.folder(), set, sparse, memory_gb, report, options.threads, progress);
  writer.WriteSparse(set, sparse);
  WriteSetPage(writer, set,
               {.name = options.output.stem().string(),
                .engine = options.depth.engine,
                .checks = validation.tests,
                .skipped = report.skipped,
                .not_registered = report.not_registered.size(),
                .prior = report.prior,
                .threads = options.threads},
               progress);
  AdviseOn(writer.folder(), set, report, options.threads, progress);
  log.End();
  std::vector<std::string> lines = progress.lines();
  lines.insert(lines.end(), report.coverage.begin(), report.coverage.end());
  io::WriteRunRecord(writer.folder(), log.Record(ResolveThreads(options.threads), std::move(lines)),
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
