// Cameras that came from elsewhere: a build tests them, names usual mistakes, and adjusts them
// where it is asked to.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <functional>
#include <nlohmann/json.hpp>

#include "calib/colmap/model_io.h"
#include "capture/ingest.h"
#include "dtr/base/error.h"
#include "dtr/base/random.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/set_io.h"
#include "pipeline/build/build.h"
#include "pipeline/core/calibrate.h"
#include "pipeline/import/import.h"
#include "tests/pipeline/dataset_once.h"
#include "tests/support/message_of.h"
#include "tests/support/noted_lines.h"

namespace dtr::pipeline {
namespace {

using dtr::testing::MessageOf;
using dtr::testing::NotedLines;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

class GivenCameras : public dtr::testing::DatasetOnce {
 protected:
  static void SetUpTestSuite() {
    datasets::DatasetSpec spec = Scene("courtyard", 8, 480);
    spec.height_px = 320;
    Make(spec, "room");
  }
  struct Built {
    std::vector<std::string> lines;
    std::string error;
    DtrSet set;
    CalibrationReport calibration;  // of an import
  };
  // Builds with the true cameras after `change`.
  static Built Build(const std::string& name, const std::function<void(io::NamedCamera&)>& change,
                     bool refine = false) {
    io::CameraList list = io::ReadCamerasJson(*folder_ / "room/cameras.json");
    for (io::NamedCamera& camera : list.cameras) change(camera);
    io::WriteCamerasJson(*folder_ / (name + ".json"), list);
    BuildOptions options;
    options.photos = *folder_ / "room/images";
    options.poses = *folder_ / (name + ".json");
    options.output = *folder_ / (name + ".dtr");
    options.depth.engine = "none";
    options.sfm.engine = sfm::SfmEngine::kGlobal;
    options.refine_poses = refine;
    NotedLines lines;
    Built built;
    try {
      (void)BuildSet(options, lines);
      built.set = io::ReadSet(options.output);
    } catch (const Error& error) {
      built.error = error.what();
    }
    built.lines = std::move(lines.lines);
    return built;
  }
  // The same as a set of points and photos alone.
  static Built Imported(const std::string& name,
                        const std::function<void(io::NamedCamera&)>& change) {
    io::CameraList list = io::ReadCamerasJson(*folder_ / "room/cameras.json");
    for (io::NamedCamera& camera : list.cameras) change(camera);
    io::WriteCamerasJson(*folder_ / (name + ".json"), list);
    ImportRequest request;
    request.cameras = *folder_ / (name + ".json");
    request.images = *folder_ / "room/images";
    request.output = *folder_ / (name + "_imported.dtr");
    request.refine = true;
    NotedLines lines;
    Built built;
    try {
      built.calibration = Import(request, lines).calibration;
      built.set = io::ReadSet(request.output);
    } catch (const Error& error) {
      built.error = error.what();
    }
    built.lines = std::move(lines.lines);
    return built;
  }
  // Root mean squared distance of the centres from the true ones: in the world of the file, which
  // adjustment keeps.
  static double CentreError(const std::vector<Pose>& poses) {
    const auto truth = io::ReadCamerasJson(*folder_ / "room/cameras.json");
    EXPECT_EQ(poses.size(), truth.cameras.size());
    double sum = 0;
    for (size_t i = 0; i < poses.size(); ++i) {
      sum +=
          (poses[i].Inverse().translation - truth.cameras[i].cam_from_world.Inverse().translation)
              .squaredNorm();
    }
    return std::sqrt(sum / static_cast<double>(poses.size()));
  }
  // The tests that the set's validation result lists.
  static nlohmann::json TestCalled(const DtrSet& set, const std::string& name) {
    const auto result = nlohmann::json::parse(set.validation_json);
    for (const auto& test : result["tests"]) {
      if (test["name"] == name) return test;
    }
    ADD_FAILURE() << "no test " << name << " in " << set.validation_json.substr(0, 300);
    return {};
  }
};

TEST_F(GivenCameras, RightOnesPassAndNothingIsReported) {
  const Built built = Build("right", [](io::NamedCamera&) {});
  ASSERT_EQ(built.error, "");
  EXPECT_THAT(built.lines, Not(Contains(HasSubstr("matched features lie"))));
  const auto test = TestCalled(built.set, "given_cameras_px");
  EXPECT_TRUE(test["passed"]) << test;
  EXPECT_LT(test["value"], 0.5);
}

TEST_F(GivenCameras, OpenGlAxesAreNamedWithWhatToDo) {
  Built built = Build("gl", [](io::NamedCamera& camera) {
    const Eigen::Matrix3d gl = Eigen::Vector3d(1, -1, -1).asDiagonal();
    camera.cam_from_world =
        Pose{Eigen::Quaterniond(gl), Eigen::Vector3d::Zero()} * camera.cam_from_world;
  });
  if (built.error.empty()) {
    EXPECT_FALSE(TestCalled(built.set, "given_cameras_px")["passed"]);
  }
  built.lines.push_back(built.error);
  EXPECT_THAT(built.lines, Contains(::testing::AllOf(
                               HasSubstr("gl.json: matched features lie"),
                               HasSubstr("OpenGL's axes (y up, z back)"),
                               HasSubstr("negate the second and third row of cam_from_world"))));
}

TEST_F(GivenCameras, TheCamerasOfAFileMayBeAdjusted) {
  Random random(3);
  const Built built = Build(
      "off",
      [&](io::NamedCamera& camera) {
        const Eigen::Vector3d axis(random.Normal(), random.Normal(), random.Normal());
        const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.003, axis.normalized()));
        camera.cam_from_world = Pose{turn, Eigen::Vector3d::Zero()} * camera.cam_from_world;
      },
      true);
  ASSERT_EQ(built.error, "");
  EXPECT_THAT(built.lines,
              Contains(HasSubstr("given cameras are adjusted: held-out observations lie")));
  const auto truth = io::ReadCamerasJson(*folder_ / "room/cameras.json");
  const auto given = io::ReadCamerasJson(*folder_ / "off.json");
  const auto& views = built.set.frames.front().views;
  ASSERT_EQ(views.size(), truth.cameras.size());
  // Rotations from one photo to the next, which no choice of the world changes.
  const auto error = [&](const std::function<Pose(size_t)>& pose) {
    double sum = 0;
    for (size_t i = 0; i + 1 < views.size(); ++i) {
      const Pose found = pose(i + 1) * pose(i).Inverse();
      const Pose expected =
          truth.cameras[i + 1].cam_from_world * truth.cameras[i].cam_from_world.Inverse();
      sum += found.rotation.angularDistance(expected.rotation);
    }
    return sum;
  };
  EXPECT_LT(error([&](size_t i) { return views[i].cam_from_world; }),
            0.5 * error([&](size_t i) { return given.cameras[i].cam_from_world; }));
}

