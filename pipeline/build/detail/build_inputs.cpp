#include "pipeline/build/detail/build_inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "capture/duplicates.h"
#include "capture/ingest.h"
#include "capture/store.h"
#include "capture/video/frames.h"
#include "dtr/base/delete.h"
#include "dtr/base/error.h"
#include "dtr/base/hash.h"
#include "pipeline/build/capture.h"
#include "pipeline/build/detail/build_json.h"
#include "pipeline/build/detail/build_options.h"
#include "pipeline/core/calibrate.h"
#include "pipeline/core/cameras/camera_formats.h"
#include "pipeline/core/model_grid.h"
#include "pipeline/core/photos/holdout.h"
#include "pipeline/core/photos/input_hash.h"

namespace dtr::pipeline {
namespace {

using Json = nlohmann::ordered_json;

std::vector<std::string> NamesOf(const capture::Capture& capture) {
  std::vector<std::string> names;
  for (const capture::Photo& photo : capture.photos) names.push_back(photo.name);
  return names;
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
    capture::VideoReader video(file, 0);  // it was decoded before, within the memory
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
    video.memory_gb = options.depth.memory_gb.value_or(kDefaultMemoryGb);
    const capture::Capture frames = Ingest(
        options.photos, video, options.panoramas, [&] { return fresh; }, progress);
    capture::WriteCapture(frames, kept, {.replace = false, .memory_gb = video.memory_gb}, progress);
    RemoveTree(fresh);
  }
  return capture::ReadCapture(kept);
}

// Photos that are there twice add nothing, and would show what is held out. Given places say that
// they are photos of their own; those of a rig belong to its time steps.
bool MayLeaveOutCopies(const BuildOptions& options) {
  return !options.keep_duplicates && options.poses.empty() && options.rig.empty();
}

void LeaveOutSameImages(const BuildOptions& options, capture::Capture& photos, Progress& progress) {
  if (!MayLeaveOutCopies(options)) return;
  const auto left_out = capture::DropSameImages(
      photos, [&](const std::string& name) { return IsNamed(options.holdout, name); });
  for (const auto& [name, same_as] : left_out) {
    progress.Note(name + " left out: it has the same pixels as " + same_as);
  }
}

// What shows a held-out photo again, smaller or compressed once more, would make figures too good.
void LeaveOutCopiesOfHeldOut(const BuildOptions& options, BuildInputs& inputs, Progress& progress) {
  const std::vector<capture::Photo>& photos = inputs.photos.photos;
  // Views of a panorama belong together.
  if (!MayLeaveOutCopies(options) || (!photos.empty() && photos.front().face)) return;
  for (const auto& [name, same_as] : capture::DropCopiesOf(inputs.held_out, inputs.photos)) {
    progress.Note(name + " left out: it shows the same image as the held-out photo " + same_as);
  }
  const auto sources = std::count(inputs.held_out.begin(), inputs.held_out.end(), false);
  if (sources >= 2) return;
  throw UsageError(fmt::format(
      "`holdout` {}: expected at least 2 photos to build from that show something else than "
      "held-out ones, found {}",
      options.holdout, sources));
}

// Of the cameras and of the lists that their reader takes in.
std::string PosesHash(const std::filesystem::path& poses) {
  const std::vector<std::filesystem::path> files = WithCompanions(poses);
  return files.size() > 1 ? InputHash(files) : InputHash(poses);
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

// What options say of photos, tested against these.
void TestPhotos(const BuildOptions& options, BuildInputs& inputs, Progress& progress) {
  capture::Capture& photos = inputs.photos;
  LeaveOutSameImages(options, photos, progress);
  capture::RequireEnoughPhotos(photos, options.photos);
  if (!options.poses.empty()) {
    TakePhotosAsCamerasDo(options.poses, options.poses_format, photos, progress);
  }
  inputs.held_out = HeldOutOf(options.holdout, photos);
  LeaveOutCopiesOfHeldOut(options, inputs, progress);
  if (options.poses.empty()) {
    if (auto panoramas = RigOfPanoramas(photos)) {
      RequirePanoramaOptions(options);
      inputs.rig = std::move(panoramas);
    }
  }
  RequireMetres(options.metres, photos, options.photos.string(),
                options.holdout_strict ? inputs.held_out : std::vector<bool>());
  if (!inputs.rig) return;
  (void)PhotosOfRig(*inputs.rig, photos);  // rejected here, before any work
  if (!calib::HasOneCentre(inputs.rig->known)) TellPhotosTheirLens(*inputs.rig, photos);
}

}  // namespace

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

BuildInputs LookAtInputs(const BuildOptions& options, std::optional<SetRig> rig, double memory_gb,
                         Progress& progress) {
  BuildInputs inputs;
  inputs.rig = std::move(rig);
  inputs.from_video = !capture::VideosOf(options.photos).empty();
  inputs.is_derived = inputs.from_video;
  if (inputs.from_video) return inputs;
  inputs.photos = capture::IngestPhotos(options.photos, {.memory_gb = memory_gb}, progress);
  inputs.is_derived = capture::ArePanoramas(inputs.photos, options.panoramas, &progress);
  if (inputs.is_derived && options.poses.empty()) RequirePanoramaOptions(options);
  if (!inputs.is_derived) TestPhotos(options, inputs, progress);
  return inputs;
}

Json FingerprintOf(const BuildOptions& options, const stereo::QualitySettings& quality,
                   const BuildInputs& inputs, double memory_gb) {
  const std::vector<bool> all(inputs.photos.photos.size(), true);
  Json fingerprint = {
      {"tool_version", DTR_VERSION},
      {"options", OptionsJson(options, quality)},
      {"time_budget_s", options.depth.time_budget_s.value_or(0)},
      {"photos", inputs.from_video ? VideoJson(options) : PhotosJson(inputs.photos, all)},
      {"poses_sha256", PosesHash(options.poses)},
      {"workspace_sha256", InputHash(options.depth.workspace)},
      {"prior_sha256", InputHash(options.depth.prior.folder)}};
  if (!options.rig.empty()) fingerprint["rig_sha256"] = InputHash(options.rig);
  if (options.panoramas != capture::PanoramaUse::kAuto) {
    fingerprint["panoramas"] = options.panoramas == capture::PanoramaUse::kAlways;
  }
  if (std::filesystem::exists(options.photos / capture::kCaptureFile)) {
    fingerprint["stored_sha256"] = StoredHashes(inputs.photos);
  }
  if (NeedsFeatures(options.poses, options.poses_format)) {
    // COLMAP looks for features, of a size that is the one thing --memory decides of the result.
    const auto sizes = SizesOf(options, inputs.photos, inputs.held_out);
    if (!sizes.empty()) {
      fingerprint["feature_image_size_px"] =
          FeatureImageSizePx(sizes, memory_gb, options.sfm.feature_size_px);
    }
  }
  return fingerprint;
}

void DerivePhotos(const BuildOptions& options, bool is_shared, io::SetWriter& writer,
                  BuildInputs& inputs, Progress& progress) {
  inputs.photos = FramesOf(options, writer.work_folder(), is_shared, progress);
  try {
    TestPhotos(options, inputs, progress);
  } catch (const Error&) {
    // What was asked for cannot be had of these frames: nothing goes on from here, and the
    // corrected command must not find this one's work in its way.
    if (!std::filesystem::exists(writer.work_folder() / "calibration")) writer.Discard();
    throw;
  }
}

void ReportPhotos(const capture::Capture& photos, BuildReport& report, Progress& progress) {
  report.contents = photos.contents;
  for (const auto& skipped : photos.skipped) {
    report.skipped.emplace_back(skipped.name, skipped.reason);
  }
  for (const auto& remark : photos.remarks) {
    report.remarks.emplace_back(remark.name, remark.text);
    progress.Note(fmt::format("{}: {}", remark.name, remark.text));
  }
  for (const capture::Photo& photo : photos.photos) {
    if (!photo.screening || photo.screening->remarks.empty()) continue;
    report.screening.emplace_back(photo.name, photo.screening->remarks);
  }
  SayRemarks(report, photos.photos.size(), progress);
}

}  // namespace dtr::pipeline
