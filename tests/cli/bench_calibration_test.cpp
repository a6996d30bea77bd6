// `dtr bench --stage calibration`: photos calibrated again. A fake COLMAP leaves cameras whose
// errors are known, so that it is known, too, which of them must be told to be better.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>

#include "calib/colmap/model_io.h"
#include "dtr/io/image_io.h"
#include "tests/calib/colmap/fake_colmap.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using Json = nlohmann::json;

constexpr int kPhotos = 6;
constexpr double kFocalPx = 400;
const PinholeCamera kCamera(480, 320, kFocalPx, kFocalPx, 240, 160);

class BenchCalibration : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    shared_ = new TemporaryFolder;
    truth_ = new calib::SfmModel;
    std::vector<CourtyardPhoto> photos;
    for (const Pose& pose : CourtyardArc(kPhotos)) {
      photos.push_back({fmt::format("{:04}.jpg", photos.size()), kCamera, pose});
    }
    RenderCourtyard(*shared_ / "photos", photos);
    *truth_ = CourtyardModel(photos);
    for (auto& [id, camera] : truth_->cameras) {
      camera.model = calib::CameraModel::kRadial;
      camera.params = {kFocalPx, 240, 160, 0, 0};
    }
    colmap::testing::FakeColmap colmap;
    Leave(colmap, *truth_);
    DtrOk({"build", (*shared_ / "photos").string(), "-o", (*shared_ / "set.dtr").string(),
           "--engine", "none", "--sfm", "colmap"});
  }
  static void TearDownTestSuite() {
    delete shared_;
    delete truth_;
  }

  /// What the mapper is to leave, under the names that photos have for COLMAP.
  static void Leave(colmap::testing::FakeColmap& colmap, calib::SfmModel model) {
    std::vector<std::string> aliases;
    for (int i = 0; i < kPhotos; ++i) aliases.push_back(fmt::format("{:06}.jpg", i));
    for (calib::SfmImage& image : model.images) image.name = "00" + image.name;
    fs::remove_all(colmap / "model.0");
    colmap::WriteModel(colmap / "model.0", model, colmap::Format::kBinary);
    colmap.LeaveDatabase(aliases);
  }
  /// The truth with every second camera turned to the right by so many pixels, the observations as
  /// they are.
  static calib::SfmModel Turned(double by_px) {
    calib::SfmModel model = *truth_;
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(by_px / kFocalPx, Eigen::Vector3d::UnitY()));
    for (size_t i = 0; i < model.images.size(); i += 2) {
      Pose& pose = model.images[i].cam_from_world;
      pose = Pose{turn, Eigen::Vector3d::Zero()} * pose;
    }
    return model;
  }

  static std::vector<std::string> Words(std::vector<std::string> further) {
    further.insert(further.begin(),
                   {"bench", (*shared_ / "set.dtr").string(), "--renderer", "cpu", "--stage",
                    "calibration", "--photos", (*shared_ / "photos").string()});
    return further;
  }
  static Json Point(const std::string& setting, std::vector<std::string> further = {}) {
    further.insert(further.end(), {"--point", setting, "--json", "-"});
    return Json::parse(DtrOk(Words(further)).out)["stages"][0]["points"][0];
  }

  static TemporaryFolder* shared_;
  static calib::SfmModel* truth_;
  TemporaryFolder folder_;
};
TemporaryFolder* BenchCalibration::shared_ = nullptr;
calib::SfmModel* BenchCalibration::truth_ = nullptr;

TEST_F(BenchCalibration, WorseCamerasHaveALargerErrorAndRefinementMendsThem) {
  colmap::testing::FakeColmap colmap;
  Leave(colmap, *truth_);
  const Json truth = Point("sfm=colmap,refine=no");
  EXPECT_GT(truth["cost"], 0);
  EXPECT_EQ(truth["figures"]["not_registered"], 0);
  EXPECT_EQ(truth["figures"]["reference_tracks_predicted"],
            truth["figures"]["reference_observations"]);
  EXPECT_GT(truth["figures"]["reference_observations"], 400);
  EXPECT_LT(truth["figures"]["median_px"], 0.5);
  double last = truth["error"];
  for (const double by_px : {2.0, 4.0}) {
    Leave(colmap, Turned(by_px));
    const double error = Point("sfm=colmap,refine=no")["error"];
    EXPECT_GT(error, 1.1 * last) << by_px;
    last = error;
  }
  // Exact observations say where the cameras look: adjusted, they are the true ones again.
  EXPECT_NEAR(Point("sfm=colmap,refine=yes")["error"], truth["error"],
              0.02 * truth["error"].get<double>());
}

