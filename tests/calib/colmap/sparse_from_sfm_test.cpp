#include "calib/sparse_from_sfm.h"

#include <gtest/gtest.h>

#include "calib/colmap/export.h"
#include "calib/colmap/model_io.h"
#include "dtr/base/error.h"
#include "tests/calib/colmap/model_test_support.h"
#include "tests/support/test_data.h"

namespace dtr::calib {
namespace {

constexpr double kExactPx = 1e-9;  // double arithmetic on pixels of some hundreds

// Two views with a lens, a point each sees and one that only the second and third see.
SfmModel ThreeViews() {
  SfmModel model;
  model.cameras[1] = {CameraModel::kSimpleRadial, 640, 480, {500, 320, 240, 0.1}};
  model.points[5] = {{0.5, 0.25, 5}, {}, 0};
  model.points[9] = {{-0.5, 0.5, 4}, {}, 0};
  for (std::uint32_t i = 0; i < 3; ++i) {
    SfmImage image;
    image.id = i + 1;
    image.name = std::string(1, static_cast<char>('a' + i));
    image.camera_id = 1;
    image.cam_from_world.translation = {0.1 * i, 0, 0};
    for (const auto& [id, point] : model.points) {
      if (id == 9 && i == 0) continue;
      const auto pixel =
          model.cameras[1].PixelFromCam(image.cam_from_world * point.p_in_world).value();
      image.features.push_back({pixel, id});
      image.features.push_back({pixel + Eigen::Vector2d(3, 3), id});  // a second one: left out
    }
    image.features.push_back({{10, 10}, SfmFeature::kNoPoint});
    model.images.push_back(image);
  }
  return model;
}

TEST(ToSparseScene, PutsObservationsOnTheUndistortedGrids) {
  const SfmModel model = ThreeViews();
  // The grids: full size, half size, full size.
  const PinholeCamera full(640, 480, 500, 500, 320, 240);
  const std::vector<PinholeCamera> grids = {full, full.Resized(320, 240), full};
  const std::vector<std::string> names = {"a", "b", "c"};
  const SparseScene scene = ToSparseScene(model, names, grids);
  ASSERT_EQ(scene.points.size(), 2u);
  ASSERT_EQ(scene.observations.size(), 5u);
  for (size_t i = 0; i < scene.observations.size(); ++i) {
    const auto& seen = scene.observations[i];
    const auto view = static_cast<size_t>(seen.view);
    const auto expected =
        grids[view].PixelFromCam(model.images[view].cam_from_world *
                                 scene.points[static_cast<size_t>(seen.point)].p_in_world);
    // The lens inversion is iterative; its own tests hold it to 1e-9 px at this distortion.
    EXPECT_NEAR((seen.pixel - *expected).norm(), 0, 1e-6) << i;
    if (i > 0) {
      const auto& before = scene.observations[i - 1];
      EXPECT_LT(std::pair(before.view, before.point), std::pair(seen.view, seen.point));
    }
  }
}

TEST(ToSparseScene, PointsThatFewerThanTwoListedViewsSeeAreDropped) {
  const SfmModel model = ThreeViews();
  const std::vector<PinholeCamera> grids(2, model.cameras.at(1).Pinhole());
  const std::vector<std::string> names = {"c", "a"};  // any order; indices follow it
  const SparseScene scene = ToSparseScene(model, names, grids);
  ASSERT_EQ(scene.points.size(), 1u);
  EXPECT_EQ(scene.points[0].p_in_world, model.points.at(5).p_in_world);
  ASSERT_EQ(scene.observations.size(), 2u);
  EXPECT_GT(scene.observations[0].pixel.x(), scene.observations[1].pixel.x() + 10);
}

TEST(ToSparseScene, WorldOriginIsSubtracted) {
  const SfmModel model = ThreeViews();
  const std::vector<PinholeCamera> grids(2, model.cameras.at(1).Pinhole());
  const std::vector<std::string> names = {"a", "b"};
  const auto scene = ToSparseScene(model, names, grids, {0.5, 0, 1});
  EXPECT_EQ(scene.points[0].p_in_world, Eigen::Vector3d(0, 0.25, 4));
}

TEST(ToSparseScene, NamesThatDoNotFitAreRejected) {
  const SfmModel model = ThreeViews();
  const std::vector<PinholeCamera> grids(2, model.cameras.at(1).Pinhole());
  EXPECT_THROW(ToSparseScene(model, std::vector<std::string>{"a", "z"}, grids), Error);
  EXPECT_THROW(ToSparseScene(model, std::vector<std::string>{"a", "a"}, grids), Error);
  EXPECT_THROW(ToSparseScene(model, std::vector<std::string>{"a"}, grids), std::invalid_argument);
}

DtrSet TwoViewSet() {
  DtrSet set;
  set.world_origin = {5e5, 4.5e6, 100};
  set.frames.resize(1);
  for (int i = 0; i < 2; ++i) {
    View view;
    view.id = view.name = i == 0 ? "b.jpg" : "a.jpg";
    view.camera = PinholeCamera(64, 48, 50, 50, 32, 24);
    view.cam_from_world.translation = {0.1 * i, 0, 0};
    view.image = ImageRgb8(64, 48, 3, static_cast<std::uint8_t>(100 + 50 * i));
    set.frames[0].views.push_back(view);
  }
  return set;
}

TEST(ModelFromViews, AddsTheWorldOriginAndSurvivesTheFiles) {
  const DtrSet set = TwoViewSet();
  SparseScene scene;
  scene.points = {{{0.25, 0.5, 5}}, {{0, 0, 4}}};
  scene.observations = {{0, 0, {34.5, 29}}, {1, 0, {36.5, 29}}};
  const SfmModel model =
      colmap::ModelFromViews(set, scene, [](const View& view) { return view.image; });
  ASSERT_EQ(model.images.size(), 2u);
  EXPECT_EQ(model.images[0].name, "a.jpg");
  EXPECT_EQ(model.cameras.size(), 1u);
  EXPECT_EQ(model.cameras.at(1).params, (std::vector<double>{50, 50, 32, 24}));
  const SfmPoint& point = model.points.at(1);
  EXPECT_EQ(point.p_in_world, Eigen::Vector3d(5e5 + 0.25, 4.5e6 + 0.5, 105));
  EXPECT_EQ(point.rgb[0], 125);
  EXPECT_EQ(colmap::ModelFromViews(set, scene).points.at(1).rgb[0], 0);
  EXPECT_NEAR(point.error_px, 0.5, kExactPx);  // 0 in b.jpg, 1 px in a.jpg
  // kilometres from the origin, rounding in double is 1e-9 of a unit: far below a pixel
  const auto p_in_cam = model.images[0].cam_from_world * point.p_in_world;
  EXPECT_NEAR((p_in_cam - Eigen::Vector3d(0.35, 0.5, 5)).norm(), 0, 1e-8);

  const dtr::testing::TemporaryFolder folder;
  colmap::WriteModel(folder / "m", model, colmap::Format::kText);
  colmap::testing::ExpectSame(model, colmap::ReadModel(folder / "m"));
}

TEST(ModelFromViews, ScenesAndSetsThatDoNotFitAreRejected) {
  DtrSet set = TwoViewSet();
  SparseScene scene;
  scene.observations = {{0, 0, {1, 1}}};
  EXPECT_THROW(colmap::ModelFromViews(set, scene), std::invalid_argument);
  set.frames[0].views[1].name = "b.jpg";
  EXPECT_THROW(colmap::ModelFromViews(set, {}), Error);
  set.frames.clear();
  EXPECT_THROW(colmap::ModelFromViews(set, {}), Error);
}

}  // namespace
}  // namespace dtr::calib
