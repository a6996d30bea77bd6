#include "pipeline/core/calibrate.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "calib/colmap/model_io.h"
#include "calib/colmap/program.h"
#include "calib/colmap/steps.h"
#include "calib/models/fisheye.h"
#include "calib/sfm/run/feature_plan.h"
#include "calib/sfm/run/sfm.h"
#include "capture/contents_json.h"
#include "capture/image_circle.h"
#include "capture/sfm_images.h"
#include "dtr/base/error.h"
#include "dtr/types/panorama.h"
#include "pipeline/core/camera_file.h"
#include "pipeline/core/cameras/camera_formats.h"
#include "pipeline/core/cameras/exif_focal.h"
#include "pipeline/core/cameras/known_poses.h"
#include "pipeline/core/cameras/panorama_poses.h"
#include "pipeline/core/photos/known_lens.h"
#include "pipeline/core/reports/calibration_json.h"
#include "pipeline/core/reports/text.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

// The photos with `wanted[i]`, in their order.
capture::Capture Subset(const capture::Capture& capture, const std::vector<bool>& wanted) {
  capture::Capture subset;
  for (size_t i = 0; i < capture.photos.size(); ++i) {
    if (wanted[i]) subset.photos.push_back(capture.photos[i]);
  }
  return subset;
}

SfmSummary SummaryOf(const sfm::SfmReport& report, const calib::SfmModel& model) {
  return {.mean_reprojection_error_px = report.mean_reprojection_error_px,
          .images_per_model = report.images_per_model,
          .lack_of_parallax = report.lack_of_parallax,
          .forward_motion = report.forward_motion,
          .doubt = report.doubt,
          .feature_image_size_px = report.max_image_size_px,
          .lens_model =
              model.cameras.empty() ? "" : calib::NameOf(model.cameras.begin()->second.model)};
}

CalibratedPhotos FromSfm(const capture::Capture& capture, const CalibrateOptions& options,
                         const fs::path& workspace, const std::optional<sfm::SfmPart>& part,
                         Progress& progress) {
  std::vector<bool> in_sfm(capture.photos.size(), true);
  if (options.strict) {
    for (size_t i = 0; i < in_sfm.size(); ++i) in_sfm[i] = !options.held_out[i];
  }
  const capture::Capture photos = Subset(capture, in_sfm);
  const CameraGroups groups(photos.photos, options.sfm.camera_per, options.rig || options.lens);
  std::vector<sfm::SfmImageInput> inputs = SfmInputs(photos, groups, workspace / "photos");
  for (sfm::SfmImageInput& input : inputs) {
    if (!options.lens) break;
    input.known_lens = LensFor(*options.lens, input.width_px, input.height_px, input.name);
  }
  sfm::SfmOptions sfm_options = SfmOptionsFor(options, part);
  if (options.lens) {
    sfm_options.intrinsics_are_known = true;
    sfm_options.lens_model = calib::NameOf(options.lens->model);
  }
  const bool panoramas = options.rig && calib::HasOneCentre(options.rig->known);
  if (panoramas) {
    sfm_options.intrinsics_are_known = true;
    sfm_options.lens_model = calib::NameOf(calib::CameraModel::kSimplePinhole);
  }
  PreparePhotos(photos, options, part, workspace / "photos", progress);
  sfm::SfmResult sfm =
      sfm::RunSfm(workspace / "photos", inputs, workspace / "sfm", sfm_options, progress, part);
  if (part) return {};
  if (panoramas) {
    CompletePanoramas(photos, *options.rig, inputs, workspace, sfm_options, sfm, progress);
  }
  PhotoRefinement refined = RefineSfm({.capture = capture,
                                       .options = options,
                                       .groups = groups,
                                       .inputs = inputs,
                                       .sfm_options = sfm_options,
                                       .workspace = workspace},
                                      sfm, progress);
  CalibratedPhotos calibrated;
  calibrated.engine = sfm.report.version;
  calibrated.why_not_registered = sfm.report.why_not_registered;
  for (const sfm::StepRecord& step : sfm.report.steps) {
    // COLMAP's runs are no time of this process, nor are own steps that an earlier one did.
    if (!step.argv.empty() || step.from_checkpoint) calibrated.engine_cpu_s += step.cpu_s;
    if (!step.from_checkpoint) continue;
    calibrated.earlier_cpu_s += step.cpu_s;
    calibrated.earlier_wall_s += step.wall_s;
  }
  calibrated.report = std::move(refined.report);
  calibrated.report.sfm = SummaryOf(sfm.report, sfm.model);
  calibrated.report.points = sfm.model.points.size();
  calibrated.kept_refinement_cpu_s = refined.earlier_cpu_s;
  calibrated.earlier_cpu_s += refined.earlier_cpu_s;
  calibrated.earlier_wall_s += refined.earlier_wall_s;
  calibrated.model = std::move(refined.model);
  calibrated.unit = refined.unit;
  if (options.strict) {
    RegisterHeldOutPhotos(Subset(capture, options.held_out), inputs, groups, workspace, sfm_options,
                          panoramas ? &*options.rig : nullptr, calibrated.model, progress);
  }
  return calibrated;
}

// Photos of a fisheye that nobody said to be of one: a line before hours of work.
void HintAtFisheye(const capture::Capture& capture, const CalibrateOptions& options,
                   Progress& progress) {
  const auto model = calib::CameraModelFromName(options.sfm.lens_model);
  if (!options.poses.empty() || options.rig || options.lens) return;
  if (model && calib::IsFisheye(*model)) return;
  const std::string line = capture::LineOfImageCircle(capture.photos);
  if (!line.empty()) progress.Note(line);
}

