#include "pipeline/build/detail/build_json.h"

#include <nlohmann/json.hpp>

#include "capture/contents_json.h"
#include "pipeline/core/depth/quality_json.h"
#include "pipeline/core/photos/lens_of_photo.h"
#include "pipeline/core/reports/calibration_json.h"
#include "pipeline/core/reports/metres_json.h"
#include "pipeline/core/reports/prior_json.h"
#include "pipeline/core/reports/text.h"

namespace dtr::pipeline {
namespace {

using Json = nlohmann::ordered_json;

Json JsonOf(const SfmChoice& choice) {
  Json json{{"feature_size_px", choice.feature_size_px},
            {"features", choice.features},
            {"matching", sfm::NameOf(choice.matching)},
            {"lens_model", choice.lens_model},
            {"engine", sfm::NameOf(choice.engine)}};
  // Builds that were begun before there was a choice go on.
  if (choice.camera_per != CameraPer::kAuto) json["camera_per"] = NameOf(choice.camera_per);
  return json;
}

}  // namespace

Json OptionsJson(const BuildOptions& options, const stereo::QualitySettings& quality) {
  Json json = SettingsJson(options.depth.engine, quality);
  json["max_size_px"] = options.max_size_px;
  json["holdout"] = options.holdout;
  json["holdout_strict"] = options.holdout_strict;
  json["poses"] = options.poses.filename().string();
  json["refine"] = options.refine;
  if (options.refine_poses) json["refine_poses"] = true;
  if (options.keep_duplicates) json["keep_duplicates"] = true;
  if (!options.rig.empty()) json["rig"] = options.rig.filename().string();
  if (options.metres.any()) json["metres"] = JsonOf(options.metres);
  SfmChoice plain;
  plain.features = MaxFeaturesOf(plain.engine);
  if (options.sfm != plain) json["sfm"] = JsonOf(options.sfm);
  json["seed"] = options.seed;
  json["completion"] = options.depth.completion;
  if (options.depth.depth_error_px) json["depth_error_px"] = *options.depth.depth_error_px;
  if (options.depth.prior.given()) json["depth_prior"] = PriorJson(options.depth.prior);
  return json;
}

Json BeforeDepth(const BuildOptions& options, Json fingerprint) {
  BuildOptions any = options;
  any.depth = {};
  fingerprint["options"] = OptionsJson(any, QualityOf(any.depth));
  for (const char* key : {"time_budget_s", "workspace_sha256", "prior_sha256"}) {
    fingerprint.erase(key);
  }
  fingerprint["before_depth"] = true;
  return fingerprint;
}

Json ProvenanceJson(const BuildOptions& options, const Json& option_values, const Json& photos,
                    const CalibratedPhotos& calibrated, const BuildReport& report) {
  Json provenance;
  provenance["tool"] = "dtr";
  provenance["tool_version"] = DTR_VERSION;
  provenance["calibration"] = JsonOf(calibrated.report);
  provenance["calibration"]["engine"] = calibrated.engine;
  if (const auto& adjusted = calibrated.report.bundle_adjustment; adjusted && adjusted->metres) {
    provenance["scale"] = Json::array({JsonOf(*adjusted->metres)});
  }
  provenance["depth_engine"] = options.depth.engine;
  if (report.prior) provenance["depth_prior"] = JsonOf(*report.prior);
  provenance["options"] = option_values;
  provenance["photos"] = photos;
  AddLenses(calibrated.model, provenance);
  provenance["not_registered"] = report.not_registered;
  provenance["held_out_not_registered"] = report.held_out_not_registered;
  provenance["skipped"] = Json::array();
  for (const auto& [name, reason] : report.skipped) {
    provenance["skipped"].push_back({{"name", name}, {"reason", reason}});
  }
  return provenance;
}

Json ScreeningJson(const BuildReport& report) {
  Json json = Json::array();
  for (const auto& [name, remarks] : report.screening) {
    json.push_back({{"name", name}, {"remarks", remarks}});
  }
  return json;
}

std::string ToJson(const BuildReport& report) {
  Json json;
  json["set"] = report.written.string();
  json["views"] = Json::array();
  for (const View& view : report.set.frames.front().views) {
    json["views"].push_back({{"name", view.name},
                             {"role", NameOf(view.role)},
                             {"width_px", view.camera.width_px()},
                             {"height_px", view.camera.height_px()}});
  }
  json["not_registered"] = report.not_registered;
  json["why_not_registered"] = report.why_not_registered;
  json["skipped"] = Json::array();
  for (const auto& [name, reason] : report.skipped) {
    json["skipped"].push_back({{"name", name}, {"reason", reason}});
  }
  json["remarks"] = Json::array();
  for (const auto& [name, text] : report.remarks) {
    json["remarks"].push_back({{"name", name}, {"text", text}});
  }
  json["contents"] = capture::JsonOf(report.contents);
  json["screening"] = ScreeningJson(report);
  if (const auto& sharing = report.calibration.camera_sharing) {
    json["camera_sharing"] = JsonOf(*sharing);
  }
  json["coverage"] = report.coverage;
  json["validation_passed"] = report.validated ? Json(report.validation_passed) : Json(nullptr);
  if (report.prior) json["depth_prior"] = JsonOf(*report.prior);
  json["stages"] = Json::array();
  for (const io::RunStage& stage : report.stages) {
    json["stages"].push_back(
        {{"name", stage.name}, {"wall_s", stage.wall_s}, {"cpu_s", stage.cpu_s}});
  }
  json["peak_memory_mib"] = report.peak_memory_mib;
  return Text(json);
}

}  // namespace dtr::pipeline