TEST_F(GivenCameras, AnImportAdjustsCamerasThatAreOffAndKeepsWorldAndUnit) {
  Random random(5);
  const Built built = Imported("moved", [&](io::NamedCamera& camera) {
    const Eigen::Vector3d axis(random.Normal(), random.Normal(), random.Normal());
    const Eigen::Vector3d step(random.Normal(), random.Normal(), random.Normal());
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.003, axis.normalized()));
    camera.cam_from_world = Pose{turn, 0.01 * step} * camera.cam_from_world;
  });
  ASSERT_EQ(built.error, "");
  EXPECT_THAT(built.lines,
              Contains(HasSubstr("given cameras are adjusted: held-out observations lie")));
  ASSERT_TRUE(built.calibration.bundle_adjustment);
  EXPECT_TRUE(built.calibration.bundle_adjustment->refined.changed);
  EXPECT_EQ(built.set.unit, LengthUnit::kMetre);
  EXPECT_THAT(built.set.provenance_json, HasSubstr("\"bundle_adjustment\""));
  std::vector<Pose> adjusted, given;
  for (const View& view : built.set.frames.front().views) adjusted.push_back(view.cam_from_world);
  for (const auto& camera : io::ReadCamerasJson(*folder_ / "moved.json").cameras) {
    given.push_back(camera.cam_from_world);
  }
  EXPECT_LT(CentreError(adjusted), 0.7 * CentreError(given));
}