// Boards are looked at as their photos are stored (board_photos.h); turned upright a photo has its
// principal point elsewhere.
void RejectTurned(const capture::Capture& capture, const char* known) {
  for (const capture::Photo& photo : capture.photos) {
    if (!capture::IsTurned(photo)) continue;
    throw Error(fmt::format(
        "{}: expected a photo as it is stored, which {} of, found one that its EXIF orientation "
        "rotated; take the tag out of it (exiftool -Orientation= FILE)",
        photo.name, known));
  }
}

}  // namespace

std::string ToJson(const CalibratedPhotos& calibrated, const capture::FolderContents& contents) {
  nlohmann::ordered_json json = JsonOf(calibrated.report);
  json["engine"] = calibrated.engine;
  json["unit"] = NameOf(calibrated.unit);
  json["registered"] = calibrated.model.images.size();
  json["not_registered"] = calibrated.not_registered;
  json["why_not_registered"] = calibrated.why_not_registered;
  json["contents"] = capture::JsonOf(contents);
  return Text(json);
}

bool IsShared(const std::optional<sfm::SfmPart>& part) {
  using Stage = sfm::SfmStage;
  return part && part->stage != Stage::kPhotos && part->stage != Stage::kPairs;
}

void PreparePhotos(const capture::Capture& photos, const CalibrateOptions& options,
                   const std::optional<sfm::SfmPart>& part, const fs::path& folder,
                   Progress& progress) {
  if (IsShared(part)) return;  // other processes read them
  capture::PrepareSfmImages(photos, folder, 0, options.memory_gb, progress);
}

std::vector<sfm::SfmImageInput> SfmInputs(const capture::Capture& capture,
                                          const CameraGroups& groups, const fs::path& folder) {
  std::vector<sfm::SfmImageInput> inputs;
  for (const capture::Photo& photo : capture.photos) {
    inputs.push_back({photo.name, photo.width_px, photo.height_px, photo.focal_prior_px,
                      groups.GroupOf(photo), capture::SfmMaskFile(folder, photo),
                      photo.face ? photo.face->panorama : std::string()});
    if (photo.face) {
      inputs.back().cam_from_station = FaceCalled(photo.face->face).cam_from_panorama;
    }
  }
  return inputs;
}

sfm::SfmOptions SfmOptionsFor(const CalibrateOptions& options,
                              const std::optional<sfm::SfmPart>& part) {
  sfm::SfmOptions sfm;
  sfm.colmap = &colmap::kSteps;
  sfm.engine = options.sfm.engine;
  sfm.seed = options.seed;
  sfm.memory_gb = options.memory_gb;
  sfm.max_image_size_px = options.sfm.feature_size_px;
  const int max_features = MaxFeaturesOf(sfm.engine);
  sfm.max_features = options.sfm.features < max_features ? options.sfm.features : 0;
  sfm.matching = options.sfm.matching;
  sfm.lens_model = options.sfm.lens_model;
  sfm.folder_is_shared = IsShared(part);
  return sfm;
}

int FeatureImageSizePx(const std::vector<std::pair<int, int>>& sizes_px, double memory_gb,
                       int asked_px) {
  std::vector<sfm::SfmImageInput> images;
  for (const auto& [width_px, height_px] : sizes_px) {
    images.push_back({"", width_px, height_px, {}, "", {}});
  }
  return sfm::PlanExtraction(images, memory_gb, asked_px).max_image_size_px;
}

bool NeedsFeatures(const fs::path& poses, const std::string& poses_format) {
  return !IsColmapModel(poses, poses_format) ||
         !HasSharedPoints(colmap::ReadModel(colmap::ModelFolderIn(poses)));
}

void RequireCalibration(const fs::path& poses, const std::string& poses_format,
                        const SfmChoice& sfm) {
  if (sfm.features > MaxFeaturesOf(sfm.engine)) {
    throw UsageError(
        fmt::format("`features` {}: expected at most {}, the limit of `sfm` {}; give fewer",
                    sfm.features, MaxFeaturesOf(sfm.engine), sfm::NameOf(sfm.engine)));
  }
  if (!poses.empty()) (void)FormatOf(poses, poses_format, "`poses`");
  if (sfm.engine == sfm::SfmEngine::kColmap && NeedsFeatures(poses, poses_format))
    (void)colmap::Program();
}

CalibratedPhotos CalibratePhotos(const capture::Capture& capture, const CalibrateOptions& options,
                                 const fs::path& workspace, Progress& progress,
                                 const std::optional<sfm::SfmPart>& part) {
  CalibrateOptions checked = options;
  if (!checked.rig && checked.poses.empty()) checked.rig = RigOfPanoramas(capture);
  checked.held_out.resize(capture.photos.size(), false);
  RequireCalibration(checked.poses, checked.poses_format, checked.sfm);
  if (checked.rig && !calib::HasOneCentre(checked.rig->known)) RejectTurned(capture, "the rig is");
  if (checked.lens) {
    RejectTurned(capture, "the intrinsics are");
    RequireLensOfPhotos(*checked.lens, capture, progress);
  }
  if (!IsShared(part)) HintAtFisheye(capture, checked, progress);
  fs::create_directories(workspace);
  CalibratedPhotos calibrated = checked.poses.empty()
                                    ? FromSfm(capture, checked, workspace, part, progress)
                                    : FromKnownPoses(capture, checked, workspace, part, progress);
  std::set<std::string> registered;
  for (const calib::SfmImage& image : calibrated.model.images) registered.insert(image.name);
  for (const capture::Photo& photo : capture.photos) {
    if (!registered.contains(photo.name)) calibrated.not_registered.push_back(photo.name);
  }
  return calibrated;
}

}  // namespace dtr::pipeline