TEST_F(BenchCalibration, FewerCamerasAreNoAdvantage) {
  colmap::testing::FakeColmap colmap;
  Leave(colmap, *truth_);
  const Json all = Point("sfm=colmap,refine=no");
  // The true cameras, but for one photo that finds no place.
  calib::SfmModel fewer = *truth_;
  for (const calib::SfmFeature& feature : fewer.images.back().features) {
    fewer.points.erase(feature.point_id);
  }
  fewer.images.pop_back();
  for (calib::SfmImage& image : fewer.images) {
    std::erase_if(image.features, [&](const calib::SfmFeature& feature) {
      return !fewer.points.contains(feature.point_id);
    });
  }
  Leave(colmap, fewer);
  const Json point = Point("sfm=colmap,refine=no");
  EXPECT_EQ(point["figures"]["not_registered"], 1);
  EXPECT_EQ(point["figures"]["reference_observations"], all["figures"]["reference_observations"]);
  EXPECT_GT(point["error"], 1.5 * all["error"].get<double>());
  // By hand: an observation that is missed counts as 10 scales of half a pixel per 1000.
  const double observations = point["figures"]["reference_observations"],
               missed = observations - point["figures"]["reference_tracks_predicted"].get<double>(),
               missed_px = 10 * 0.0005 * kCamera.width_px();
  EXPECT_GT(missed, 0.05 * observations);
  EXPECT_GT(point["error"], missed_px * std::sqrt(missed / observations));
}

TEST_F(BenchCalibration, ColmapIsToldWhatTheSettingSays) {
  colmap::testing::FakeColmap colmap;
  Leave(colmap, *truth_);
  Point("sfm=colmap");
  for (const std::string& call : colmap.Calls()) {
    EXPECT_THAT(call, Not(HasSubstr("max_num_features"))) << "COLMAP's own is the default";
  }
  EXPECT_THAT(colmap.Calls(), Contains(HasSubstr("exhaustive_matcher")));
  EXPECT_THAT(colmap.Calls(), Contains(HasSubstr("--SiftExtraction.max_image_size 480 ")));
  EXPECT_THAT(colmap.Calls(), Contains(HasSubstr("--ImageReader.camera_model RADIAL ")));
  colmap.ForgetCalls();
  Point("sfm=colmap,feature-size=240,features=2048,matching=sequential,lens-model=OPENCV");
  EXPECT_THAT(colmap.Calls(), Contains(HasSubstr("--SiftExtraction.max_image_size 240")));
  EXPECT_THAT(colmap.Calls(), Contains(HasSubstr("--SiftExtraction.max_num_features 2048")));
  EXPECT_THAT(colmap.Calls(), Contains(HasSubstr("--ImageReader.camera_model OPENCV ")));
  EXPECT_THAT(colmap.Calls(), Contains(HasSubstr("sequential_matcher")));
  EXPECT_THAT(colmap.Calls(), Not(Contains(HasSubstr("exhaustive_matcher"))));
  // The same of a user's own calibration.
  colmap.ForgetCalls();
  DtrOk({"calibrate", "photos", (*shared_ / "photos").string(), "-o", (folder_ / "model").string(),
         "--sfm", "colmap", "--feature-size", "240", "--features", "2048", "--matching",
         "sequential", "--lens-model", "OPENCV"});
  EXPECT_THAT(colmap.Calls(), Contains(HasSubstr("--SiftExtraction.max_image_size 240")));
  EXPECT_THAT(colmap.Calls(), Contains(HasSubstr("--SiftExtraction.max_num_features 2048")));
  EXPECT_THAT(colmap.Calls(), Contains(HasSubstr("--ImageReader.camera_model OPENCV ")));
  EXPECT_THAT(colmap.Calls(), Contains(HasSubstr("sequential_matcher")));
}

TEST_F(BenchCalibration, ABuildKnowsHowItsCamerasWereLookedFor) {
  colmap::testing::FakeColmap colmap;
  Leave(colmap, *truth_);
  const auto build = [&](std::vector<std::string> further) {
    further.insert(further.begin(),
                   {"build", (*shared_ / "photos").string(), "-o", (folder_ / "set.dtr").string(),
                    "--engine", "none", "--force"});
    DtrOk(further);
    return Json::parse(Text(folder_ / "set.dtr/set.json"))["provenance"]["options"];
  };
  const Json sfm = build({"--sfm", "colmap", "--features", "2048"})["sfm"];
  EXPECT_EQ(sfm["features"], 2048);
  EXPECT_EQ(sfm["engine"], "colmap");
  EXPECT_FALSE(build({"--features", "14000"}).contains("sfm"))
      << "the default changes no byte of a set";
  EXPECT_EQ(build({"--preset", "fast"})["sfm"]["features"], 4096);
}