TEST_F(GivenCameras, AnImportLeavesExactCamerasAsTheyAre) {
  constexpr double kStoredPose = 1e-12;  // the set stores matrices, the photos' cameras quaternions
  const Built built = Imported("exact", [](io::NamedCamera&) {});
  ASSERT_EQ(built.error, "");
  EXPECT_THAT(built.lines, Contains(HasSubstr("given cameras stay as they are: ")));
  const auto truth = io::ReadCamerasJson(*folder_ / "room/cameras.json");
  const auto& views = built.set.frames.front().views;
  ASSERT_EQ(views.size(), truth.cameras.size());
  for (size_t i = 0; i < views.size(); ++i) {
    const Pose moved = views[i].cam_from_world * truth.cameras[i].cam_from_world.Inverse();
    EXPECT_LT(Eigen::AngleAxisd(moved.rotation).angle() + moved.translation.norm(), kStoredPose);
    EXPECT_EQ(views[i].camera, truth.cameras[i].camera);
  }
}

TEST_F(GivenCameras, DepthAndAdjustedCamerasDoNotGoTogether) {
  ImportRequest request;
  request.cameras = *folder_ / "room/cameras.json";
  request.images = *folder_ / "room/images";
  request.depth = *folder_ / "room/depth";
  request.output = *folder_ / "no.dtr";
  request.refine = true;
  SilentProgress silent;
  EXPECT_THAT(MessageOf<UsageError>([&] { (void)Import(request, silent); }),
              HasSubstr("`refine`: depth maps belong to the cameras as they are given"));
  EXPECT_FALSE(std::filesystem::exists(*folder_ / "no.dtr"));
}

// Models that bring points: what their own observations say, and what the photos do.
class GivenModels : public GivenCameras {
 protected:
  static void SetUpTestSuite() {
    GivenCameras::SetUpTestSuite();
    SilentProgress silent;
    const auto photos = capture::IngestPhotos(*folder_ / "room/images", {}, silent);
    CalibrateOptions options;
    options.poses = *folder_ / "room/cameras.json";
    model_ =
        new calib::SfmModel(CalibratePhotos(photos, options, *folder_ / "workspace", silent).model);
  }
  static void TearDownTestSuite() {
    delete model_;
    GivenCameras::TearDownTestSuite();
  }
  // What an import of the model says of it.
  static std::vector<std::string> LinesOf(const std::string& name, const calib::SfmModel& model) {
    colmap::WriteModel(*folder_ / name, model, colmap::Format::kText);
    ImportRequest request;
    request.cameras = *folder_ / name;
    request.images = *folder_ / "room/images";
    request.output = *folder_ / (name + ".dtr");
    NotedLines lines;
    const ImportReport report = Import(request, lines);
    EXPECT_TRUE(report.calibration.given_cameras);
    EXPECT_THAT(io::ReadSet(request.output).provenance_json, HasSubstr("\"given_cameras\""));
    return std::move(lines.lines);
  }
  static calib::SfmModel* model_;
};
calib::SfmModel* GivenModels::model_ = nullptr;

TEST_F(GivenModels, RightOnesPassAndNothingIsReported) {
  ASSERT_GT(model_->points.size(), 200u);
  EXPECT_THAT(LinesOf("model", *model_), Not(Contains(HasSubstr("matched features lie"))));
}

TEST_F(GivenModels, CamerasThatDoNotFitTheirPointsAreNamed) {
  calib::SfmModel gl = *model_;
  const Eigen::Matrix3d axes = Eigen::Vector3d(1, -1, -1).asDiagonal();
  for (calib::SfmImage& image : gl.images) {
    image.cam_from_world =
        Pose{Eigen::Quaterniond(axes), Eigen::Vector3d::Zero()} * image.cam_from_world;
  }
  EXPECT_THAT(LinesOf("gl_model", gl), Contains(HasSubstr("OpenGL's axes (y up, z back)")));
}

TEST_F(GivenModels, CamerasThatFitTheirPointsButNotThePhotosAreNamed) {
  calib::SfmModel reversed = *model_;
  const size_t count = reversed.images.size();
  for (size_t i = 0; i < count; ++i) reversed.images[i].name = model_->images[count - 1 - i].name;
  EXPECT_THAT(LinesOf("reversed_model", reversed),
              Contains(HasSubstr("photos in another order (reversed)")));
}

TEST_F(GivenCameras, AdjustingNeedsCamerasOfAFile) {
  BuildOptions options;
  options.photos = *folder_ / "room/images";
  options.output = *folder_ / "no.dtr";
  options.refine_poses = true;
  SilentProgress silent;
  EXPECT_THAT(MessageOf<UsageError>([&] { (void)BuildSet(options, silent); }),
              HasSubstr("`refine`: adjusts the cameras of `poses`"));
}

}  // namespace
}  // namespace dtr::pipeline
