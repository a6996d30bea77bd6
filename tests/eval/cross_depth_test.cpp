#include "dtr/eval/cross_depth.h"

#include <gtest/gtest.h>

#include <atomic>

#include "dtr/base/error.h"
#include "tests/eval/plane_views.h"
#include "tests/support/on_threads.h"

namespace dtr::eval {
namespace {

using testing::PlaneView;

// Depth is float32: 6e-8 relative of a disparity of 90 px * 1 / 10, times the way back; 1.3e-6
// seen.
constexpr double kExactPx = 1e-5;

std::vector<const View*> Pointers(const std::vector<View>& views) {
  std::vector<const View*> pointers;
  for (const View& view : views) pointers.push_back(&view);
  return pointers;
}

std::vector<View> FourViews(bool with_square, int depth_scale = 1) {
  return {PlaneView(-1, -0.05, with_square, depth_scale), PlaneView(0, 0.02, with_square, 1),
          PlaneView(1, 0.06, with_square, depth_scale), PlaneView(2, 0.15, with_square, 1)};
}

TEST(CrossDepth, ExactDepthOfAPlaneReturnsToWhereItCameFrom) {
  for (const int depth_scale : {1, 2}) {  // maps of different scale take part together
    const std::vector<View> views = FourViews(false, depth_scale);
    const CrossDepthReport report = CrossDepth(Pointers(views));
    EXPECT_TRUE(report.passed());
    EXPECT_GT(report.all.compared, 10000);
    EXPECT_EQ(report.all.occluded, 0);
    EXPECT_EQ(report.all.contradicted, 0);
    EXPECT_LT(report.all.p95_px, kExactPx);
  }
}

TEST(CrossDepth, AnOccluderIsNoContradiction) {
  const std::vector<View> views = FourViews(true);
  const CrossDepthReport report = CrossDepth(Pointers(views));
  EXPECT_TRUE(report.passed());
  EXPECT_GT(report.all.occluded, 1000);
  EXPECT_EQ(report.all.contradicted, 0);
}

TEST(CrossDepth, AShiftedDepthIsMeasuredInPixels) {
  // View 1 says 9 where 10 is true (constant: the yaw is small). Between cameras 1 apart the round
  // trip errs by about 90 * |1/9 - 1/10| = 1 px per unit of baseline.
  std::vector<View> views = {PlaneView(0, 0, false), PlaneView(1, 0, false)};
  for (float& z : views[1].depth.grid().data()) z = 1 / (1 / z + 2.0f / 90);
  const CrossDepthReport report = CrossDepth(Pointers(views));
  EXPECT_NEAR(report.all.median_px, 2.0, 0.25);  // the way back starts from the shifted point
  EXPECT_FALSE(report.passed());
}

TEST(CrossDepth, ViewsOfOnePointDoNotTestEachOther) {
  // Without parallax any depth returns to where it came from: five views of one point, as of a
  // panorama, would hide a depth that is wrong in all of them from the one beside them.
  std::vector<View> views;
  for (const double yaw : {0.0, 0.01, 0.02, -0.01, -0.02}) {
    views.push_back(PlaneView(0, yaw, false));
    for (float& z : views.back().depth.grid().data()) z = 1 / (1 / z + 2.0f / 90);
  }
  views.push_back(PlaneView(1, 0, false));
  CrossDepthOptions options;
  options.scene_center = Eigen::Vector3d(0, 0, 10);
  const CrossDepthReport report = CrossDepth(Pointers(views), options);
  EXPECT_FALSE(report.passed());
  EXPECT_GT(report.views[0].p95_px, 1);
}

TEST(CrossDepth, AWrongPoseFails) {
  std::vector<View> views = FourViews(false);
  views[2].cam_from_world.translation.z() += 4;  // along the plane nothing would change
  const CrossDepthReport report = CrossDepth(Pointers(views));
  EXPECT_FALSE(report.passed());
}

TEST(CrossDepth, HolesAndNoOverlapAreNoEvidence) {
  std::vector<View> views = {PlaneView(0, 0, false), PlaneView(1, 0, false)};
  for (float& z : views[1].depth.grid().data()) z = 0;
  const CrossDepthReport report = CrossDepth(Pointers(views));
  EXPECT_EQ(report.all.compared, 0);
  EXPECT_FALSE(report.passed());
  views[1].depth = DepthImage();
  EXPECT_THROW(CrossDepth(Pointers(views)), Error);
  views[1].depth = DepthImage(79, 60);
  EXPECT_THROW(CrossDepth(Pointers(views)), Error);
}

TEST(CrossDepth, MapsThatAreBroughtAsMemoryAllowsGiveTheSameFigures) {
  std::vector<View> views;
  for (int i = 0; i < 12; ++i) {  // neighbours far apart in the list: maps must come again
    const int at = 5 * i % 12;
    views.push_back(PlaneView(0.5 * at, 0.01 * at, true));
  }
  CrossDepthOptions options;
  const CrossDepthReport all = CrossDepth(Pointers(views), options);
  std::vector<View> bare = views;
  for (View& view : bare) view.depth = DepthImage();
  std::atomic<int> brought = 0;
  const DepthLoader load = [&](const View& view) {
    ++brought;
    for (const View& full : views) {
      if (full.name == view.name) return full.depth;
    }
    return DepthImage();
  };
  options.memory_bytes = 6 * 80 * 60 * sizeof(float);
  const CrossDepthReport few = CrossDepth(Pointers(bare), options, load);
  EXPECT_GT(brought, 12);
  EXPECT_EQ(few.all.median_px, all.all.median_px);
  EXPECT_EQ(few.all.compared, all.all.compared);
  EXPECT_EQ(few.views[7].p95_px, all.views[7].p95_px);
  // All at once: every map once.
  brought = 0;
  options.memory_bytes = size_t{1} << 30;
  EXPECT_EQ(CrossDepth(Pointers(bare), options, load).all.p95_px, all.all.p95_px);
  EXPECT_EQ(brought, 12);
}

TEST(CrossDepth, SameFiguresForAnyNumberOfThreads) {
  const std::vector<View> views = FourViews(true);
  CrossDepthOptions options;
  options.scene_center = Eigen::Vector3d(0, 0, 10);
  const auto figures = [&] { return CrossDepth(Pointers(views), options); };
  const CrossDepthReport a = OnThreads(1, figures), b = OnThreads(3, figures);
  EXPECT_EQ(a.all.median_px, b.all.median_px);
  EXPECT_EQ(a.all.p95_px, b.all.p95_px);
  EXPECT_EQ(a.all.compared, b.all.compared);
}

}  // namespace
}  // namespace dtr::eval
