#include "pipeline/core/reports/calibration_json.h"

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "calib/bundle/bundle_json.h"
#include "dtr/base/json_number.h"
#include "pipeline/core/reports/metres_json.h"

namespace dtr::pipeline {
namespace {

using Json = nlohmann::ordered_json;

Json JsonOf(const FolderSharing& sharing) {
  Json json{{"photos", sharing.photos}, {"folders", sharing.folders}, {"cameras", Json::array()}};
  for (const FolderSharing::Camera& camera : sharing.cameras) {
    json["cameras"].push_back({{"folders", camera.folders}, {"focal_px", camera.focal_px}});
  }
  if (!sharing.not_tested.empty()) {
    json["not_tested"] = sharing.not_tested;
    return json;
  }
  json["shared_px"] = sharing.shared_px;
  json["separate_px"] = sharing.separate_px;
  json["low_px2"] = sharing.low_px2;
  json["high_px2"] = sharing.high_px2;
  json["shared_converged"] = sharing.shared_converged;
  return json;
}

FolderSharing FolderSharingFrom(const Json& json) {
  FolderSharing sharing;
  sharing.photos = json.at("photos").get<int>();
  sharing.folders = json.at("folders").get<std::vector<std::string>>();
  for (const Json& camera : json.at("cameras")) {
    sharing.cameras.push_back({.folders = camera.at("folders").get<std::vector<std::string>>(),
                               .focal_px = NumberOrNan(camera.at("focal_px"))});
  }
  sharing.not_tested = json.value("not_tested", "");
  if (!sharing.not_tested.empty()) return sharing;
  sharing.shared_px = NumberOrNan(json.at("shared_px"));
  sharing.separate_px = NumberOrNan(json.at("separate_px"));
  sharing.low_px2 = NumberOrNan(json.at("low_px2"));
  sharing.high_px2 = NumberOrNan(json.at("high_px2"));
  sharing.shared_converged = json.at("shared_converged").get<bool>();
  return sharing;
}

CameraSharing CameraSharingFrom(const Json& json) {
  CameraSharing sharing;
  const std::string name = json.at("camera_per").get<std::string>();
  for (const CameraPer per : {CameraPer::kFolder, CameraPer::kPhoto, CameraPer::kSet}) {
    if (name == NameOf(per)) sharing.camera_per = per;
  }
  if (!json.contains("tests")) return sharing;
  sharing.tests.emplace();
  for (const Json& test : json["tests"]) sharing.tests->push_back(FolderSharingFrom(test));
  return sharing;
}

Json PoseJson(const Pose& pose) {
  const Eigen::Matrix3d r = pose.rotation.toRotationMatrix();
  Json rows = Json::array();
  for (int i = 0; i < 3; ++i) rows.push_back({r(i, 0), r(i, 1), r(i, 2), pose.translation[i]});
  return rows;
}

Json JsonOf(const RigPlacement& placement) {
  Json json = calib::JsonOf(placement.adjusted);
  const SetRig& rig = placement.rig;
  json["file"] = rig.file;
  json["unit"] = NameOf(rig.unit);
  json["cameras"] = Json::array();
  for (size_t c = 0; c < rig.names.size(); ++c) {
    json["cameras"].push_back(
        {{"name", rig.names[c]}, {"cam_from_rig", PoseJson(rig.known.cam_from_rig[c])}});
  }
  return json;
}

Json JsonOf(const BundleAdjustment& adjustment) {
  Json json = calib::JsonOf(adjustment.refined);
  if (!adjustment.metres) return json;
  json["unit"] = NameOf(LengthUnit::kMetre);
  json["scale"] = JsonOf(*adjustment.metres);
  return json;
}

BundleAdjustment BundleAdjustmentFrom(const Json& json) {
  BundleAdjustment adjustment;
  adjustment.refined = calib::RefineReportFrom(json);
  if (json.contains("scale")) adjustment.metres = MetreReportFrom(json["scale"]);
  return adjustment;
}

Json JsonOf(const ExifFocal& focal) {
  Json json{{"exif_px", focal.exif_px}};
  if (focal.found_px) json["found_px"] = *focal.found_px;
  if (focal.exif_error_px) json["exif_error_px"] = *focal.exif_error_px;
  if (focal.found_error_px) json["found_error_px"] = *focal.found_error_px;
  json["taken"] = focal.exif_taken ? "exif" : "found";
  json["focal_fixed"] = focal.focal_fixed;
  return json;
}

}  // namespace

Json JsonOf(const CameraSharing& sharing) {
  Json json{{"camera_per", NameOf(sharing.camera_per)}};
  if (!sharing.tests) return json;
  json["tests"] = Json::array();
  for (const FolderSharing& test : *sharing.tests) json["tests"].push_back(JsonOf(test));
  return json;
}

Json JsonOf(const calib::ConventionReport& report) {
  Json json{{"pairs", report.pairs},
            {"matches", report.matches},
            {"residual_px", report.tested() ? Json(report.given_px) : Json()},
            {"limit_px", report.limit_px},
            {"fits", report.fits()},
            {"found", Json::array()}};
  for (const calib::Convention& convention : report.found) {
    json["found"].push_back({{"name", convention.name},
                             {"advice", convention.advice},
                             {"residual_px", convention.residual_px}});
  }
  return json;
}

Json RefinementJson(const CalibrationReport& report) {
  Json json = Json::object();
  if (report.rig) json["rig"] = JsonOf(*report.rig);
  if (report.camera_sharing) json["camera_sharing"] = JsonOf(*report.camera_sharing);
  if (report.bundle_adjustment) json["bundle_adjustment"] = JsonOf(*report.bundle_adjustment);
  return json;
}

CalibrationReport RefinementFrom(const Json& json, const std::optional<SetRig>& rig) {
  CalibrationReport report;
  if (json.contains("rig")) {
    report.rig = {.adjusted = calib::RigReportFrom(json["rig"]), .rig = rig.value()};
  }
  if (json.contains("camera_sharing")) {
    report.camera_sharing = CameraSharingFrom(json["camera_sharing"]);
  }
  if (json.contains("bundle_adjustment")) {
    report.bundle_adjustment = BundleAdjustmentFrom(json["bundle_adjustment"]);
  }
  return report;
}

Json JsonOf(const CalibrationReport& report) {
  Json json;
  if (const auto& sfm = report.sfm) {
    json["mean_reprojection_error_px"] = sfm->mean_reprojection_error_px;
    json["images_per_model"] = sfm->images_per_model;
    if (!sfm->lack_of_parallax.empty()) json["lack_of_parallax"] = sfm->lack_of_parallax;
    if (sfm->forward_motion) json["forward_motion"] = true;
    if (!sfm->doubt.empty()) json["doubt"] = sfm->doubt;
    json["feature_image_size_px"] = sfm->feature_image_size_px;
  }
  json["points"] = report.points;
  if (report.sfm) json["lens_model"] = report.sfm->lens_model;
  json.update(RefinementJson(report));
  if (report.exif_focal) json["exif_focal"] = JsonOf(*report.exif_focal);
  if (report.given_cameras) json["given_cameras"] = JsonOf(*report.given_cameras);
  return json;
}

std::string ToJson(const RefinedInMetres& refined) {
  const Json json = JsonOf(BundleAdjustment{.refined = refined.refined, .metres = refined.report});
  // On one line and with bytes of names that are no UTF-8 replaced, as calib::ToJson has it.
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace dtr::pipeline
