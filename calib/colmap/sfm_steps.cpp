#include "calib/colmap/sfm_steps.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "calib/colmap/database.h"
#include "calib/colmap/matching.h"
#include "calib/colmap/own_steps.h"
#include "dtr/base/delete.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"

namespace dtr::colmap {
namespace fs = std::filesystem;
namespace {

constexpr std::uintmax_t kLargestStepNote = 1 << 12;

// What the features depend on beside the photos.
std::string TextOf(const std::vector<CameraGroup>& groups, const ExtractionPlan& plan,
                   std::uint64_t seed) {
  std::string text = fmt::format("size {} seed {}", plan.max_image_size_px, seed);
  if (plan.max_features > 0) text += fmt::format(" most {}", plan.max_features);
  for (const CameraGroup& group : groups) {
    text += fmt::format("\n{} [{}] of {}", calib::NameOf(group.model), ParamsText(group.params),
                        fmt::join(group.images, ","));
    if (group.camera_id) text += fmt::format(" camera {}", *group.camera_id);
  }
  return text;
}

}  // namespace

calib::CameraModel CameraModelOf(const SfmOptions& options) {
  const auto model = calib::CameraModelFromName(options.lens_model);
  if (!model) {
    throw UsageError("camera model: expected a name like SIMPLE_RADIAL, RADIAL or OPENCV, found '" +
                     options.lens_model + "'");
  }
  return *model;
}

void FeaturesAndMatches(Workspace& workspace, const PhotosToMatch& photos,
                        const SfmOptions& options, SfmReport& report,
                        const std::optional<SfmPart>& part) {
  if (part && part->stage == SfmStage::kPhotos) return;  // the workspace has them
  ExtractionPlan plan = PlanExtraction(workspace.images(), workspace.threads(), options.memory_gb,
                                       options.max_image_size_px);
  plan.max_features = options.max_features;
  report.extraction_threads = plan.threads;
  report.max_image_size_px = plan.max_image_size_px;
  report.matching = ResolveMatching(options.matching, workspace.images().size());

  const fs::path features = workspace.folder() / "features.db";
  const bool features_alone = part && part->stage == SfmStage::kFeatures;
  const auto find = [&] {
    if (options.engine == SfmEngine::kColmap) {
      ExtractFeaturesResumably(workspace, features, photos.groups, plan, options.seed);
    } else {
      OwnFeatures(workspace, features, photos.groups, plan, part);
    }
  };
  workspace.Step("features", TextOf(photos.groups, plan, options.seed), find, features_alone);
  if (features_alone) return;
  auto text = fmt::format("matching {} seed {}", static_cast<int>(report.matching), options.seed);
  if (photos.known_lenses && options.engine != SfmEngine::kColmap) text += " known lenses";
  for (const SfmImageInput& image : workspace.images()) {
    if (!image.station.empty()) text += " " + image.station;
  }
  if (photos.allowed) {
    for (const auto& [a, b] : *photos.allowed) text += fmt::format(" {}-{}", a, b);
  }
  const auto match = [&] {
    if (options.engine != SfmEngine::kColmap) {
      OwnMatches(workspace, features, photos, report.matching, options, part);
      return;
    }
    // Matching may take hours: an interrupted run of the same inputs goes on with its pairs.
    const fs::path begun = workspace.folder() / "matches.begun";
    const bool go_on = fs::exists(begun) && fs::exists(workspace.database()) &&
                       ReadFile(begun, kLargestStepNote) == workspace.fingerprint();
    if (!go_on) {
      RemoveTree(begun);
      CopyDatabase(features, workspace.database());
      WriteFileAtomically(begun, workspace.fingerprint());
    }
    MatchPhotos(workspace, workspace.database(), report.matching, options.memory_gb, options.seed,
                photos.allowed);
  };
  workspace.Step("matches", text, match, part.has_value());
}

void AllowForwardMotion(Arguments& arguments) {
  arguments.AddIfKnown({"Mapper.init_max_forward_motion"}, "1")
      .AddIfKnown({"Mapper.init_min_tri_angle"}, "2")
      .AddIfKnown({"Mapper.filter_min_tri_angle"}, "0.5")
      .AddIfKnown({"Mapper.abs_pose_min_num_inliers"}, std::to_string(kMinInliersForward));
}

void CompleteReport(const Workspace& workspace, const calib::SfmModel& model, SfmReport& report) {
  const SfmReport runs = workspace.Report();
  report.version = runs.version;
  report.steps = runs.steps;
  std::set<std::string> registered;
  for (const calib::SfmImage& image : model.images) registered.insert(image.name);
  report.not_registered.clear();
  for (const SfmImageInput& image : workspace.images()) {
    if (!registered.contains(image.name)) report.not_registered.push_back(image.name);
  }
  report.mean_reprojection_error_px = MeanReprojectionErrorPx(model);
  WriteReport(workspace.folder(), report);
}

double MeanReprojectionErrorPx(const calib::SfmModel& model) {
  double sum = 0;
  std::int64_t count = 0;
  for (const calib::SfmImage& image : model.images) {
    const calib::LensCamera& camera = model.cameras.at(image.camera_id);
    for (const calib::SfmFeature& feature : image.features) {
      if (feature.point_id == calib::SfmFeature::kNoPoint) continue;
      const auto& p_in_world = model.points.at(feature.point_id).p_in_world;
      const auto pixel = camera.PixelFromCam(image.cam_from_world * p_in_world);
      if (!pixel) continue;  // behind its camera: COLMAP drops such observations, imports may not
      sum += (*pixel - feature.pixel).norm();
      ++count;
    }
  }
  return count > 0 ? sum / static_cast<double>(count) : 0;
}

}  // namespace dtr::colmap
