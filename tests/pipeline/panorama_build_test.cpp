// A walk with 360 degree panoramas becomes a set, against the exact cameras.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>

#include "calib/similarity.h"
#include "capture/store.h"
#include "dtr/base/error.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/set_io.h"
#include "pipeline/build/build.h"
#include "pipeline/build/capture.h"
#include "pipeline/metres/scale.h"
#include "tests/cli/gps_photo.h"
#include "tests/pipeline/dataset_once.h"
#include "tests/support/message_of.h"
#include "tests/support/noted_lines.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;
using dtr::testing::MessageOf;
using dtr::testing::NotedLines;
using ::testing::Contains;
using ::testing::HasSubstr;

constexpr int kPanoramas = 6;
// Measured with 36 views of 244 px: 0.0004 m and 0.0003 rad; four times that.
constexpr double kMaxCentreError = 0.0016, kMaxTurnRad = 0.001;
// Of a panorama whose views are found one by one by points that others have: of 244 px each.
constexpr double kMaxRegisteredCentreError = 0.02, kMaxRegisteredTurnRad = 0.01;
constexpr double kMetresPerTrueUnit = 20;  // so that the digits of EXIF are enough

class PanoramaBuild : public dtr::testing::DatasetOnce {
 protected:
  static void SetUpTestSuite() {
    datasets::DatasetSpec spec = Scene("room", kPanoramas, 768);
    spec.panoramas = true;
    Make(spec, "walk");
  }
  static BuildOptions Options(const std::string& name) {
    BuildOptions options;
    options.photos = *folder_ / "walk/panoramas";
    options.output = *folder_ / (name + ".dtr");
    options.depth.engine = "none";
    options.sfm.engine = sfm::SfmEngine::kGlobal;
    return options;
  }
};

// Photos called as the panoramas, with the places of their centres in EXIF, 20 times as far apart.
void WriteLocated(const std::map<std::string, Pose>& true_pose, const fs::path& folder) {
  fs::create_directories(folder);
  Eigen::Vector3d corner = true_pose.begin()->second.TargetOriginInSource();
  for (const auto& [name, pose] : true_pose) corner = corner.cwiseMin(pose.TargetOriginInSource());
  for (const auto& [name, pose] : true_pose) {
    if (!name.starts_with("front/")) continue;
    dtr::testing::WritePhotoAt(folder / fs::path(name).filename(),
                               kMetresPerTrueUnit * (pose.TargetOriginInSource() - corner));
  }
}

TEST_F(PanoramaBuild, ViewsOfAPanoramaStandInOnePointWhereTheyAre) {
  BuildOptions options = Options("set");
  options.holdout = "0002";
  NotedLines lines;
  const BuildReport report = BuildSet(options, lines);
  EXPECT_THAT(lines.lines, Contains(HasSubstr("6 panoramas split into 36 views of 244 x 244 px")));
  EXPECT_TRUE(report.validation_passed) << report.set.validation_json;
  const DtrSet set = io::ReadSet(options.output);
  const auto& views = set.frames.front().views;
  EXPECT_GE(views.size(), 4u * kPanoramas);  // ceiling and floor may be too plain
  std::map<std::string, Pose> true_pose;
  for (const auto& camera : io::ReadCamerasJson(*folder_ / "walk/cameras.json").cameras) {
    true_pose[camera.name] = camera.cam_from_world;
  }
  std::map<std::string, const View*> first_of;
  std::vector<Eigen::Vector3d> found, expected;
  for (const View& view : views) {
    ASSERT_TRUE(true_pose.contains(view.name)) << view.name;
    const std::string panorama = fs::path(view.name).stem();
    EXPECT_EQ(view.role == ViewRole::kHeldOut, panorama == "0002") << view.name;
    const auto [entry, fresh] = first_of.emplace(panorama, &view);
    EXPECT_LT((view.CenterInWorld() - entry->second->CenterInWorld()).norm(), 1e-9) << view.name;
    EXPECT_DOUBLE_EQ(view.camera.fx_px(), 122);
    EXPECT_DOUBLE_EQ(view.camera.cy_px(), 122);
    if (!fresh) continue;
    found.push_back(view.CenterInWorld());
    expected.push_back(true_pose.at(view.name).TargetOriginInSource());
  }
  ASSERT_EQ(first_of.size(), static_cast<size_t>(kPanoramas));
  const calib::Similarity truth_from_set = calib::AlignPoints(found, expected);
  double worst_m = 0, worst_rad = 0;
  for (const View& view : views) {
    const Pose& pose = true_pose.at(view.name);
    const Pose aligned = truth_from_set.CamFromB(view.cam_from_world);
    worst_m =
        std::max(worst_m, (aligned.TargetOriginInSource() - pose.TargetOriginInSource()).norm());
    worst_rad = std::max(worst_rad, aligned.rotation.angularDistance(pose.rotation));
  }
  RecordProperty("worst_m", std::to_string(worst_m));
  RecordProperty("worst_rad", std::to_string(worst_rad));
  RecordProperty("views", static_cast<int>(views.size()));
  EXPECT_LT(worst_m, kMaxCentreError);
  EXPECT_LT(worst_rad, kMaxTurnRad);
  const auto provenance = nlohmann::json::parse(set.provenance_json);
  EXPECT_EQ(provenance["calibration"]["rig"]["file"], "panoramas");
  EXPECT_EQ(provenance["calibration"]["rig"]["frames"], kPanoramas);
}

