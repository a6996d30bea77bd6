// Runs the real program on a few photos of the sample collection, features at 640 px.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calib/colmap/model_io.h"
#include "calib/colmap/steps.h"
#include "calib/sfm/run/held_out.h"
#include "calib/sfm/run/known_poses.h"
#include "calib/sfm/run/sfm.h"
#include "dtr/base/process.h"
#include "tests/calib/colmap/model_test_support.h"
#include "tests/calib/colmap/plaza_truth.h"
#include "tests/support/test_data.h"

namespace dtr::colmap {
namespace {

using namespace sfm;

using namespace testing;

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

class RealColmap : public ::testing::Test {
 protected:
  void SetUp() override {
    if (FindProgram("colmap").empty()) GTEST_SKIP() << "there is no colmap on the PATH";
    truth_ = PlazaTruth();
    options_.colmap = &kSteps;
    options_.engine = SfmEngine::kColmap;
    options_.max_image_size_px = kSidePx;
    options_.lens_model = "SIMPLE_PINHOLE";
  }

  const Pose& TrueCamFromWorld(const std::string& name) const { return truth_.CamFromWorld(name); }

  Truth truth_;
  SfmOptions options_;
  SilentProgress silent_;
  const dtr::testing::TemporaryFolder folder_;
};

TEST_F(RealColmap, CalibratesPhotosAndPlacesAHeldOutOneInTheFrozenModel) {
  std::vector<SfmImageInput> sources, held_out;
  for (int i = kFirst; i <= kLast; ++i) {
    (i == kHeldOut ? held_out : sources).push_back(truth_.inputs[static_cast<size_t>(i)]);
  }
  const fs::path images = kPlaza / "images";
  const SfmResult sfm = RunSfm(images, sources, folder_ / "sfm", options_, silent_);
  EXPECT_THAT(sfm.report.not_registered, IsEmpty());
  EXPECT_LT(sfm.report.mean_reprojection_error_px, kMeanErrorPx);
  const auto& first = sfm.model.images.front();
  for (const auto& image : sfm.model.images) {
    EXPECT_LT(DegreesBetween(image.cam_from_world, first.cam_from_world,
                             TrueCamFromWorld(image.name), TrueCamFromWorld(first.name)),
              kRotationDeg)
        << image.name;
  }

  const HeldOutResult placed = RegisterHeldOut(
      images, held_out, sfm.model, sources, folder_ / "sfm", folder_ / "held", options_, silent_);
  ASSERT_EQ(placed.images.size(), 1u);
  const auto& image = placed.images.front();
  EXPECT_EQ(image.name, held_out.front().name);
  EXPECT_EQ(placed.cameras.at(image.camera_id).params,
            sfm.model.cameras.at(first.camera_id).params);
  EXPECT_LT(DegreesBetween(image.cam_from_world, first.cam_from_world, TrueCamFromWorld(image.name),
                           TrueCamFromWorld(first.name)),
            kRotationDeg);
  testing::ExpectSame(sfm.model, RunSfm(images, sources, folder_ / "sfm", options_, silent_).model);
}

TEST_F(RealColmap, TriangulatesPointsAroundGivenPosesWithoutMovingThem) {
  std::vector<PosedImage> posed;
  for (int i = kLast; i >= kLast - 2; --i) posed.push_back(truth_.images[static_cast<size_t>(i)]);
  const SfmResult result =
      TriangulateWithPoses(kPlaza / "images", posed, folder_ / "posed", options_, silent_);
  EXPECT_THAT(result.report.not_registered, IsEmpty());
  EXPECT_LT(result.report.mean_reprojection_error_px, kMeanErrorPx);
  EXPECT_GT(result.model.points.size(), 100u);
  ASSERT_EQ(result.model.images.size(), posed.size());
  for (const auto& image : result.model.images) {
    const Pose& given = TrueCamFromWorld(image.name);
    EXPECT_EQ(image.cam_from_world.rotation.coeffs(), given.rotation.coeffs());
    EXPECT_EQ(image.cam_from_world.translation, given.translation);
  }
}

}  // namespace
}  // namespace dtr::colmap
