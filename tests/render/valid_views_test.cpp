#include "dtr/render/valid_views.h"

#include <gtest/gtest.h>

#include <numbers>

#include "datasets/exact/analytic_scene.h"
#include "dtr/base/error.h"
#include "dtr/render/geometry.h"

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

TEST(CutFactors, FallTowardsTheNextViewAndTheLimit) {
  constexpr double kRound = 1e-9;
  const DtrSet set = Ring({5, -10, 29, 32, 59});
  const RenderScene scene = MakeRenderScene(set);
  RenderOptions options;
  options.views = 3;
  const ViewSelection three = SelectViews(scene, kFront, options);
  // Cut at 32 degrees, factors fall from 24 on.
  const std::vector<double> cut = CutFactors(three, 3);
  EXPECT_EQ(cut[0], 1);
  EXPECT_EQ(cut[1], 1);
  EXPECT_NEAR(cut[2], 3.0 / 8, kRound);
  // As if K were 2: cut at 29 degrees.
  EXPECT_EQ(CutFactors(three, 2), (std::vector<double>{1, 1}));
  EXPECT_NEAR(CutFactors(three, 1)[0], 1, kRound);
  options.views = 8;  // no view is left: the limit of 60 degrees
  const std::vector<double> all = CutFactors(SelectViews(scene, kFront, options), 5);
  EXPECT_EQ(std::vector<double>(all.begin(), all.begin() + 4), (std::vector<double>{1, 1, 1, 1}));
  EXPECT_NEAR(all[4], 1.0 / 15, kRound);
  EXPECT_EQ(CutFactor(0, 0), 1);  // all views in one direction
  EXPECT_EQ(CutFactor(0.5, 0.5), 1.0 / 255);
}

TEST(CutFactors, AViewThatComesInTakesThePlaceOfOneWithoutAJump) {
  constexpr double kStepDeg = 0.05;
  const DtrSet set = Ring({-30, -10, 12, 33});
  const RenderScene scene = MakeRenderScene(set);
  RenderOptions options;
  options.views = 3;
  std::vector<double> last;
  for (double deg = -5; deg < 8; deg += kStepDeg) {
    const Eigen::Vector3d out(std::sin(deg * kDegree), 0, -std::cos(deg * kDegree));
    const ViewSelection selection =
        SelectViews(scene, LookAt(Eigen::Vector3d(0, 0, 10) + 10 * out, {0, 0, 10}), options);
    std::vector<double> factor(4, 0.0);
    const std::vector<double> factors = CutFactors(selection, selection.views.size());
    for (size_t k = 0; k < factors.size(); ++k) {
      factor[static_cast<size_t>(selection.views[k])] = factors[k];
    }
    for (size_t i = 0; i < 4 && !last.empty(); ++i) EXPECT_NEAR(factor[i], last[i], 0.02) << deg;
    last = factor;
  }
}

TEST(SelectViews, MemoryThatHoldsFewerIsASmallerK) {
  const DtrSet set = Ring({5, -10, 29, 32});
  RenderScene scene = MakeRenderScene(set);
  scene.max_views = 2;
  RenderOptions fewer;
  fewer.views = 2;
  const ViewSelection held = SelectViews(scene, kFront, {});
  scene.max_views.reset();
  const ViewSelection expected = SelectViews(scene, kFront, fewer);
  EXPECT_EQ(held.views, expected.views);
  EXPECT_EQ(held.next_angle_rad, expected.next_angle_rad);
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

TEST(MakeRenderScene, RejectsWhatCannotBeDrawn) {
  const DtrSet good = Ring({0, 10});
  const auto rejects = [&](auto change) {
    DtrSet set = good;
    change(set.frames[0].views[1]);
    EXPECT_THROW(MakeRenderScene(set), Error);
  };
  rejects([](View& v) { v.image = ImageRgb8(); });
  rejects([](View& v) { v.image = ImageRgb8(8, 6, 1); });
  rejects([](View& v) { v.depth = DepthImage(); });
  rejects([](View& v) { v.depth = DepthImage(8, 5); });
  rejects([](View& v) { v.depth = DepthImage(8, 6, DepthKind::kRayDistance); });
  rejects([](View& v) { v.mask = Mask(6, 8); });
  rejects([](View& v) { v.cam_from_world.translation.x() = std::nan(""); });
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
  EXPECT_NE(message([](auto& o) { o.views = 0; }).find("`views`"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.delta_px = std::nan(""); }).find("`delta`"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.falloff = -1; }).find("`falloff`"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.max_angle_rad = 4; }).find("`max_angle`"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.point_size = 0; }).find("`point_size`"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.resolution = 0; }).find("`resolution`"), std::string::npos);
}

}  // namespace
}  // namespace dtr