TEST_F(BenchCalibration, CommandsBringTheErrorBackFromWhatColmapLeft) {
  colmap::testing::FakeColmap colmap;
  Leave(colmap, *truth_);
  const std::string out = (folder_ / "out").string();
  DtrOk(Words({"-o", out, "--max-points", "3", "--feature-size", "480,240"}));
  const Json stage = Json::parse(Text(folder_ / "out/bench.json"))["stages"][0];
  EXPECT_EQ(stage["stage"], "calibration");
  ASSERT_EQ(stage["points"].size(), 3u);
  EXPECT_THAT(Text(folder_ / "out/bench.html"), HasSubstr("held-out reprojection"));
  EXPECT_TRUE(fs::exists(folder_ / "out/calibration.svg"));
  // COLMAP would find others now: what it found then counts, and is not run again.
  Leave(colmap, Turned(4));
  colmap.ForgetCalls();
  for (const Json& point : stage["points"]) {
    std::istringstream command(point["command"].get<std::string>());
    std::vector<std::string> words{std::istream_iterator<std::string>(command), {}};
    words.erase(words.begin());
    words.insert(words.end(), {"--json", "-"});
    const Json again = Json::parse(DtrOk(words).out)["stages"][0]["points"][0];
    EXPECT_EQ(again["error"], point["error"]) << point["command"];
    EXPECT_EQ(again["command"], point["command"]);
  }
  EXPECT_THAT(colmap.Calls(), ::testing::IsEmpty());
  // The sweep itself goes on; a point that is told no folder is calibrated from scratch.
  DtrOk(Words({"-o", out, "--max-points", "3", "--feature-size", "480,240"}));
  EXPECT_THAT(colmap.Calls(), ::testing::IsEmpty());
  EXPECT_EQ(Json::parse(Text(folder_ / "out/bench.json"))["stages"][0], stage);
  Point("sfm=colmap");
  EXPECT_THAT(colmap.Calls(), Contains(HasSubstr("mapper")));
}

TEST_F(BenchCalibration, OtherPhotosAreMeasuredAnew) {
  colmap::testing::FakeColmap colmap;
  Leave(colmap, *truth_);
  fs::copy(*shared_ / "photos", folder_ / "photos", fs::copy_options::recursive);
  std::vector<std::string> words = Words({"-o", (folder_ / "out").string(), "--max-points", "1"});
  *std::find(words.begin(), words.end(), (*shared_ / "photos").string()) =
      (folder_ / "photos").string();
  DtrOk(words);
  ImageRgb8 photo = io::ReadImage(folder_ / "photos/0003.jpg");
  for (auto& value : photo.data()) value = static_cast<std::uint8_t>(value / 2 + 60);
  io::WriteImage(folder_ / "photos/0003.jpg", photo);
  DtrOk(words);
  EXPECT_EQ(Json::parse(Text(folder_ / "out/work.json"))["measurements"].size(), 2u);
}

TEST_F(BenchCalibration, WhatCannotBeMeasuredIsRejected) {
  colmap::testing::FakeColmap colmap;
  const std::string set = (*shared_ / "set.dtr").string(), photos = (*shared_ / "photos").string();
  const auto bench = [&](std::vector<std::string> words) {
    words.insert(words.begin(), {"bench", set, "--renderer", "cpu"});
    return Dtr(words);
  };
  ExpectRejected(bench({"--photos", photos}), kWrongUsage,
                 "--photos, --feature-size: expected --stage calibration with them");
  ExpectRejected(bench({"--stage", "stereo", "--feature-size", "200"}), kWrongUsage,
                 "--photos, --feature-size: expected --stage calibration with them");
  ExpectRejected(
      bench({"--stage", "calibration"}), kWrongUsage,
      "--stage calibration: expected --photos with it, the folder that the set was built from");
  ExpectRejected(Dtr(Words({"--point", "refine=perhaps"})), kWrongUsage,
                 "--point: expected a value of {yes,no} for refine, found 'refine=perhaps'");
  // Photos that are not the set's, and such as nothing can be evaluated by.
  fs::create_directories(folder_ / "grey");
  for (int i = 0; i < kPhotos; ++i) {
    const ImageRgb8 grey(480, 320, 3, static_cast<std::uint8_t>(60 + 20 * i));
    io::WriteImage(folder_ / "grey" / fmt::format("{:04}.jpg", i), grey);
  }
  ExpectRejected(bench({"--stage", "calibration", "--photos", (folder_ / "grey").string()}),
                 kFailed,
                 "expected 100 points that 4 or more photos show, to measure cameras by, found 0; "
                 "take photos that overlap more");
  fs::rename(folder_ / "grey/0005.jpg", folder_ / "grey/other.jpg");
  ExpectRejected(bench({"--stage", "calibration", "--photos", (folder_ / "grey").string()}),
                 kFailed, "was built from, found none called 0005.jpg");
}

}  // namespace
}  // namespace dtr::testing
