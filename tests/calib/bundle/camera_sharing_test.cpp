#include "calib/bundle/camera_sharing.h"

#include <gtest/gtest.h>

#include <vector>

#include "dtr/base/error.h"
#include "tests/calib/bundle/synthetic_bundle.h"
#include "tests/support/on_threads.h"

namespace dtr::calib {
namespace {

using testing::MakeBundle;
using testing::SceneSpec;

using Groups = std::vector<std::vector<std::uint32_t>>;

// Image i of 12 has camera 1 + i % cameras, whose true focal length is focal_px[i % cameras]. The
// cameras are given as structure from motion leaves them: a share of a percent off.
SfmModel ModelOfFocals(const std::vector<double>& focal_px, int points = 300) {
  SceneSpec spec{.images = 12, .points = points, .noise_px = 0.3};
  Bundle bundle = MakeBundle(spec);
  Random noise(5);
  std::vector<LensCamera> lenses;
  for (const double f : focal_px) {
    lenses.push_back(spec.lens);
    lenses.back().params[0] = f;
  }
  const auto camera_of = [&](size_t image) { return image % lenses.size(); };
  for (BundleObservation& o : bundle.observations) {
    const auto image = static_cast<size_t>(o.image);
    const auto pixel = lenses[camera_of(image)].PixelFromCam(
        bundle.images[image].cam_from_world *
        bundle.points[static_cast<size_t>(o.point)].head<3>());
    const double x = noise.Normal(), y = noise.Normal();
    o.pixel = *pixel + spec.noise_px * Eigen::Vector2d(x, y);
  }
  SfmModel model = testing::ModelFrom(bundle);
  model.cameras.clear();
  for (size_t k = 0; k < lenses.size(); ++k) {
    LensCamera& camera = model.cameras[static_cast<std::uint32_t>(k + 1)] = lenses[k];
    camera.params[0] *= k % 2 == 0 ? 1.002 : 0.998;
  }
  for (size_t i = 0; i < model.images.size(); ++i) {
    model.images[i].camera_id = static_cast<std::uint32_t>(camera_of(i) + 1);
  }
  return model;
}

TEST(CameraSharing, CamerasOfOneFocalLengthShareIt) {
  const SharedCameras shared = ShareCameras(ModelOfFocals({900, 900}), {2, 1}, {});
  EXPECT_EQ(shared.not_tested, "");
  EXPECT_EQ(shared.groups, (Groups{{1, 2}}));
  ASSERT_EQ(shared.model.cameras.size(), 1u);
  EXPECT_NEAR(shared.model.cameras.at(1).params[0], 900, 1);
  for (const SfmImage& image : shared.model.images) EXPECT_EQ(image.camera_id, 1u);
}

TEST(CameraSharing, CamerasOfDifferentFocalLengthsStaySeparate) {
  for (const double other_px : {640.0, 880.0}) {
    const SfmModel model = ModelOfFocals({900, other_px});
    const SharedCameras shared = ShareCameras(model, {1, 2}, {});
    EXPECT_EQ(shared.groups, (Groups{{1}, {2}})) << other_px;
    EXPECT_LT(shared.separate_px, 0.9 * shared.shared_px) << other_px;
    EXPECT_LT(shared.high_px2, 0) << other_px;
    EXPECT_EQ(shared.model.cameras.at(2).params, model.cameras.at(2).params) << "left as given";
  }
}

TEST(CameraSharing, OfThreeCamerasTheTwoThatAreEqualShare) {
  const SharedCameras shared = ShareCameras(ModelOfFocals({900, 700, 900}), {1, 2, 3}, {});
  EXPECT_EQ(shared.groups, (Groups{{1, 3}, {2}}));
  EXPECT_NEAR(shared.model.cameras.at(1).params[0], 900, 2);
  EXPECT_NEAR(shared.model.cameras.at(2).params[0], 700, 3);
}

TEST(CameraSharing, FewPointsLeaveCamerasSeparateAndSayWhy) {
  const SharedCameras shared = ShareCameras(ModelOfFocals({900, 900}, 60), {1, 2}, {});
  EXPECT_EQ(shared.groups.size(), 2u);
  EXPECT_NE(shared.not_tested.find("points"), std::string::npos) << shared.not_tested;
}

TEST(CameraSharing, AnyNumberOfThreadsGivesTheSameBits) {
  const SfmModel model = ModelOfFocals({900, 900});
  const SharedCameras one = OnThreads(1, [&] { return ShareCameras(model, {1, 2}, {}); });
  const SharedCameras three = OnThreads(3, [&] { return ShareCameras(model, {1, 2}, {}); });
  EXPECT_EQ(one.model.cameras.at(1).params, three.model.cameras.at(1).params);
  EXPECT_EQ(one.shared_px, three.shared_px);
}

}  // namespace
}  // namespace dtr::calib
