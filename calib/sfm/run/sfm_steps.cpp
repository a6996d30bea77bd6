#include "calib/sfm/run/sfm_steps.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "calib/sfm/run/colmap_steps.h"
#include "calib/sfm/run/own_steps.h"
#include "dtr/base/error.h"

namespace dtr::sfm {
namespace {

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

std::string VersionOf(const SfmOptions& options) {
  return options.engine == SfmEngine::kColmap ? options.colmap->Version() : kOwnVersion;
}

MatchSummary MatchedIn(const Workspace& workspace, const SfmOptions& options) {
  return options.engine == SfmEngine::kColmap ? options.colmap->Matched(workspace)
                                              : SummaryOf(workspace);
}

void FeaturesAndMatches(Workspace& workspace, const PhotosToMatch& photos,
                        const SfmOptions& options, SfmReport& report,
                        const std::optional<SfmPart>& part) {
  if (part && part->stage == SfmStage::kPhotos) return;  // the workspace has them
  ExtractionPlan plan =
      PlanExtraction(workspace.images(), options.memory_gb, options.max_image_size_px);
  plan.max_features = options.max_features;
  report.extraction_threads = plan.threads;
  report.max_image_size_px = plan.max_image_size_px;
  report.matching = ResolveMatching(options.matching, workspace.images().size());

  const bool by_colmap = options.engine == SfmEngine::kColmap;
  const bool features_alone = part && part->stage == SfmStage::kFeatures;
  std::string inputs = TextOf(photos.groups, plan, options.seed);
  if (!by_colmap) inputs += kStoreVersion;
  const auto find = [&] {
    by_colmap ? options.colmap->Extract(workspace, photos.groups, plan, options.seed)
              : OwnFeatures(workspace, photos.groups, plan, part);
  };
  workspace.Step("features", inputs, find, features_alone);
  if (features_alone) return;
  auto text = fmt::format("matching {} seed {}", static_cast<int>(report.matching), options.seed);
  if (photos.known_lenses && !by_colmap) text += " known lenses";
  for (const SfmImageInput& image : workspace.images()) {
    if (!image.station.empty()) text += " " + image.station;
  }
  if (photos.allowed) {
    for (const auto& [a, b] : *photos.allowed) text += fmt::format(" {}-{}", a, b);
  }
  const auto match = [&] {
    by_colmap ? options.colmap->Match(workspace, report.matching, options, photos.allowed)
              : OwnMatches(workspace, photos, report.matching, options, part);
  };
  workspace.Step("matches", text, match, part.has_value());
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

}  // namespace dtr::sfm
