// Four webcams whose calibration another program published: what of it our own solves of the same
// images confirm, and what the images themselves cannot decide (docs/accuracy/CALIBRATION.md has the
// figures that this prints).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>

#include "calib/validation/boards.h"
#include "calib/validation/free_running.h"
#include "dtr/base/files.h"
#include "pipeline/boards/rig_photos.h"
#include "tests/support/test_data.h"

namespace dtr::calib {
namespace {

namespace fs = std::filesystem;
using dtr::testing::DataFolder;

fs::path Folder() { return DataFolder() / "charuco_rig_4cam"; }

// The numbers of `key = [[1, 2], [3]]` in the section of a camera.
std::vector<double> Numbers(const std::string& toml, int camera, const std::string& key) {
  const size_t section = toml.find("[cameras." + std::to_string(camera) + "]");
  const size_t at = toml.find("\n" + key + " =", section);
  std::string line = toml.substr(at, toml.find('\n', at + 1) - at);
  line = line.substr(line.find('=') + 1);
  for (char& c : line) {
    if (c == '[' || c == ']' || c == ',') c = ' ';
  }
  std::istringstream words(line);
  std::vector<double> numbers;
  for (double number = 0; words >> number;) numbers.push_back(number);
  return numbers;
}

// As camera_array.toml has it: OpenCV's pixels, cam_from_world in metres.
std::vector<RigCamera> Published(const std::vector<pipeline::RigPhotoCamera>& cameras) {
  const std::string toml = ReadFile(Folder() / "camera_array.toml", 1 << 20);
  std::vector<RigCamera> published;
  Pose rig_from_world;
  for (size_t c = 0; c < cameras.size(); ++c) {
    const int id = static_cast<int>(c);
    const auto k = Numbers(toml, id, "matrix"), d = Numbers(toml, id, "distortions"),
               t = Numbers(toml, id, "translation"), r = Numbers(toml, id, "rotation");
    EXPECT_EQ(k.size() + d.size() + t.size() + r.size(), 9u + 5 + 3 + 9);
    RigCamera camera{cameras[c].name, BoardModel::kBrown5, {}, {}};
    camera.camera =
        CameraFrom(camera.model, cameras[c].width_px, cameras[c].height_px,
                   std::vector{k[0], k[4], k[2] + 0.5, k[5] + 0.5, d[0], d[1], d[2], d[3], d[4]});
    Pose cam_from_world;
    cam_from_world.rotation = Eigen::Quaterniond(
        Eigen::Matrix3d(Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r.data())));
    cam_from_world.rotation.normalize();
    cam_from_world.translation = Eigen::Vector3d(t[0], t[1], t[2]);
    if (c == 0) rig_from_world = cam_from_world;
    camera.cam_from_rig = cam_from_world * rig_from_world.Inverse();
    published.push_back(std::move(camera));
  }
  return published;
}

double ValueOf(const BoardValidation& report, const std::string& name) {
  const auto found = std::find_if(report.tests.begin(), report.tests.end(),
                                  [&](const Check& test) { return test.name == name; });
  EXPECT_NE(found, report.tests.end()) << name;
  return found == report.tests.end() ? std::nan("") : found->value;
}

double RmsOf(const BoardValidation& report) { return ValueOf(report, "test_rms_px"); }

class PublishedRig : public ::testing::Test {
 protected:
  void SetUp() override {
    DTR_REQUIRE_DATA(Folder());
    SilentProgress silent;
    photos_ = pipeline::ReadRigPhotos(Folder(), board_, {}, silent);
    published_ = Published(photos_.cameras);
  }

  const Board board_ = BoardFromText("charuco:4x5:54mm:0.75:DICT_4X4_1000:inverted");
  pipeline::RigPhotos photos_;
  std::vector<RigCamera> published_;
};

TEST_F(PublishedRig, ItsLensesExplainOurCornersAsWellAsOurOwn) {
  for (size_t c = 0; c < published_.size(); ++c) {
    TestViews own{{}, photos_.frames.size()};
    for (RigView view : photos_.views) {
      if (view.camera != c) continue;
      view.camera = 0;
      own.views.push_back(std::move(view));
    }
    RigCamera alone = published_[c];
    alone.cam_from_rig = {};
    const BoardValidation report = ValidateBoards({board_, {alone}, {}, 0, true}, own, {});
    const double ratio = ValueOf(report, "test_rms_ratio");
    std::printf(
        "%s: RMS %.3f px, %.2f of our own sigma, lenses differ by %.1f sigmas, ours is "
        "uncertain by %.3g px\n",
        alone.name.c_str(), RmsOf(report), ratio, ValueOf(report, "lens_difference_sigmas"),
        ValueOf(report, "projection_uncertainty_px"));
    EXPECT_LT(RmsOf(report), 0.2);
    EXPECT_LT(ratio, 1.25);  // 1.20 was seen; another lens leaves several times as much
    // Boards in the middle alone leave the rest of the lens open, and that is said.
    EXPECT_GT(ValueOf(report, "projection_uncertainty_px"), BoardLimits{}.max_uncertainty_px);
  }
}

TEST_F(PublishedRig, ItsPlacesAreOursToAHundredthAndTheClocksAreWhatIsWrong) {
  std::vector<RigCameraInput> inputs;
  for (const RigCamera& camera : published_) {
    inputs.push_back({camera.name, camera.model, camera.camera.width_px, camera.camera.height_px,
                      camera.camera});
  }
  RigOptions options;
  options.free_lenses = false;
  const size_t frames = photos_.frames.size();
  const RigSolution ours = SolveRig(board_, inputs, photos_.views, frames, options);
  const BoardValidation theirs =
      ValidateBoards({board_, published_, {}, 0, false}, TestViews{photos_.views, frames}, {});
  std::printf("RMS with the published positions %.3f px, with ours %.3f px\n", RmsOf(theirs),
              ours.rms_px);
  EXPECT_LT(RmsOf(theirs), 1.05 * ours.rms_px);
  for (size_t c = 1; c < published_.size(); ++c) {
    const Pose &a = published_[c].cam_from_rig, &b = ours.rig.cameras[c].cam_from_rig;
    const Eigen::AngleAxisd turn(a.rotation * b.rotation.conjugate());
    const Eigen::Vector3d from = a.TargetOriginInSource(), to = b.TargetOriginInSource();
    const double turn_deg = turn.angle() * 180 / EIGEN_PI, share = (from - to).norm() / from.norm();
    std::printf("%s: %.2f degrees, %.1f mm of %.0f\n", published_[c].name.c_str(), turn_deg,
                1e3 * (from - to).norm(), 1e3 * from.norm());
    EXPECT_LT(turn_deg, 1);
    EXPECT_LT(share, 0.02);
  }
  const FreeRunning free = SolveFreeRunning(board_, inputs, photos_.views, frames, options);
  const PatternTest unsteady = TestUnsteadyClocks(free.solution);
  std::printf(
      "one delay per camera: RMS %.3f px after %d solves; delays of their own explain "
      "%.3f px more per coordinate, p = %.1e\n",
      free.solution.rms_px, free.passes, unsteady.amplitude_px, unsteady.p);
  EXPECT_LT(free.solution.rms_px, 0.7 * ours.rms_px);
  EXPECT_LT(unsteady.p, 1e-12);
  EXPECT_GT(unsteady.amplitude_px, BoardLimits{}.max_pattern_px);
}

}  // namespace
}  // namespace dtr::calib
