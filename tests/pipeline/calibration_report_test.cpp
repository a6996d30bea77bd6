// What a set's provenance keeps of its calibration: names are an interface, and a checkpoint gives
// every number back.
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "pipeline/core/reports/calibration_json.h"
#include "pipeline/core/reports/metres_json.h"

namespace dtr::pipeline {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kThird = 1.0 / 3;  // takes all digits of a double

CameraSharing SharingOfFolders() {
  CameraSharing sharing{.camera_per = CameraPer::kFolder, .tests = {}};
  FolderSharing& tested = sharing.tests.emplace().emplace_back();
  tested.photos = 7;
  tested.folders = {"a", "b"};
  tested.cameras = {{.folders = {"a"}, .focal_px = 420.5}, {.folders = {"b"}, .focal_px = kThird}};
  tested.shared_px = kThird;
  tested.separate_px = 0.25;
  tested.low_px2 = -0.5;
  tested.high_px2 = kNaN;
  tested.shared_converged = true;
  FolderSharing& untested = sharing.tests->emplace_back();
  untested.photos = 2;
  untested.folders = {"."};
  untested.not_tested = "too few photos";
  return sharing;
}

calib::RefineReport Adjusted() {
  calib::RefineReport report;
  report.changed = true;
  report.lens = calib::LensFreedom::kTangential;
  report.held_out_observations = 100;
  report.given_px = kThird;
  report.adjusted_px = kNaN;
  report.candidates.resize(2);
  report.candidates[0].name = "as given";
  report.candidates[0].held_out_px = kThird;
  report.candidates[1].name = calib::NameOf(calib::LensFreedom::kTangential);
  report.candidates[1].low_px2 = -kThird;
  report.candidates[1].converged = true;
  report.solve.sigma_px = 0.125;
  report.solve.rms_px = kThird;
  report.solve.iterations = 12;
  report.solve.converged = true;
  report.solve.unsettled = 3;
  report.points_dropped = 4;
  return report;
}

MetreReport InMetres() {
  MetreReport report;
  report.metres_per_unit = kThird;
  report.relative_sigma = 0.01;
  PositionsReport& positions = report.positions.emplace();
  positions.photos = 9;
  positions.left_out = {"3.jpg"};
  positions.given_rms_m = kThird;
  positions.found_sigma_up_m = 0.5;
  positions.determine_scale = false;
  positions.relative_sigma = kNaN;
  positions.passes = 2;
  positions.settled = false;
  positions.turn_sigma_deg = kThird;
  positions.origin = {.latitude_deg = 47.1, .longitude_deg = kThird, .altitude_m = 400.5};
  report.distances = {
      {.text = "a,b=1m", .length_m = 1, .given_m = 1.5, .found_m = kThird, .sigmas_off = kNaN}};
  return report;
}

SetRig RigOfTwo() {
  SetRig rig;
  rig.file = "rig.json";
  rig.unit = LengthUnit::kMetre;
  rig.names = {"left", "right"};
  rig.known.cam_from_rig.resize(2);
  rig.known.cam_from_rig[1].translation = {-0.5, 0, 0};
  return rig;
}

void ExpectBack(const CalibrationReport& report, const std::optional<SetRig>& rig = {}) {
  const auto json = RefinementJson(report);
  const std::string text = json.dump();
  EXPECT_EQ(RefinementJson(RefinementFrom(nlohmann::ordered_json::parse(text), rig)).dump(), text);
}

TEST(CalibrationReport, ComesBackFromACheckpointToTheLastBit) {
  ExpectBack({});
  CalibrationReport report;
  report.camera_sharing = SharingOfFolders();
  report.bundle_adjustment = {.refined = Adjusted(), .metres = InMetres()};
  ExpectBack(report);
  report.bundle_adjustment->metres->positions.reset();
  ExpectBack(report);
  report.bundle_adjustment->metres.reset();
  report.bundle_adjustment->refined = {};
  report.bundle_adjustment->refined.reason = "fewer than 3 images: nothing can be held out";
  report.camera_sharing->tests.reset();
  ExpectBack(report);
  report = {};
  report.rig.emplace();
  report.rig->adjusted.scale = kThird;
  report.rig->adjusted.frames = 5;
  report.rig->adjusted.solve.rms_px = kNaN;
  report.rig->rig = RigOfTwo();
  ExpectBack(report, RigOfTwo());
}

TEST(CalibrationReport, AMissingFieldOfACheckpointThrows) {
  CalibrationReport report;
  report.bundle_adjustment = {.refined = Adjusted(), .metres = InMetres()};
  auto json = RefinementJson(report);
  json["bundle_adjustment"].erase("rms_px");
  EXPECT_THROW((void)RefinementFrom(json, {}), nlohmann::json::exception);
}

TEST(CalibrationReport, FieldsKeepTheirNamesAndOrder) {
  CalibrationReport report;
  report.points = 12;
  EXPECT_EQ(JsonOf(report).dump(), R"({"points":12})") << "cameras that were given";
  report.sfm = SfmSummary{.mean_reprojection_error_px = 0.5,
                          .images_per_model = {8, 2},
                          .lack_of_parallax = {},
                          .forward_motion = true,
                          .doubt = {},
                          .feature_image_size_px = 3200,
                          .lens_model = "RADIAL"};
  report.rig.emplace();
  report.rig->rig = RigOfTwo();
  report.exif_focal = ExifFocal{.exif_px = 500, .found_px = 700, .exif_taken = true};
  EXPECT_EQ(
      JsonOf(report).dump(),
      R"({"mean_reprojection_error_px":0.5,"images_per_model":[8,2],"forward_motion":true,)"
      R"("feature_image_size_px":3200,"points":12,"lens_model":"RADIAL",)"
      R"("rig":{"scale":1.0,"scale_spread":0.0,"frames":0,"pairs":0,"free_sigma_px":0.0,)"
      R"("sigma_px":0.0,"rms_px":0.0,"iterations":0,"points_dropped":0,"file":"rig.json",)"
      R"("unit":"metre","cameras":[)"
      R"({"name":"left","cam_from_rig":[[1.0,0.0,0.0,0.0],[0.0,1.0,0.0,0.0],[0.0,0.0,1.0,0.0]]},)"
      R"({"name":"right",)"
      R"("cam_from_rig":[[1.0,0.0,0.0,-0.5],[0.0,1.0,0.0,0.0],[0.0,0.0,1.0,0.0]]}]},)"
      R"("exif_focal":{"exif_px":500.0,"found_px":700.0,"taken":"exif","focal_fixed":false}})");
}

TEST(MetreReport, SaysWhatWasMeasuredAndWhatWasFound) {
  EXPECT_EQ(JsonOf(InMetres()).dump(),
            R"({"metres_per_unit":0.3333333333333333,"relative_sigma":0.01,)"
            R"("method":"gps and distance","bundle_adjustment":true,"photos":9,)"
            R"("left_out":["3.jpg"],"given_rms_m":0.3333333333333333,"rms_m":0.0,)"
            R"("found_sigma_flat_m":null,"found_sigma_up_m":0.5,"places_tell_scale":false,)"
            R"("places_relative_sigma":null,"passes":2,"settled":false,)"
            R"("turn_sigma_deg":0.3333333333333333,"axes":"east, north, up",)"
            R"("origin":{"latitude_deg":47.1,"longitude_deg":0.3333333333333333,)"
            R"("altitude_m":400.5},"distances":[{"text":"a,b=1m","length_m":1.0,"given_m":1.5,)"
            R"("found_m":0.3333333333333333,"sigmas_off":null}]})");
}

}  // namespace
}  // namespace dtr::pipeline
