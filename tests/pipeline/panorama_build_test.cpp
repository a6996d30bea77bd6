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
#include "pipeline/build.h"
#include "pipeline/capture.h"
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
    options.sfm.engine = colmap::SfmEngine::kGlobal;
    return options;
  }
};

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

TEST_F(PanoramaBuild, ACaptureOfPanoramasKeepsWhatItsViewsAre) {
  SilentProgress silent;
  const capture::Capture views = Ingest(
      *folder_ / "walk/panoramas", {}, capture::PanoramaUse::kAuto,
      [&] { return *folder_ / "frames"; }, silent);
  ASSERT_EQ(views.photos.size(), 6u * kPanoramas);
  capture::WriteCapture(views, *folder_ / "views", 1);
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
  options.holdout = "every:3";
  options.holdout_strict = true;
  EXPECT_THAT(message(options), HasSubstr("`holdout_strict` does not go with them"));
}

}  // namespace
}  // namespace dtr::pipeline
