#include "dtr/eval/held_out.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <mutex>
#include <nlohmann/json.hpp>

#include "dtr/base/error.h"
#include "dtr/eval/json.h"
#include "tests/eval/plane_views.h"

namespace dtr::eval {
namespace {

using ::testing::ElementsAre;

/// Three source views and one held-out view; images are grey, level 100 + 10 * index.
DtrSet SmallSet() {
  DtrSet set;
  set.frames.resize(1);
  for (int i = 0; i < 4; ++i) {
    View view = testing::PlaneView(i, 0, false);
    view.name = "photo " + std::to_string(i) + ".jpg";
    view.id = "photo_" + std::to_string(i);
    view.reference_baseline = 1;
    view.image = ImageRgb8(80, 60, 3, static_cast<std::uint8_t>(100 + 10 * i));
    set.frames[0].views.push_back(std::move(view));
  }
  View& held_out = set.frames[0].views[1];
  held_out.role = ViewRole::kHeldOut;
  held_out.depth = DepthImage();
  set.scene_center = {1, 0, 10};
  return set;
}

/// A renderer that paints a level, sees all but the left quarter, and fills it 8 levels off.
RenderFunction Painter(std::uint8_t level,
                       std::vector<std::vector<std::string>>* scenes = nullptr) {
  return [=](const RenderScene& scene, const PinholeCamera& novel, const Pose&,
             const RenderOptions& options) {
    EXPECT_TRUE(options.fill_holes);
    if (scenes != nullptr) {
      scenes->emplace_back();
      for (const View* view : scene.views) scenes->back().push_back(view->id);
    }
    RenderResult result;
    result.image = ImageRgb8(novel.width_px(), novel.height_px(), 3, level);
    result.coverage = Mask(novel.width_px(), novel.height_px(), 1, 255);
    result.views_used = {0, 1};
    for (int y = 0; y < novel.height_px(); ++y) {
      for (int x = 0; x < novel.width_px() / 4; ++x) {
        result.coverage(x, y) = 0;
        for (int c = 0; c < 3; ++c) result.image(x, y, c) = static_cast<std::uint8_t>(level + 8);
      }
    }
    return result;
  };
}

TEST(EvaluateHeldOut, HandWorkedFigures) {
  SilentProgress progress;
  std::vector<std::vector<std::string>> scenes;
  EvaluateOptions options;
  options.not_registered = {"lost.jpg"};
  const EvaluationReport report =
      EvaluateHeldOut(SmallSet(), options, Painter(114, &scenes), progress);  // the photo is 110
  ASSERT_EQ(report.views.size(), 1u);
  const ViewScore& score = report.views[0];
  EXPECT_EQ(score.name, "photo 1.jpg");
  EXPECT_DOUBLE_EQ(score.coverage, 0.75);
  EXPECT_NEAR(*score.psnr_covered_db, 10 * std::log10(255.0 * 255 / 16), 1e-9);
  // Whole frame: a quarter is off by 12, the rest by 4: MSE 0.75 * 16 + 0.25 * 144 = 48.
  EXPECT_NEAR(*score.psnr_db, 10 * std::log10(255.0 * 255 / 48), 1e-9);
  EXPECT_GT(*score.ssim, 0.9);
  EXPECT_EQ(score.views_used, 2);
  EXPECT_THAT(report.not_registered, ElementsAre("lost.jpg"));
  // The held-out view itself is never given to the renderer.
  EXPECT_THAT(scenes[0], ElementsAre("photo_0", "photo_2", "photo_3"));
}

TEST(EvaluateHeldOut, LeavingOneOutRendersEachSourceViewFromTheOthers) {
  SilentProgress progress;
  std::vector<std::vector<std::string>> scenes;
  EvaluateOptions options;
  options.leave_one_out = true;
  std::vector<std::string> looked_at;
  std::mutex mutex;
  options.on_rendered = [&](const View& view, const RenderResult&) {
    const std::lock_guard lock(mutex);
    looked_at.push_back(view.id);
  };
  const EvaluationReport report =
      EvaluateHeldOut(SmallSet(), options, Painter(120, &scenes), progress);
  ASSERT_EQ(report.views.size(), 3u);
  EXPECT_THAT(scenes,
              ElementsAre(ElementsAre("photo_2", "photo_3"), ElementsAre("photo_0", "photo_3"),
                          ElementsAre("photo_0", "photo_2")));
  EXPECT_THAT(looked_at, ::testing::UnorderedElementsAre("photo_0", "photo_2", "photo_3"));
  const double first = *report.views[0].psnr_db, third = *report.views[2].psnr_db;
  EXPECT_NEAR(*report.mean.psnr_db, (first + *report.views[1].psnr_db + third) / 3, 1e-9);
}

TEST(EvaluateHeldOut, MaskedPixelsOfThePhotoNeverCount) {
  SilentProgress progress;
  DtrSet set = SmallSet();
  View& view = set.frames[0].views[1];
  view.mask = Mask(80, 60, 1, 255);
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 20; ++x) view.mask(x, y) = 0;  // exactly the part the painter does not see
  }
  const EvaluationReport report = EvaluateHeldOut(set, {}, Painter(114), progress);
  EXPECT_DOUBLE_EQ(report.views[0].coverage, 1.0);
  EXPECT_DOUBLE_EQ(*report.views[0].psnr_db, *report.views[0].psnr_covered_db);
}

