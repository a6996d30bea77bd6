// Structure from motion by calib/sfm on a few photos of the sample collection, COLMAP out of reach.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "calib/colmap/steps.h"
#include "calib/sfm/run/held_out.h"
#include "calib/sfm/run/sfm.h"
#include "dtr/io/image_io.h"
#include "tests/calib/colmap/model_test_support.h"
#include "tests/calib/colmap/plaza_truth.h"
#include "tests/support/environment.h"
#include "tests/support/message_of.h"
#include "tests/support/on_threads.h"
#include "tests/support/test_data.h"

namespace dtr::sfm {
namespace {

using namespace colmap::testing;
namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class OwnSfm : public ::testing::Test {
 protected:
  OwnSfm() : truth_(PlazaTruth()) {
    options_.colmap = &colmap::kSteps;
    options_.engine = SfmEngine::kGlobal;
    options_.max_image_size_px = kSidePx;
    options_.lens_model = "SIMPLE_PINHOLE";
    for (int i = kFirst; i <= kLast; ++i) {
      (i == kHeldOut ? held_out_ : sources_).push_back(truth_.inputs[static_cast<size_t>(i)]);
    }
  }

  SfmResult Run(const fs::path& folder) {
    return RunSfm(kPlaza / "images", sources_, folder, options_, silent_);
  }

  // Against the truth, relative to the first image of the model.
  double DegreesOff(const calib::SfmModel& model, const calib::SfmImage& image) const {
    const calib::SfmImage& first = model.images.front();
    return DegreesBetween(image.cam_from_world, first.cam_from_world,
                          truth_.CamFromWorld(image.name), truth_.CamFromWorld(first.name));
  }

  Truth truth_;
  std::vector<SfmImageInput> sources_, held_out_;
  SfmOptions options_;
  SilentProgress silent_;
  const dtr::testing::TemporaryFolder folder_;
  const dtr::testing::Environment no_programs_{"PATH", "/nonexistent"};
};

TEST_F(OwnSfm, CalibratesPhotosAndPlacesAHeldOutOneWithoutColmap) {
  const SfmResult sfm = Run(folder_ / "sfm");
  EXPECT_THAT(sfm.report.not_registered, IsEmpty());
  EXPECT_LT(sfm.report.mean_reprojection_error_px, kMeanErrorPx);
  EXPECT_THAT(sfm.report.version, HasSubstr("dtr"));
  for (const auto& image : sfm.model.images) {
    EXPECT_LT(DegreesOff(sfm.model, image), kRotationDeg) << image.name;
  }

  const HeldOutResult placed =
      RegisterHeldOut(kPlaza / "images", held_out_, sfm.model, sources_, folder_ / "sfm",
                      folder_ / "held", options_, silent_);
  ASSERT_EQ(placed.images.size(), 1u);
  const calib::SfmImage& image = placed.images.front();
  EXPECT_EQ(image.name, held_out_.front().name);
  EXPECT_EQ(placed.cameras.at(image.camera_id).params,
            sfm.model.cameras.at(sfm.model.images.front().camera_id).params);
  EXPECT_LT(DegreesOff(sfm.model, image), kRotationDeg);
}

TEST_F(OwnSfm, TriangulatesAndColoursThePointsOfGivenCameras) {
  const std::vector<PosedImage> posed(truth_.images.begin() + kFirst,
                                      truth_.images.begin() + kLast + 1);
  const SfmResult sfm =
      TriangulateWithPoses(kPlaza / "images", posed, folder_ / "sfm", options_, silent_);
  EXPECT_THAT(sfm.report.not_registered, IsEmpty());
  ASSERT_EQ(sfm.model.images.size(), posed.size());
  for (size_t i = 0; i < posed.size(); ++i) {
    EXPECT_EQ(sfm.model.images[i].cam_from_world.translation, posed[i].cam_from_world.translation);
    EXPECT_EQ(sfm.model.cameras.at(sfm.model.images[i].camera_id).params, posed[i].camera.params);
  }
  EXPECT_GT(sfm.model.points.size(), 300u);
  EXPECT_LT(sfm.report.mean_reprojection_error_px, kMeanErrorPx);

  const ImageRgb8 photo = io::ReadImage(kPlaza / "images" / posed[0].name);
  std::vector<int> off;  // levels between a point's colour and this photo's pixel
  for (const calib::SfmFeature& feature : sfm.model.images[0].features) {
    if (feature.point_id == calib::SfmFeature::kNoPoint) continue;
    const auto& rgb = sfm.model.points.at(feature.point_id).rgb;
    const int x = static_cast<int>(feature.pixel.x()), y = static_cast<int>(feature.pixel.y());
    off.push_back(std::abs(rgb[1] - photo(x, y, 1)));
  }
  std::nth_element(off.begin(), off.begin() + static_cast<int>(off.size() / 2), off.end());
  EXPECT_LT(off[off.size() / 2], 12);
}

TEST_F(OwnSfm, GivesTheSameModelForAnyNumberOfThreadsAndFromItsCheckpoints) {
  std::optional<ThreadLimit> limit;
  limit.emplace(1);
  const calib::SfmModel one = Run(folder_ / "one").model;
  ExpectSame(one, Run(folder_ / "one").model);
  limit.emplace(3);
  ExpectSame(one, Run(folder_ / "three").model);
}

TEST_F(OwnSfm, RefusesPhotosThatHaveNothingInCommon) {
  std::mt19937 random(1);
  fs::create_directories(folder_ / "photos");
  sources_.clear();
  for (const char* name : {"a.png", "b.png", "c.png"}) {
    ImageRgb8 blocks(320, 240, 3);  // of 5 x 5 pixels: features, and no two photos alike
    for (int y = 0; y < blocks.height(); y += 5) {
      for (int x = 0; x < blocks.width(); x += 5) {
        const auto value = static_cast<std::uint8_t>(random());
        for (int i = 0; i < 75; ++i) blocks(x + i / 3 % 5, y + i / 15, i % 3) = value;
      }
    }
    io::WriteImage(folder_ / "photos" / name, blocks);
    sources_.push_back({name, 320, 240, {}, "noise"});
  }
  const auto run = [&] {
    RunSfm(folder_ / "photos", sources_, folder_ / "apart", options_, silent_);
  };
  EXPECT_THAT(dtr::testing::MessageOf<Error>(run), HasSubstr("photos must overlap"));
}

}  // namespace
}  // namespace dtr::sfm
