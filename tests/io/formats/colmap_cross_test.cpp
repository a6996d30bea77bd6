// Files made from COLMAP models: where both are there, they must say the same.
#include <gtest/gtest.h>

#include "calib/colmap/model_io.h"
#include "dtr/io/formats/foreign_depth.h"
#include "dtr/io/formats/llff.h"
#include "tests/io/formats/residuals.h"
#include "tests/support/test_data.h"

namespace dtr::io {
namespace {

TEST(Llff, PosesAreThoseOfTheColmapModelTheyWereMadeFrom) {
  const auto folder = testing::DataFolder() / "beer_colmap_model";
  DTR_REQUIRE_DATA(folder);
  const calib::SfmModel model = colmap::ReadModel(folder / "sparse/0");
  std::vector<SizedImage> images;
  for (const calib::SfmImage& image : model.images) images.push_back({image.name, 720, 1280});
  const CameraList list = ReadLlff(folder / "poses_bounds.npy", images).list;
  ASSERT_EQ(list.cameras.size(), 71u);
  constexpr double kSame = 1e-12;  // both are doubles of one run
  for (size_t i = 0; i < list.cameras.size(); ++i) {
    const Pose& found = list.cameras[i].cam_from_world;
    const Pose& expected = model.images[i].cam_from_world;
    EXPECT_EQ(list.cameras[i].name, model.images[i].name);
    EXPECT_LT((found.TargetOriginInSource() - expected.TargetOriginInSource()).norm(), kSame) << i;
    EXPECT_LT((found.rotation.toRotationMatrix() - expected.rotation.toRotationMatrix()).norm(),
              kSame)
        << i;
  }
}

// OpenMVS puts the first pixel's centre at (0, 0), so its maps lie on our pixels one to one.
TEST(SceauxDense, OpenMvsDepthFitsTheColmapCamerasPixelByPixel) {
  const auto folder = testing::DataFolder() / "sceaux_dense";
  DTR_REQUIRE_DATA(folder);
  const calib::SfmModel model = colmap::ReadModel(folder / "sparse");
  const auto named = [&](size_t i) {
    const calib::SfmImage& image = model.images.at(i);
    NamedCamera camera;
    camera.name = image.name;
    camera.camera = model.cameras.at(image.camera_id).Pinhole();
    camera.cam_from_world = image.cam_from_world;
    return camera;
  };
  const auto depth = [&](const NamedCamera& camera) {
    const auto file = std::filesystem::path(camera.name).replace_extension(".exr");
    return ReadForeignDepth(folder / "depth" / file, DepthKind::kPlaneZ, 1,
                            camera.camera.width_px(), camera.camera.height_px());
  };
  const NamedCamera a = named(4), b = named(5);
  const DepthImage depth_a = depth(a), depth_b = depth(b);
  const auto relative = [&](double slip_px) {
    return testing::CarryDepth(testing::WithShift(a, slip_px, slip_px), depth_a,
                               testing::WithShift(b, slip_px, slip_px), depth_b)
        .median_relative;
  };
  constexpr double kGood = 1.2e-4;        // found: 0.89e-4 of the depth
  constexpr double kHalfPixelOff = 1.05;  // found: 1.12 and 1.18 times as much, either way
  EXPECT_LT(relative(0), kGood);
  EXPECT_GT(relative(0.5), kHalfPixelOff * relative(0));
  EXPECT_GT(relative(-0.5), kHalfPixelOff * relative(0));
}

}  // namespace
}  // namespace dtr::io