TEST(EvaluateHeldOut, TheValidAreaIsWhereTheLeftOutViewHasDepth) {
  SilentProgress progress;
  DtrSet set = SmallSet();
  View& view = set.frames[0].views[0];  // its photo is 100
  view.depth_scale = 2;
  view.depth = DepthImage(40, 30);
  // Depth in the quarter that the painter does not see, and as much beside it.
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 20; ++x) view.depth(x, y) = 10;
  }
  EvaluateOptions options;
  options.leave_one_out = true;
  const EvaluationReport report = EvaluateHeldOut(set, options, Painter(104), progress);
  // Half of the area is filled 12 off, half is seen 4 off: MSE (144 + 16) / 2 = 80.
  EXPECT_NEAR(*report.views[0].psnr_own_depth_db, 10 * std::log10(255.0 * 255 / 80), 1e-9);
  EXPECT_EQ(EvaluateHeldOut(SmallSet(), {}, Painter(104), progress).views[0].psnr_own_depth_db,
            std::nullopt);
}

TEST(EvaluateHeldOut, WithoutViewsToCompareItSaysWhatToDo) {
  SilentProgress progress;
  DtrSet set = SmallSet();
  set.frames[0].views.erase(set.frames[0].views.begin() + 1);
  EXPECT_THROW(EvaluateHeldOut(set, {}, Painter(0), progress), UsageError);
  set = SmallSet();
  set.frames[0].views[1].image = {};
  EXPECT_THROW(EvaluateHeldOut(set, {}, Painter(0), progress), Error);
  set.frames[0].views.resize(1);
  EvaluateOptions options;
  options.leave_one_out = true;
  EXPECT_THROW(EvaluateHeldOut(set, options, Painter(0), progress), UsageError);
  EXPECT_THROW(EvaluateHeldOut(DtrSet{}, {}, Painter(0), progress), Error);
}

TEST(EvaluationJson, HasTheNamesOfTheInterface) {
  SilentProgress progress;
  EvaluateOptions options;
  options.not_registered = {"lost \"\xff.jpg"};
  const EvaluationReport report = EvaluateHeldOut(SmallSet(), options, Painter(114), progress);
  const auto json = nlohmann::json::parse(ToJson(report, DepthScores{}));
  for (const char* key : {"psnr_db", "psnr_covered_db", "ssim", "coverage"}) {
    EXPECT_TRUE(json["views"][0][key].is_number()) << key;
    EXPECT_TRUE(json["mean"][key].is_number()) << key;
  }
  EXPECT_TRUE(json["views"][0].contains("psnr_cc_db"));  // a flat photo: infinite, null
  EXPECT_EQ(json["views"][0]["name"], "photo 1.jpg");
  EXPECT_EQ(json["not_registered"], 1);
  for (const char* key : {"share_within_1pct", "share_within_2pct", "median_relative_error",
                          "outlier_share", "depth_completeness"}) {
    EXPECT_TRUE(json["depth"].contains(key)) << key;
  }
  EXPECT_FALSE(nlohmann::json::parse(ToJson(report)).contains("depth"));
}

TEST(EvaluationJson, InfiniteAndUndefinedFiguresAreNull) {
  EvaluationReport report;
  report.views.resize(1);
  report.views[0].psnr_db = std::numeric_limits<double>::infinity();
  const auto json = nlohmann::json::parse(ToJson(report));
  EXPECT_EQ(json["views"][0]["identical"], nlohmann::json::array({"psnr_db"}));
  EXPECT_EQ(json["mean"]["identical"], nlohmann::json::array());
  EXPECT_TRUE(json["views"][0]["psnr_db"].is_null());
  EXPECT_TRUE(json["views"][0]["psnr_covered_db"].is_null());
  EXPECT_TRUE(json["mean"]["ssim"].is_null());
}

TEST(EvaluationJson, CrossDepthAndValidationResult) {
  const std::vector<View> views{testing::PlaneView(0, 0, false), testing::PlaneView(1, 0, false)};
  const View* pointers[] = {&views[0], &views[1]};
  const auto json = nlohmann::json::parse(ToJson(CrossDepth(pointers)));
  EXPECT_EQ(json["passed"], true);
  EXPECT_EQ(json["tests"][0]["name"], "cross_depth_px");
  EXPECT_EQ(json["views"].size(), 2u);
  const auto validation =
      nlohmann::json::parse(ValidationJson({{"a_px", 2, 1, false, "too much"}}));
  EXPECT_EQ(validation["passed"], false);
  EXPECT_EQ(validation["tests"][0]["reason"], "too much");
}

TEST(ComparisonImage, ShowsTheDifferenceFourfold) {
  const ImageRgb8 a(3, 2, 3, 100), b(3, 2, 3, 110), c(3, 2, 3, 200);
  const ImageRgb8 sheet = ComparisonImage(a, b);
  EXPECT_EQ(sheet.width(), 3 * 3 + 2 * 4);
  EXPECT_EQ(sheet(0, 0, 0), 100);
  EXPECT_EQ(sheet(7, 0, 1), 110);
  EXPECT_EQ(sheet(14, 1, 2), 40);
  EXPECT_EQ(ComparisonImage(a, c)(14, 1, 2), 255);
  EXPECT_THROW(ComparisonImage(a, ImageRgb8(2, 2, 3)), std::invalid_argument);
}

TEST(ComparisonImage, PixelsThatCountInNoFigureAreGrey) {
  const ImageRgb8 a(3, 2, 3, 100), b(3, 2, 3, 110);
  Mask mask(3, 2, 1, 255);
  mask(0, 1) = 0;
  const ImageRgb8 sheet = ComparisonImage(a, b, mask);
  EXPECT_EQ(sheet(7, 1, 0), 128);
  EXPECT_EQ(sheet(14, 1, 0), 128);
  EXPECT_EQ(sheet(7, 0, 0), 110);
  EXPECT_EQ(sheet(14, 0, 0), 40);
  EXPECT_THROW(ComparisonImage(a, b, Mask(2, 2)), std::invalid_argument);
}

}  // namespace
}  // namespace dtr::eval
