#include "dtr/eval/bench.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "dtr/base/error.h"
#include "dtr/eval/bench_json.h"
#include "dtr/eval/growth.h"
#include "dtr/render/valid_views.h"
#include "tests/eval/clockwork.h"
#include "tests/support/noted_lines.h"

namespace dtr::eval {
namespace {

using ::testing::ElementsAre;

using testing::Clockwork;
using testing::Planes;

TEST(TimesOf, HandWorkedMedianAndInterquartileRange) {
  const Times odd = TimesOf({5, 1, 4, 2, 3});
  EXPECT_DOUBLE_EQ(odd.median_ms, 3);
  EXPECT_DOUBLE_EQ(odd.spread_ms, 2);
  const Times even = TimesOf({1, 2, 3, 10});
  EXPECT_DOUBLE_EQ(even.median_ms, 2.5);
  EXPECT_DOUBLE_EQ(even.spread_ms, 4.75 - 1.75);
  EXPECT_EQ(TimesOf({7}).spread_ms, 0);
  EXPECT_THROW(TimesOf({}), std::invalid_argument);
}

TEST(MeasureReportTable, HasARowForEveryResolutionNumberOfViewsAndMethod) {
  SilentProgress progress;
  BenchOptions options;
  options.repeats = 3;
  Clockwork clockwork(false);
  const BenchReport report = MeasureReportTable(Planes(9, true), options, clockwork, progress);
  EXPECT_EQ(report.views_in_set, 9);
  EXPECT_FALSE(report.left_out);
  EXPECT_THAT(report.cameras, ElementsAre("v9"));
  std::vector<std::tuple<int, int, RenderMethod>> rows;
  for (const BenchRow& row : report.rows) {
    rows.emplace_back(row.resolution, row.views_used, row.method);
    const double cpu_ms = (row.method == RenderMethod::kDeferred ? 10.0 : 120.0) * row.views_used /
                          (row.resolution * row.resolution);
    EXPECT_DOUBLE_EQ(row.cpu.median_ms, cpu_ms);
    EXPECT_DOUBLE_EQ(row.frame.median_ms, 2 * cpu_ms);  // no GPU clock: the wall's
    EXPECT_DOUBLE_EQ(row.fps(), 1000 / (2 * cpu_ms));
    EXPECT_EQ(row.frame.spread_ms, 0);
    EXPECT_EQ(row.coverage, 1);
  }
  std::vector<std::tuple<int, int, RenderMethod>> expected;
  for (const int resolution : {1, 2}) {
    for (const int views : {3, 5, 6, 8, 9}) {
      expected.emplace_back(resolution, views, RenderMethod::kTwoPass);
      expected.emplace_back(resolution, views, RenderMethod::kDeferred);
    }
  }
  EXPECT_EQ(rows, expected);
  ASSERT_TRUE(report.comparison.has_value());
  EXPECT_EQ(report.comparison->views_used, 8);
  EXPECT_EQ(report.comparison->resolution, 1);
  EXPECT_DOUBLE_EQ(report.comparison->ratio_two_pass_over_deferred, 12);
  EXPECT_NEAR(*report.comparison->loss_db, 20 * std::log10(5.0), 1e-9);  // 2 levels off against 10
}

TEST(MeasureReportTable, TheMethodsTakeTurnsAfterUntimedFrames) {
  SilentProgress progress;
  BenchOptions options;
  options.repeats = 2;
  options.views = {4};
  options.resolutions = {1};
  options.timed_camera = [](const PinholeCamera& camera) { return camera.Resized(20, 15); };
  Clockwork clockwork(false);
  const BenchReport report = MeasureReportTable(Planes(9, true), options, clockwork, progress);
  using enum RenderMethod;
  EXPECT_THAT(clockwork.methods, ElementsAre(kTwoPass, kTwoPass, kDeferred, kDeferred,  // untimed
                                             kTwoPass, kDeferred, kTwoPass, kDeferred));
  // Quality at the photo's size, time at the one asked for.
  EXPECT_THAT(clockwork.widths, ElementsAre(80, 20, 80, 20, 20, 20, 20, 20));
  EXPECT_EQ(report.width_px, 20);
  EXPECT_TRUE(report.rows[0].psnr_db.has_value());
}

TEST(MeasureReportTable, WithoutHeldOutPhotosEachCameraIsLeftOutOfItsOwnPicture) {
  SilentProgress progress;
  BenchOptions options;
  options.repeats = 1;
  options.cameras = 3;
  Clockwork clockwork(true);
  const BenchReport report = MeasureReportTable(Planes(6, false), options, clockwork, progress);
  EXPECT_TRUE(report.left_out);
  EXPECT_EQ(report.views_in_set, 5);
  EXPECT_THAT(report.cameras, ElementsAre("v1", "v3", "v5"));
  EXPECT_THAT(clockwork.views_in_scene, ::testing::Each(5));
  EXPECT_DOUBLE_EQ(report.rows[0].frame.median_ms, 120.0 * 3 / 100);  // the GPU's clock
  EXPECT_THROW(MeasureReportTable(Planes(1, false), options, clockwork, progress), UsageError);
}

TEST(MeasureReportTable, EndsARowBlockWhenMoreViewsAreNotValid) {
  SilentProgress progress;
  BenchOptions options;
  options.repeats = 1;
  options.views = {2, 7, 20};
  options.resolutions = {1};
  Clockwork clockwork(false);
  const BenchReport report = MeasureReportTable(Planes(4, true), options, clockwork, progress);
  ASSERT_EQ(report.rows.size(), 4u);
  EXPECT_EQ(report.rows.back().views_used, 4);
}

TEST(MeasureReportTable, SaysWhyThereAreNoMoreRows) {
  BenchOptions options;
  options.repeats = 1;
  options.views = {3, 5, 6, 8};
  options.resolutions = {2};
  const BenchMachine machine{"cpu", 2, "clockwork", "0.1.0", "wall"};
  for (const bool memory : {true, false}) {
    dtr::testing::NotedLines listener;
    Clockwork clockwork(false);
    if (memory) clockwork.room_for_views = 4;
    const BenchReport report =
        MeasureReportTable(Planes(memory ? 9 : 4, true), options, clockwork, listener);
    ASSERT_EQ(report.rows.size(), 4u);  // of 3 views, and of the 4 that there are
    ASSERT_EQ(report.ends.size(), 1u);
    EXPECT_EQ(report.ends[0].views_used, 4);
    EXPECT_EQ(report.ends[0].views_asked, 5);
    EXPECT_EQ(report.ends[0].for_memory, memory);
    ASSERT_THAT(listener.lines, ::testing::SizeIs(1));
    EXPECT_THAT(listener.lines[0],
                ::testing::HasSubstr(memory ? "memory holds only 4 of them; give `gpu_memory`"
                                            : "only 4 are valid here"));
    const auto json = nlohmann::json::parse(ToJson("report", report, machine));
    EXPECT_EQ(json["ends"][0]["reason"], memory ? "memory" : "valid views");
  }
  dtr::testing::NotedLines listener;
  Clockwork clockwork(false);
  EXPECT_TRUE(MeasureReportTable(Planes(9, true), options, clockwork, listener).ends.empty());
  EXPECT_TRUE(listener.lines.empty());
}

TEST(MeasureWeightTable, HasARowForEveryNumberOfViewsWeightAndMethod) {
  SilentProgress progress;
  BenchOptions options;
  options.repeats = 1;
  options.render.falloff = 5;
  Clockwork clockwork(false);
  const BenchReport report = MeasureWeightTable(Planes(6, true), options, clockwork, progress);
  ASSERT_EQ(report.rows.size(), 4u * 5 * 2);  // 1, 2, 4 and, of 8, the 6 that there are
  for (size_t i = 0; i < report.rows.size(); ++i) {
    const BenchRow& row = report.rows[i];
    EXPECT_EQ(row.method, i % 2 == 0 ? RenderMethod::kTwoPass : RenderMethod::kDeferred);
    EXPECT_EQ(row.blend, static_cast<BlendWeight>(i / 2 % 5));
    EXPECT_EQ(row.views_used, std::vector({1, 2, 4, 6})[i / 10]);
    EXPECT_DOUBLE_EQ(row.cpu.median_ms, (i % 2 == 0 ? 120.0 : 10.0) * row.views_used);
    EXPECT_TRUE(row.psnr_db.has_value());
  }
  EXPECT_EQ(report.ends.size(), 1u);
  EXPECT_THAT(clockwork.blends, ::testing::SizeIs(::testing::Ge(5u)));
  const auto json =
      nlohmann::json::parse(ToJson("weights", report, {"cpu", 2, "clockwork", "0.1.0", "wall"}));
  EXPECT_EQ(json["table"], "weights");
  EXPECT_EQ(json["rows"][0]["blend"], "cosine");
  EXPECT_EQ(json["rows"][7]["blend"], "inverse-angle");
  EXPECT_EQ(json["rows"][9]["blend"], "k-nearest");
}

TEST(MeasureGrowth, HandWorkedSeries) {
  SilentProgress progress;
  const DtrSet set = Planes(6, false);
  const View& first = set.frames[0].views[0];
  GrowthOptions options;
  options.repeats = 2;
  Clockwork clockwork(false);
  const auto series =
      MeasureGrowth(set, {first.camera, first.cam_from_world}, options, clockwork, progress);
  ASSERT_EQ(series.size(), 3u);
  EXPECT_EQ(series[0].axis, "views_used");
  EXPECT_EQ(series[0].rows.size(), 3u);           // 1, 2 and 4 of 6
  EXPECT_DOUBLE_EQ(series[0].worst_growth, 1.0);  // the clockwork is linear in the views
  EXPECT_EQ(series[1].axis, "pixels");
  ASSERT_EQ(series[1].rows.size(), 5u);
  EXPECT_DOUBLE_EQ(series[1].rows[4].value, 1e-6 * 160 * 120);
  EXPECT_EQ(series[2].axis, "views_in_set");
  std::vector<double> sizes;
  for (const GrowthRow& row : series[2].rows) sizes.push_back(row.value);
  EXPECT_THAT(sizes, ElementsAre(4, 16, 64, 256));
  EXPECT_DOUBLE_EQ(series[2].worst_growth, 1.0);
}

/// As Clockwork, and keeps the views that SelectViews would draw.
class Selector final : public TimedRenderer {
 public:
  std::string Description() const override { return "selector"; }
  bool HasGpuClock() const override { return false; }
  FrameTime Draw(const RenderScene& scene, const PinholeCamera&, const Pose& novel_from_world,
                 const RenderOptions& options) override {
    std::vector<std::string> names;
    for (const int i : SelectViews(scene, novel_from_world, options).views) {
      names.push_back(scene.views[static_cast<size_t>(i)]->id);
    }
    selected[static_cast<int>(scene.views.size())] = names;
    return {1, 1, std::nullopt};
  }
  RenderResult ReadBack() override { return {}; }
  std::map<int, std::vector<std::string>> selected;
};

TEST(MeasureGrowth, AnySizeOfSetDrawsFromTheSameFourViews) {
  SilentProgress progress;
  const DtrSet set = Planes(6, false);
  const View& first = set.frames[0].views[0];
  Selector selector;
  MeasureGrowth(set, {first.camera, first.cam_from_world}, {{}, 1}, selector, progress);
  ASSERT_TRUE(selector.selected.contains(256));
  EXPECT_EQ(selector.selected[256].size(), 4u);
  EXPECT_EQ(selector.selected[256], selector.selected[4]);
  EXPECT_EQ(selector.selected[64], selector.selected[4]);
}

TEST(MeasureGrowth, ThePerPixelRuleDrawsNoCopiesWithoutPixels) {
  DtrSet set = Planes(6, false);
  set.scene_center = {1, 0, -10};  // behind every camera
  const View& first = set.frames[0].views[0];
  dtr::testing::NotedLines listener;
  Selector selector;
  const auto series =
      MeasureGrowth(set, {first.camera, first.cam_from_world}, {{}, 1}, selector, listener);
  std::vector<double> sizes;
  for (const GrowthRow& row : series[2].rows) sizes.push_back(row.value);
  EXPECT_THAT(sizes, ElementsAre(4, 6));
  for (const auto& [views, selected] : selector.selected) {
    EXPECT_EQ(selected.size(), static_cast<size_t>(views));
    for (const std::string& id : selected) EXPECT_EQ(id.substr(0, 1), "v");
  }
  ASSERT_THAT(listener.lines, ::testing::SizeIs(1));
  EXPECT_THAT(listener.lines[0], ::testing::HasSubstr("per-pixel rule"));
}

// Photos of one level that the renderer hits have no error, and nothing of it is NaN.
TEST(BenchJson, ImagesThatEqualThePhotosAreIdenticalAndLoseNothing) {
  SilentProgress progress;
  BenchOptions options;
  options.repeats = 1;
  options.views = {3};
  options.resolutions = {1};
  DtrSet set = Planes(9, true);
  for (View& view : set.frames[0].views) std::ranges::fill(view.image.data(), std::uint8_t{102});
  for (const int deferred_level : {102, 110}) {
    Clockwork clockwork(false);
    clockwork.deferred_level = static_cast<std::uint8_t>(deferred_level);
    const BenchReport report = MeasureReportTable(set, options, clockwork, progress);
    const auto json =
        nlohmann::json::parse(ToJson("report", report, {"cpu", 2, "clockwork", "0.1.0", "wall"}));
    EXPECT_TRUE(json["rows"][0]["psnr_db"].is_null());
    EXPECT_THAT(json["rows"][0]["identical"], ElementsAre("psnr_db", "psnr_covered_db"));
    if (deferred_level == 102) {
      EXPECT_EQ(report.comparison->loss_db, 0);
      EXPECT_EQ(json["loss_db"], 0);
    } else {
      EXPECT_TRUE(json["rows"][1]["identical"].empty());
      EXPECT_TRUE(std::isinf(*report.comparison->loss_db));
    }
  }
  EXPECT_FALSE(LossDb(std::nullopt, 30).has_value());
}

TEST(BenchJson, NamesAreTheInterface) {
  SilentProgress progress;
  BenchOptions options;
  options.repeats = 1;
  options.views = {3};
  options.resolutions = {2};
  Clockwork clockwork(false);
  const BenchReport report = MeasureReportTable(Planes(9, true), options, clockwork, progress);
  const BenchMachine machine{"cpu", 2, "llvmpipe", "0.1.0", "wall"};
  const auto json = nlohmann::json::parse(ToJson("report", report, machine));
  for (const char* name : {"rows", "ratio_two_pass_over_deferred", "loss_db", "machine"}) {
    EXPECT_TRUE(json.contains(name)) << name;
  }
  ASSERT_EQ(json["rows"].size(), 2u);
  const auto& row = json["rows"][0];
  for (const char* name : {"method", "views_in_set", "views_used", "resolution", "ms", "fps",
                           "psnr_db", "cpu_ms", "spread_ms"}) {
    EXPECT_TRUE(row.contains(name)) << name;
  }
  EXPECT_EQ(row["blend"], "inverse-angle");
  EXPECT_EQ(row["method"], "two-pass");
  EXPECT_EQ(json["rows"][1]["method"], "deferred");
  EXPECT_DOUBLE_EQ(json["ratio_two_pass_over_deferred"], 12);
  for (const char* name : {"cpu", "renderer", "version", "clock"}) {
    EXPECT_TRUE(json["machine"].contains(name)) << name;
  }
  const auto growth = nlohmann::json::parse(
      ToJson({{"pixels", {{0.5, {2, 1}, {3, 1}}}, 1.5}}, RenderMethod::kDeferred, machine));
  EXPECT_EQ(growth["method"], "deferred");
  EXPECT_EQ(growth["series"][0]["axis"], "pixels");
  EXPECT_EQ(growth["series"][0]["rows"][0]["cpu_ms"], 3);
}

}  // namespace
}  // namespace dtr::eval
