#include "dtr/render/valid_views.h"

#include <gtest/gtest.h>

#include <numbers>

#include "dtr/base/error.h"
#include "dtr/render/geometry.h"
#include "tests/support/analytic_scene.h"

namespace dtr {
namespace {

using namespace dtr::testing;

constexpr double kDegree = std::numbers::pi / 180;

/// Small views at the given angles (degrees) on a circle of radius 10 around (0, 0, 10), looking at
/// its centre or away from it.
DtrSet Ring(const std::vector<double>& angles_deg, bool outwards = false) {
  DtrSet set;
  set.frames.resize(1);
  for (const double angle : angles_deg) {
    View view;
    view.id = view.name = "a" + std::to_string(static_cast<int>(1000 + angle));
    const Eigen::Vector3d out(std::sin(angle * kDegree), 0, -std::cos(angle * kDegree));
    const Eigen::Vector3d target(0, 0, 10), center = target + 10 * out;
    view.camera = PinholeCamera(8, 6, 8, 8, 4, 3);
    view.cam_from_world = LookAt(center, outwards ? center + out : target);
    view.image = ImageRgb8(8, 6, 3, static_cast<std::uint8_t>(angle + 100));
    view.depth = DepthImage(8, 6);
    for (float& z : view.depth.grid().data()) z = 10;
    set.frames[0].views.push_back(view);
  }
  set.scene_center = {0, 0, 10};
  return set;
}

std::vector<std::string> SelectedIds(const DtrSet& set, const Pose& novel,
                                     const RenderOptions& options) {
  const RenderScene scene = MakeRenderScene(set);
  std::vector<std::string> ids;
  for (const int i : SelectViews(scene, novel, options).views) {
    ids.push_back(scene.views[static_cast<size_t>(i)]->id);
  }
  return ids;
}

const Pose kFront = LookAt({0, 0, 0}, {0, 0, 10});

TEST(SelectViews, KeepsTheNearestWithinTheLimit) {
  RenderOptions options;
  options.max_angle_rad = 60 * kDegree;
  EXPECT_EQ(SelectedIds(Ring({-59, 61, 5, 180, -10, 30}), kFront, options),
            (std::vector<std::string>{"a1005", "a990", "a1030", "a941"}));
  options.views = 2;
  EXPECT_EQ(SelectedIds(Ring({-59, 61, 5, 180, -10, 30}), kFront, options),
            (std::vector<std::string>{"a1005", "a990"}));
}

TEST(SelectViews, TiesGoToTheSmallerIdWhateverTheOrder) {
  RenderOptions options;
  options.views = 1;
  EXPECT_EQ(SelectedIds(Ring({20, -20}), kFront, options), std::vector<std::string>{"a1020"});
  EXPECT_EQ(SelectedIds(Ring({-20, 20}), kFront, options), std::vector<std::string>{"a1020"});
}

TEST(SelectViews, NoViewMayBeValid) {
  EXPECT_TRUE(SelectedIds(Ring({100, 180, -90}), kFront, {}).empty());
}

TEST(SelectViews, InsideOutCapturesUseThePerPixelRule) {
  const DtrSet inwards = Ring({0, 90, 180, 270}), outwards = Ring({0, 90, 180, 270}, true);
  EXPECT_FALSE(NeedsPerPixelRule(MakeRenderScene(inwards), kFront));
  EXPECT_TRUE(NeedsPerPixelRule(MakeRenderScene(outwards), kFront));
  // A camera between the views and the centre that looks back at them.
  EXPECT_TRUE(NeedsPerPixelRule(MakeRenderScene(inwards), LookAt({0, 0, 5}, {0, 0, 0})));
  const RenderScene scene = MakeRenderScene(outwards);
  const ViewSelection selection = SelectViews(scene, kFront, {});
  EXPECT_TRUE(selection.per_pixel);
  EXPECT_EQ(selection.views.size(), 4u);
}

TEST(MakeRenderScene, HeldOutAndExcludedViewsAreNotGiven) {
  DtrSet set = Ring({0, 10, 20, 30});
  set.frames[0].views[1].role = ViewRole::kHeldOut;
  set.frames[0].views[2].name = "photo 2.jpg";
  const std::vector<std::string> excluded = {"photo 2.jpg"};
  const RenderScene scene = MakeRenderScene(set, excluded);
  ASSERT_EQ(scene.views.size(), 2u);
  EXPECT_EQ(scene.views[0]->id, "a1000");
  EXPECT_EQ(scene.views[1]->id, "a1030");
  const std::vector<std::string> unknown = {"nobody"};
  EXPECT_THROW(MakeRenderScene(set, unknown), UsageError);
}

TEST(MakeRenderScene, DuplicatesCountOnce) {
  DtrSet set = Ring({0, 10});
  View copy = set.frames[0].views[0];
  copy.id = "z";
  set.frames[0].views.push_back(copy);
  EXPECT_EQ(MakeRenderScene(set).views.size(), 2u);
  set.frames[0].views[2].image(0, 0, 0) ^= 1;
  EXPECT_EQ(MakeRenderScene(set).views.size(), 3u);
}

TEST(MakeRenderScene, RefusesWhatCannotBeDrawn) {
  const DtrSet good = Ring({0, 10});
  const auto refuses = [&](auto change) {
    DtrSet set = good;
    change(set.frames[0].views[1]);
    EXPECT_THROW(MakeRenderScene(set), Error);
  };
  refuses([](View& v) { v.image = ImageRgb8(); });
  refuses([](View& v) { v.image = ImageRgb8(8, 6, 1); });
  refuses([](View& v) { v.depth = DepthImage(); });
  refuses([](View& v) { v.depth = DepthImage(8, 5); });
  refuses([](View& v) { v.depth = DepthImage(8, 6, DepthKind::kRayDistance); });
  refuses([](View& v) { v.mask = Mask(6, 8); });
  refuses([](View& v) { v.cam_from_world.translation.x() = std::nan(""); });
  EXPECT_THROW(MakeRenderScene(DtrSet{}), Error);
}

TEST(ThresholdsOf, ArePixelsOfDisparityAtTheReferenceBaseline) {
  DtrSet set = Ring({0});
  View& view = set.frames[0].views[0];
  RenderOptions options;
  options.delta_px = 2;
  view.reference_baseline = 0.5;
  EXPECT_DOUBLE_EQ(ThresholdsOf(view, options).delta, 2 / (8 * 0.5));
  view.reference_baseline = 0;  // a lone camera: a tenth of its median depth
  EXPECT_DOUBLE_EQ(ThresholdsOf(view, options).delta, 2 / (8 * 1.0));
}

TEST(CheckRenderOptions, NamesTheOptionThatHasNoMeaning) {
  const auto message = [](auto change) -> std::string {
    RenderOptions options;
    change(options);
    try {
      CheckRenderOptions(options);
    } catch (const UsageError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message([](RenderOptions&) {}), "");
  EXPECT_NE(message([](auto& o) { o.views = 0; }).find("--views"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.delta_px = std::nan(""); }).find("--delta"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.falloff = -1; }).find("--falloff"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.max_angle_rad = 4; }).find("--max-angle"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.point_size = 0; }).find("--point-size"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.resolution = 0; }).find("--resolution"), std::string::npos);
}

}  // namespace
}  // namespace dtr