// A panorama that structure from motion never saw stands where it is, as one; and the set, in the
// unit of nobody, becomes metres by what its panoramas say of their places.
TEST_F(PanoramaBuild, AStrictlyHeldOutPanoramaStandsAsOneAndPlacesGiveMetres) {
  BuildOptions options = Options("strict");
  options.holdout = "0002";
  options.holdout_strict = true;
  SilentProgress silent;
  BuildSet(options, silent);
  const DtrSet set = io::ReadSet(options.output);
  std::map<std::string, Pose> true_pose;
  for (const auto& camera : io::ReadCamerasJson(*folder_ / "walk/cameras.json").cameras) {
    true_pose[camera.name] = camera.cam_from_world;
  }
  std::vector<Eigen::Vector3d> found, expected;
  std::map<std::string, const View*> first_of;
  for (const View& view : set.frames.front().views) {
    const std::string panorama = fs::path(view.name).stem();
    EXPECT_EQ(view.role == ViewRole::kHeldOut, panorama == "0002") << view.name;
    const auto [entry, fresh] = first_of.emplace(panorama, &view);
    EXPECT_LT((view.CenterInWorld() - entry->second->CenterInWorld()).norm(), 1e-9) << view.name;
    if (!fresh || panorama == "0002") continue;
    found.push_back(view.CenterInWorld());
    expected.push_back(true_pose.at(view.name).TargetOriginInSource());
  }
  ASSERT_TRUE(first_of.contains("0002"));
  const calib::Similarity truth_from_set = calib::AlignPoints(found, expected);
  int held_out = 0;
  for (const View& view : set.frames.front().views) {
    if (view.role != ViewRole::kHeldOut) continue;
    ++held_out;
    const Pose& pose = true_pose.at(view.name);
    const Pose aligned = truth_from_set.CamFromB(view.cam_from_world);
    EXPECT_LT((aligned.TargetOriginInSource() - pose.TargetOriginInSource()).norm(),
              kMaxRegisteredCentreError);
    EXPECT_LT(aligned.rotation.angularDistance(pose.rotation), kMaxRegisteredTurnRad);
  }
  EXPECT_GE(held_out, 3);

  const fs::path located = *folder_ / "located";
  WriteLocated(true_pose, located);
  ScaleOptions scale;
  scale.set = options.output;
  scale.output = *folder_ / "metres.dtr";
  scale.gps = located;
  const ScaleReport report = ScaleSet(scale, silent);
  EXPECT_NEAR(report.metres_per_unit / (kMetresPerTrueUnit * truth_from_set.scale), 1, 0.01);
  ASSERT_TRUE(report.positions);
  EXPECT_EQ(report.positions->photos, static_cast<size_t>(kPanoramas)) << "one place a panorama";
}

TEST_F(PanoramaBuild, ACaptureOfPanoramasKeepsWhatItsViewsAre) {
  SilentProgress silent;
  const capture::Capture views = Ingest(
      *folder_ / "walk/panoramas", {}, capture::PanoramaUse::kAuto,
      [&] { return *folder_ / "frames"; }, silent);
  ASSERT_EQ(views.photos.size(), 6u * kPanoramas);
  capture::WriteCapture(views, *folder_ / "views");
  const auto rig = RigOfPanoramas(capture::ReadCapture(*folder_ / "views"));
  ASSERT_TRUE(rig);
  EXPECT_EQ(rig->names.size(), 6u);
  EXPECT_TRUE(calib::HasOneCentre(rig->known));
  EXPECT_FALSE(RigOfPanoramas(capture::Capture{}));
}

TEST_F(PanoramaBuild, WhatDoesNotGoWithPanoramasIsRejectedBeforeAnyWork) {
  SilentProgress silent;
  const auto message = [&](const BuildOptions& options) {
    const std::string text = MessageOf<UsageError>([&] { (void)BuildSet(options, silent); });
    EXPECT_FALSE(fs::exists(options.output));
    EXPECT_FALSE(fs::exists(options.output.string() + ".partial"));
    return text;
  };
  BuildOptions options = Options("no");
  options.refine = false;
  EXPECT_THAT(message(options), HasSubstr("the photos are panoramas, whose views are a rig with "
                                          "known intrinsics: leave out `no_refine`"));
  options = Options("no");
  options.sfm.camera_per = CameraPer::kPhoto;
  EXPECT_THAT(message(options), HasSubstr("leave out `camera_per`"));
  options = Options("no");
  options.metres.gps = true;
  EXPECT_THAT(message(options), HasSubstr("leave out `gps` and `distance`; dtr calibrate scale "
                                          "takes the finished set"));
  options = Options("no");
  options.sfm.engine = sfm::SfmEngine::kColmap;
  EXPECT_THAT(message(options), HasSubstr("COLMAP 3.8 cannot hold one; use `sfm` auto or global"));
}

}  // namespace
}  // namespace dtr::pipeline
