#include "dtr/eval/sweep.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "dtr/base/error.h"
#include "dtr/eval/render_sweep.h"
#include "tests/eval/clockwork.h"

namespace dtr::eval {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::Not;

SweepPoint At(double cost, double error, std::optional<double> psnr_db = std::nullopt) {
  SweepPoint point;
  point.setting = {1};
  point.measured = {cost, cost, cost, error, psnr_db, 0, {}};
  return point;
}

TEST(ParetoFront, HandWorked) {
  const std::vector<SweepPoint> points{At(4, 1), At(1, 9), At(2, 9), At(2, 5), At(3, 6), At(4, 1)};
  EXPECT_THAT(ParetoFront(points), ElementsAre(1, 3, 0));
  EXPECT_TRUE(ParetoFront({}).empty());
}

TEST(KneeOf, IsFarthestBelowTheLineOfLogarithms) {
  // Cost and error each fall by a factor of 100 over the front; the line has 10 at 10.
  const std::vector<SweepPoint> bent{At(1, 100), At(10, 4), At(20, 3), At(100, 1)};
  EXPECT_EQ(KneeOf(bent, ParetoFront(bent)), 1u);
  const std::vector<SweepPoint> straight{At(1, 100), At(10, 10), At(100, 1)};
  EXPECT_FALSE(KneeOf(straight, ParetoFront(straight)).has_value());
  const std::vector<SweepPoint> bulging{At(1, 100), At(10, 50), At(100, 1)};
  EXPECT_FALSE(KneeOf(bulging, ParetoFront(bulging)).has_value());
  const std::vector<SweepPoint> two{At(1, 2), At(2, 1)};
  EXPECT_FALSE(KneeOf(two, ParetoFront(two)).has_value());
}

TEST(CheapestWithin, CountsLossFromTheBest) {
  const std::vector<SweepPoint> points{At(9, 1, 30.0), At(3, 1, 29.5), At(1, 1, 28.0), At(2, 1)};
  EXPECT_EQ(CheapestWithin(points, 0), 0u);
  EXPECT_EQ(CheapestWithin(points, 0.5), 1u);
  EXPECT_EQ(CheapestWithin(points, 5), 2u);
  EXPECT_FALSE(CheapestWithin(std::vector<SweepPoint>{At(1, 1)}, 1).has_value());
}

TEST(BestWithin, IsTheLeastErrorInTheBudget) {
  const std::vector<SweepPoint> points{At(9, 1), At(3, 2), At(2, 2), At(1, 3)};
  EXPECT_EQ(BestWithin(points, 5), 2u);
  EXPECT_EQ(BestWithin(points, 9), 0u);
  EXPECT_FALSE(BestWithin(points, 0.5).has_value());
}

TEST(RangeOf, IsWidenedByHowMuchTheMachineMoved) {
  std::vector<SweepPoint> points{At(10, 1), At(20, 1)};
  points[0].measured.cost_least = 9;
  points[0].measured.cost_most = 12;
  points[0].measured.machine_ms = 4;
  points[1].measured.machine_ms = 5;
  EXPECT_DOUBLE_EQ(RangeOf(points[0], points).least, 0.9 * 9);
  EXPECT_DOUBLE_EQ(RangeOf(points[0], points).most, 1.1 * 12 * 5 / 4);
  EXPECT_DOUBLE_EQ(RangeOf(points[1], points).least, 0.9 * 20 * 4 / 5);
  points[1].measured.machine_ms = 0;  // bytes do not depend on it
  EXPECT_DOUBLE_EQ(RangeOf(points[1], points).least, 20);
}

TEST(AssessDefault, NamesWhatSavesMost) {
  std::vector<SweepPoint> points{At(10, 2), At(12, 1), At(6, 2), At(4, 2), At(1, 5)};
  points[0].setting = {0};
  auto assessment = AssessDefault(points, ParetoFront(points));
  ASSERT_TRUE(assessment.has_value());
  EXPECT_FALSE(assessment->on_front);
  EXPECT_EQ(assessment->beaten_by, 3u);
  EXPECT_FALSE(assessment->within_spread);
  points[3].measured.cost_most = 10.5;  // of a cost that is no time
  EXPECT_TRUE(AssessDefault(points, ParetoFront(points))->within_spread);
  points[0].measured.error = 1.5;
  EXPECT_TRUE(AssessDefault(points, ParetoFront(points))->on_front);
  EXPECT_FALSE(AssessDefault(std::span(points).subspan(1), {}).has_value());
}

/// A stage of three choices with independent effects. The tolerance is of "slow" alone.
SweepStage Independent(std::vector<SweepSetting>* measured = nullptr) {
  SweepStage stage;
  stage.name = "independent";
  stage.axes = {{"method", {"fast", "slow"}},
                {"views", {"8", "4", "2"}},
                {"size", {"1", "2"}},
                {"tolerance", {"1", "2"}}};
  stage.applies = [](const SweepSetting& setting, size_t axis) {
    return axis != 3 || setting[0] == 1;
  };
  stage.measure = [measured](const SweepSetting& setting) {
    if (measured != nullptr) measured->push_back(setting);
    const double cost = (setting[0] == 1 ? 100.0 : 10.0) / (1 + setting[1]) /
                        (setting[2] == 1 ? 4 : 1) / (setting[3] == 1 ? 30 : 1);
    const double error = (setting[0] == 1 ? 1.9 : 2.0) * (1 + 0.1 * setting[1]) *
                         (setting[2] == 1 ? 1.05 : 1) * (setting[3] == 1 ? 1.01 : 1);
    return SweepMeasurement{cost, cost, cost, error, std::nullopt, 0, {}};
  };
  return stage;
}

class Memory final : public SweepStore {
 public:
  std::optional<SweepMeasurement> Find(const SweepSetting& setting) const override {
    const auto found = kept.find(setting);
    return found == kept.end() ? std::nullopt : std::optional(found->second);
  }
  void Keep(const SweepSetting& setting, const SweepMeasurement& measurement) override {
    EXPECT_TRUE(kept.emplace(setting, measurement).second) << "measured twice";
  }
  std::map<SweepSetting, SweepMeasurement> kept;
};

TEST(OneAtATime, TriesConditionalChoicesWhereTheyMeanSomething) {
  EXPECT_THAT(
      OneAtATime(Independent()),
      ElementsAre(SweepSetting{0, 0, 0, 0}, SweepSetting{1, 0, 0, 0}, SweepSetting{0, 1, 0, 0},
                  SweepSetting{0, 2, 0, 0}, SweepSetting{0, 0, 1, 0}, SweepSetting{1, 0, 0, 1}));
}

/// Error and cost of a stage whose second choice has an option of its own: the power of "sharp".
SweepStage Nested() {
  SweepStage stage;
  stage.name = "nested";
  stage.axes = {{"method", {"one", "other"}}, {"weight", {"soft", "sharp"}}, {"power", {"8", "9"}}};
  stage.applies = [](const SweepSetting& setting, size_t axis) {
    return axis != 2 || setting[1] == 1;
  };
  stage.measure = [](const SweepSetting& setting) {
    const double cost = setting[0] == 1 ? 1 : 10;
    const double error =
        (setting[0] == 1 ? 3 : 1) * (setting[1] == 1 ? 0.5 : 1) * (setting[2] == 1 ? 0.5 : 1);
    return SweepMeasurement{cost, cost, cost, error, std::nullopt, 0, {}};
  };
  return stage;
}

TEST(OneAtATime, TriesTheOptionsOfAChoiceOnThatChoice) {
  EXPECT_THAT(OneAtATime(Nested()), ElementsAre(SweepSetting{0, 0, 0}, SweepSetting{1, 0, 0},
                                                SweepSetting{0, 1, 0}, SweepSetting{0, 1, 1}));
}

TEST(Sweep, CombinesTheOptionsOfAChoiceWithTheOtherAxes) {
  SilentProgress progress;
  Memory memory;
  std::set<SweepSetting> measured;
  for (const SweepPoint& point : Sweep(Nested(), 100, memory, progress)) {
    measured.insert(point.setting);
  }
  // Cheapest, and best there: what the power did beside the other method is foreseen.
  EXPECT_THAT(measured, Contains(SweepSetting{1, 1, 1}));
  EXPECT_THAT(measured, Not(Contains(SweepSetting{0, 0, 1})));  // a power of nothing
  EXPECT_THAT(measured, Not(Contains(SweepSetting{1, 0, 1})));
}

TEST(Sweep, FindsTheFrontOfTheFullProductWithoutMeasuringIt) {
  SilentProgress progress;
  Memory memory;
  const SweepStage stage = Independent();
  const std::vector<SweepPoint> points = Sweep(stage, 100, memory, progress);
  // Of the 6 + 12 settings that mean something.
  EXPECT_LT(points.size(), 18u);
  std::set<SweepSetting> distinct;
  for (const SweepPoint& point : points) distinct.insert(point.setting);
  EXPECT_EQ(distinct.size(), points.size());
  EXPECT_THAT(distinct, Not(Contains(SweepSetting{0, 0, 0, 1})));  // would change nothing
  std::vector<SweepPoint> all;
  for (int method = 0; method < 2; ++method) {
    for (int views = 0; views < 3; ++views) {
      for (int size = 0; size < 2; ++size) {
        for (int tolerance = 0; tolerance <= method; ++tolerance) {
          const SweepSetting setting{method, views, size, tolerance};
          all.push_back({setting, stage.measure(setting)});
        }
      }
    }
  }
  // Everything on the true front is on the one that was found, or within the least promise of it.
  for (const size_t i : ParetoFront(all)) {
    double gap = HUGE_VAL;
    for (const SweepPoint& point : points) {
      gap = std::min(gap, std::max(std::log(point.measured.cost / all[i].measured.cost),
                                   std::log(point.measured.error / all[i].measured.error)));
    }
    EXPECT_LT(gap, 0.06) << Describe(stage, all[i].setting);
  }
}

TEST(Sweep, StopsAtTheMostPointsAndGoesOnFromWhatIsKept) {
  SilentProgress progress;
  std::vector<SweepSetting> measured;
  const SweepStage stage = Independent(&measured);
  Memory memory;
  EXPECT_EQ(Sweep(stage, 4, memory, progress).size(), 4u);
  EXPECT_EQ(measured.size(), 4u);
  const auto whole = Sweep(stage, 10, memory, progress);
  EXPECT_EQ(measured.size(), whole.size());  // the four were not measured again
  const auto again = Sweep(stage, 10, memory, progress);
  EXPECT_EQ(measured.size(), whole.size());
  ASSERT_EQ(again.size(), whole.size());
  for (size_t i = 0; i < whole.size(); ++i) EXPECT_EQ(again[i].setting, whole[i].setting);
}

TEST(Sweep, RejectsACostThatNoLogarithmHas) {
  SilentProgress progress;
  Memory memory;
  SweepStage stage = Independent();
  stage.measure = [](const SweepSetting&) { return SweepMeasurement{0, 0, 0, 1, {}, 0, {}}; };
  EXPECT_THROW(Sweep(stage, 3, memory, progress), Error);
}

TEST(Describe, NamesWhatIsNotTheDefault) {
  EXPECT_EQ(Describe(Independent(), {0, 0, 0, 0}), "default");
  EXPECT_EQ(Describe(Independent(), {1, 2, 0, 0}), "method=slow views=2");
}

TEST(CalibrationLoop, TakesProcessorTime) { EXPECT_GT(CalibrationLoop(), 0.1); }

TEST(RmsLevels, HandWorked) {
  EXPECT_DOUBLE_EQ(RmsLevels(20), 25.5);
  EXPECT_DOUBLE_EQ(RmsLevels(std::numeric_limits<double>::infinity()), 1e-6);
}

TEST(RenderSweep, TriesWhatTheSetHasAndMeasuresCostAndError) {
  SilentProgress progress;
  testing::Clockwork clockwork(false);
  const DtrSet set = testing::Planes(5, true);
  RenderSweepOptions options;
  options.bench.repeats = 2;
  options.bench.render.views = 4;
  const RenderSweep sweep(set, options, clockwork, progress);
  const SweepStage stage = sweep.Stage();
  EXPECT_THAT(stage.axes[1].values, ElementsAre("4", "1", "2", "3"));  // no more than five sources
  EXPECT_THAT(stage.axes[0].values, ElementsAre("deferred", "two-pass", "splat"));
  SweepSetting setting(stage.axes.size(), 0);
  const SweepMeasurement usual = stage.measure(setting);
  EXPECT_DOUBLE_EQ(usual.cost, 40);
  EXPECT_NEAR(usual.error, 10, 1e-9);  // levels off
  setting[0] = 2;
  setting[1] = 2;
  setting[2] = 1;
  const RenderOptions splats = sweep.OptionsOf(setting);
  EXPECT_EQ(splats.method, RenderMethod::kTwoPass);
  EXPECT_EQ(splats.primitive, Primitive::kSplat);
  EXPECT_EQ(splats.views, 2);
  EXPECT_EQ(splats.resolution, 2);
  EXPECT_NEAR(stage.measure(setting).error, 2, 1e-9);
  EXPECT_TRUE(stage.applies(setting, 6));   // point size
  EXPECT_FALSE(stage.applies(setting, 4));  // mesh tolerance is of the other method
  clockwork.room_for_views = 1;
  EXPECT_THROW(stage.measure(setting), Error);
}

TEST(RenderSweep, OptionsOfAWeightAreTriedUnderThatWeightAlone) {
  SilentProgress progress;
  testing::Clockwork clockwork(false);
  const DtrSet set = testing::Planes(5, true);
  RenderSweepOptions options;
  options.bench.render.max_angle_rad = 1;  // whose degrees do not come back as the same bits
  const RenderSweep sweep(set, options, clockwork, progress);
  const SweepStage stage = sweep.Stage();
  const auto axis_of = [&](const std::string& name) {
    return static_cast<size_t>(std::ranges::find(stage.axes, name, &SweepAxis::name) -
                               stage.axes.begin());
  };
  const size_t blend = axis_of("blend");
  const std::map<std::string, std::vector<std::string>> weights_of = {
      {"exponent", {"cosine"}},
      {"falloff", {"exponential"}},
      {"blend-k", {"inverse-angle", "k-nearest"}},
      {"max-angle", stage.axes[blend].values}};
  for (const auto& [name, weights] : weights_of) {
    ASSERT_LT(axis_of(name), stage.axes.size()) << name;
    for (size_t value = 0; value < stage.axes[blend].values.size(); ++value) {
      SweepSetting setting(stage.axes.size(), 0);
      setting[blend] = static_cast<int>(value);
      const bool expected = std::ranges::count(weights, stage.axes[blend].values[value]) > 0;
      EXPECT_EQ(stage.applies(setting, axis_of(name)), expected)
          << name << " under " << stage.axes[blend].values[value];
    }
  }
  SweepSetting setting(stage.axes.size(), 0);
  EXPECT_EQ(sweep.OptionsOf(setting), options.bench.render);
  setting[axis_of("exponent")] = setting[axis_of("falloff")] = 1;
  setting[axis_of("blend-k")] = setting[axis_of("max-angle")] = 1;
  const RenderOptions others = sweep.OptionsOf(setting);
  EXPECT_EQ(others.exponent, 2);
  EXPECT_EQ(others.falloff, 2);
  EXPECT_EQ(others.blend_k, 1);
  EXPECT_DOUBLE_EQ(others.max_angle_rad, std::numbers::pi / 6);
  // Every one of them is measured alone.
  for (const auto& entry : weights_of) {
    const auto& name = entry.first;  // Clang 14 captures no structured binding
    const auto settings = OneAtATime(stage);
    EXPECT_EQ(std::ranges::count_if(
                  settings, [&](const SweepSetting& one) { return one[axis_of(name)] != 0; }),
              std::ssize(stage.axes[axis_of(name)].values) - 1)
        << name;
  }
}

}  // namespace
}  // namespace dtr::eval
