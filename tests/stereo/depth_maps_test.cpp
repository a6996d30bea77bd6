#include "stereo/depth_maps.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>

#include "datasets/exact/stereo_scene.h"
#include "stereo/left_out.h"
#include "tests/support/on_threads.h"

namespace dtr::stereo {
namespace {

using Eigen::Vector3d;
using testing::Facing;

const PinholeCamera kCamera(64, 48, 50, 50, 32, 24);
constexpr float kWallZ = 4;

/// Gives every view a wall at z = 4 with a wrong pixel at (view + 5, 10).
class WallEngine : public Engine {
 public:
  std::string name() const override { return "wall"; }
  DepthEstimate Estimate(std::span<const StereoView>, int reference, std::span<const int>,
                         const DepthRange&, const EngineOptions&) const override {
    ++calls;
    if (reference == reject) throw NoUsablePair("view " + std::to_string(reference) + ": no pair");
    DepthEstimate e{DepthImage(64, 48), Grid<float>(64, 48, 1, 0.01f)};
    std::fill(e.depth.grid().data().begin(), e.depth.grid().data().end(), kWallZ);
    e.depth(reference + 5, 10) = 2;
    return e;
  }
  mutable std::atomic<int> calls{0};
  int reject = -1;
};

/// Does so without planes for the first two views it is given.
class CountingEngine final : public WallEngine, public CountsLeftOut {
 public:
  int without_planes() const override { return std::min(2, calls.load()); }
};

/// A plane's inverse depth is 1/4 + 0.001 view at first; a pass adds a tenth of what the view and
/// its neighbours had: any other order, or a map of the wrong pass, shows.
class PassesEngine final : public Engine {
 public:
  std::string name() const override { return "passes"; }
  int Passes() const override { return 2; }
  DepthEstimate Estimate(std::span<const StereoView>, int, std::span<const int>, const DepthRange&,
                         const EngineOptions&) const override {
    throw Error("Estimate is not for engines with passes");
  }
  PlaneMap Match(std::span<const StereoView>, int reference, std::span<const int>,
                 const DepthRange&, const EngineOptions&) const override {
    ++calls;
    if (reference == reject) throw NoUsablePair("view " + std::to_string(reference) + ": no pair");
    return Flat(0.25f + 0.001f * static_cast<float>(reference));
  }
  PlaneMap Refine(std::span<const StereoView>, int reference, std::span<const int> neighbours,
                  const DepthRange&, std::span<const PlaneMap* const> maps, int,
                  const EngineOptions&) const override {
    ++calls;
    float sum = maps[static_cast<size_t>(reference)]->inverse_depth(0, 0);
    for (const int n : neighbours) {
      const PlaneMap* map = maps[static_cast<size_t>(n)];
      if (map != nullptr) sum += 0.1f * map->inverse_depth(0, 0);
    }
    return Flat(sum);
  }
  DepthEstimate Filter(std::span<const StereoView>, int reference, std::span<const int>,
                       const DepthRange&, std::span<const PlaneMap* const> maps,
                       const EngineOptions&) const override {
    DepthEstimate e{DepthImage(64, 48), Grid<float>(64, 48, 1, 0.01f)};
    const float w = maps[static_cast<size_t>(reference)]->inverse_depth(0, 0);
    for (float& z : e.depth.grid().data()) z = 1 / w;
    return e;
  }
  mutable std::atomic<int> calls{0};
  int reject = -1;

 private:
  static PlaneMap Flat(float w) {
    return {Grid<float>(64, 48, 1, w), Grid<float>(64, 48), Grid<float>(64, 48)};
  }
};

class Recorder final : public Progress {
 public:
  void Stage(const std::string&, int) override {}
  void Update(int done) override { updates = done; }
  void Note(const std::string& line) override { notes.push_back(line); }
  bool StopRequested() const override { return updates >= stop_after; }
  int updates = 0, stop_after = 1000;
  std::vector<std::string> notes;
};

struct Row {
  std::vector<StereoView> views;
  SparseScene scene;
};

/// Cameras side by side before a wall of points.
Row Cameras(int count) {
  Row row;
  Random random(2);
  for (int i = 0; i < 60; ++i) {
    row.scene.points.push_back({{random.Uniform(-2, 3), random.Uniform(-1, 1), kWallZ}});
  }
  for (int v = 0; v < count; ++v) {
    row.views.push_back({kCamera, Facing({0.4 * v, 0, 0}), nullptr, nullptr});
    for (int i = 0; i < 60; ++i) row.scene.observations.push_back({v, i, {0, 0}});
  }
  return row;
}

DepthMapsOptions Options(int neighbours, int min_agreeing = 1) {
  DepthMapsOptions options;
  options.neighbours.count = neighbours;
  options.consistency.min_agreeing = min_agreeing;
  return options;
}

using Results = std::vector<std::pair<int, DepthEstimate>>;

Results Compute(const Row& row, const Engine& engine, const DepthMapsOptions& options,
                Progress& progress, const std::function<bool(int)>& done = {}) {
  Results results;
  std::mutex mutex;
  ComputeDepthMaps(row.views, row.scene, engine, options, progress, done,
                   [&](int view, DepthEstimate&& e, const DepthRange& range) {
                     const std::lock_guard lock(mutex);
                     EXPECT_LT(range.near_z, kWallZ);
                     EXPECT_GT(range.far_z, kWallZ);
                     results.emplace_back(view, std::move(e));
                   });
  std::sort(results.begin(), results.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  return results;
}

TEST(ComputeDepthMaps, PairsWithoutCommonPointsAreLeftOutAndCounted) {
  WallEngine engine;
  Recorder all_share;
  const ThreadLimit limit(1);
  Compute(Cameras(4), engine, Options(2), all_share);
  EXPECT_TRUE(all_share.notes.empty());
  // The last of four sees points of its own alone, and would have no neighbour: it is told apart.
  Row row = Cameras(4);
  std::erase_if(row.scene.observations, [](const SparseObservation& seen) {
    return (seen.view == 3) != (seen.point >= 40);
  });
  Recorder some_do_not;
  Compute(row, engine, Options(2), some_do_not);
  ASSERT_EQ(some_do_not.notes.size(), 2u);
  EXPECT_EQ(some_do_not.notes[0],
            "6 of 12 pairs of view and neighbour left out: they have no more than 3 points in "
            "common");
  EXPECT_EQ(some_do_not.notes[1], "view 3: no neighbours, no depth");
}

TEST(ComputeDepthMaps, ViewsWhoseTextureSufficesAreCounted) {
  const CountingEngine engine;
  Recorder progress;
  const ThreadLimit limit(1);
  Compute(Cameras(4), engine, Options(2), progress);
  ASSERT_EQ(progress.notes.size(), 1u);
  EXPECT_EQ(progress.notes[0],
            "planes on weak texture left out in 2 of 4 views: their texture suffices");
  // Only what this call left out is told.
  Recorder again;
  Compute(Cameras(4), engine, Options(2), again);
  EXPECT_TRUE(again.notes.empty());
}

TEST(ComputeDepthMaps, HandsOutEveryViewOnceWithWrongPixelsRemoved) {
  WallEngine engine;
  Recorder progress;
  const ThreadLimit limit(2);
  const Results results = Compute(Cameras(5), engine, Options(2), progress);
  ASSERT_EQ(results.size(), 5u);
  for (int v = 0; v < 5; ++v) {
    EXPECT_EQ(results[static_cast<size_t>(v)].first, v);
    const DepthImage& depth = results[static_cast<size_t>(v)].second.depth;
    EXPECT_TRUE(DepthImage::IsHole(depth(v + 5, 10)));
    EXPECT_EQ(depth(32, 24), kWallZ);
  }
  EXPECT_EQ(engine.calls, 5);
  EXPECT_EQ(progress.updates, 5);
}

TEST(ComputeDepthMaps, ResumesToTheSameBytesAndComputesOnlyWhatIsNeeded) {
  WallEngine engine;
  Recorder progress;
  const Row row = Cameras(8);
  const ThreadLimit limit(1);
  const DepthMapsOptions options = Options(2);
  const Results all = Compute(row, engine, options, progress);
  engine.calls = 0;
  const ThreadLimit now(4);
  const Results last =
      Compute(row, engine, Options(2), progress, [](int view) { return view != 7; });
  ASSERT_EQ(last.size(), 1u);
  EXPECT_EQ(last[0].first, 7);
  EXPECT_EQ(last[0].second.depth, all[7].second.depth);
  EXPECT_EQ(engine.calls, 3);  // itself and its two neighbours
}

TEST(ComputeDepthMaps, WithoutTheFilterNothingIsRemoved) {
  WallEngine engine;
  Recorder progress;
  const ThreadLimit limit(2);
  const Results results = Compute(Cameras(3), engine, Options(5, 0), progress);
  EXPECT_EQ(results[0].second.depth(5, 10), 2);
}

TEST(ComputeDepthMaps, AViewWithoutAPairGetsHolesAndANote) {
  WallEngine engine;
  engine.reject = 1;
  Recorder progress;
  const Results results = Compute(Cameras(4), engine, {}, progress);
  ASSERT_EQ(results.size(), 4u);
  EXPECT_TRUE(DepthImage::IsHole(results[1].second.depth(32, 24)));
  ASSERT_EQ(progress.notes.size(), 1u);
  EXPECT_NE(progress.notes[0].find("view 1"), std::string::npos);
}

TEST(ComputeDepthMaps, StopsBetweenViewsWhenAsked) {
  WallEngine engine;
  Recorder progress;
  progress.stop_after = 2;
  const ThreadLimit limit(1);
  EXPECT_THROW(Compute(Cameras(6), engine, Options(5), progress), Interrupted);
  EXPECT_EQ(engine.calls, 2);
}

TEST(ComputeDepthMaps, GivenRangesReplaceThePoints) {
  WallEngine engine;
  Recorder progress;
  Row row = Cameras(3);
  row.scene = {};
  EXPECT_THROW(Compute(row, engine, {}, progress), Error);
  DepthMapsOptions options;
  options.given_ranges.assign(3, {2, 8});
  EXPECT_EQ(Compute(row, engine, options, progress).size(), 3u);
  options.given_ranges.pop_back();
  EXPECT_THROW(Compute(row, engine, options, progress), UsageError);
}

TEST(RunAllPasses, APassReadsOnlyThePassBefore) {
  PassesEngine engine;
  Recorder progress;
  const Row row = Cameras(3);
  const ThreadLimit limit(4);
  const Results results = Compute(row, engine, Options(2, 0), progress);
  ASSERT_EQ(results.size(), 3u);
  // By hand: w0 = 0.250, 0.251, 0.252; each pass w_i += 0.1 (sum of the others).
  double w[3] = {0.250, 0.251, 0.252};
  for (int pass = 0; pass < 2; ++pass) {
    const double sum = w[0] + w[1] + w[2];
    for (double& value : w) value += 0.1 * (sum - value);
  }
  for (size_t v = 0; v < 3; ++v) EXPECT_NEAR(results[v].second.depth(5, 5), 1 / w[v], 1e-5);
  EXPECT_EQ(engine.calls, 9);
}

TEST(RunAllPasses, GoesOnFromWhatTheStoreHasToTheSameBytes) {
  PassesEngine engine;
  Recorder progress;
  const Row row = Cameras(4);
  const ThreadLimit limit(1);
  const Results undisturbed = Compute(row, engine, Options(2, 0), progress);
  engine.calls = 0;
  PlaneMapsInMemory planes;
  DepthMapsOptions options = Options(2, 0);
  options.planes = &planes;
  Recorder impatient;
  impatient.stop_after = 3;  // of the first pass
  EXPECT_THROW(Compute(row, engine, options, impatient), Interrupted);
  EXPECT_EQ(engine.calls, 3);
  const Results resumed = Compute(row, engine, options, progress);
  EXPECT_EQ(engine.calls, 12);
  ASSERT_EQ(resumed.size(), 4u);
  for (size_t v = 0; v < 4; ++v) {
    EXPECT_EQ(resumed[v].second.depth, undisturbed[v].second.depth);
  }
}

TEST(RunAllPasses, AViewWithoutAPairHasNoPlanesForItsNeighboursEither) {
  PassesEngine engine;
  engine.reject = 1;
  Recorder progress;
  const ThreadLimit limit(1);
  const Results results = Compute(Cameras(4), engine, Options(3, 0), progress);
  EXPECT_TRUE(DepthImage::IsHole(results[1].second.depth(32, 24)));
  EXPECT_FALSE(DepthImage::IsHole(results[0].second.depth(32, 24)));
  EXPECT_EQ(progress.notes.size(), 1u);
}

/// Two views of a wall; the second's map is at `other_z` everywhere.
DepthEstimate FilteredAgainst(float other_z, double tolerance_px) {
  const StereoView a{kCamera, Facing({0, 0, 0}), nullptr, nullptr};
  const StereoView b{kCamera, Facing({0.4, 0, 0}), nullptr, nullptr};
  DepthEstimate mine{DepthImage(64, 48), Grid<float>(64, 48, 1, 0.01f)}, other = mine;
  for (float& z : mine.depth.grid().data()) z = kWallZ;
  for (float& z : other.depth.grid().data()) z = other_z;
  const OtherDepth others[] = {{&b, &other}};
  return FilterByConsistency(a, mine, others, {.min_agreeing = 1, .tolerance_px = tolerance_px});
}

TEST(FilterByConsistency, KeepsWhatTheOtherMapConfirmsWithinTheTolerance) {
  // 50 px * 0.4 * |1/4 - 1/5| = 1 px.
  EXPECT_FALSE(DepthImage::IsHole(FilteredAgainst(4, 0.5).depth(32, 24)));
  EXPECT_FALSE(DepthImage::IsHole(FilteredAgainst(5, 1.01).depth(32, 24)));
  EXPECT_TRUE(DepthImage::IsHole(FilteredAgainst(5, 0.99).depth(32, 24)));
  EXPECT_TRUE(DepthImage::IsHole(FilteredAgainst(3, 0.99).depth(32, 24)));
}

TEST(FilterByConsistency, RemovesWhatNobodyElseSees) {
  // The second camera stands 0.4 to the right: at z = 4 it misses the leftmost 5 columns.
  const DepthEstimate kept = FilteredAgainst(4, 0.5);
  EXPECT_TRUE(DepthImage::IsHole(kept.depth(4, 24)));
  EXPECT_EQ(kept.inverse_depth_sigma(4, 24), 0);
  EXPECT_FALSE(DepthImage::IsHole(kept.depth(5, 24)));
}

TEST(FilterByConsistency, DoubtsWhatItKeepsAlthoughAMapRefutesIt) {
  const StereoView a{kCamera, Facing({0, 0, 0}), nullptr, nullptr};
  const StereoView b{kCamera, Facing({0.4, 0, 0}), nullptr, nullptr};
  const StereoView c{kCamera, Facing({0, 0.4, 0}), nullptr, nullptr};
  DepthEstimate mine{DepthImage(64, 48), Grid<float>(64, 48, 1, 0.01f)};
  for (float& z : mine.depth.grid().data()) z = kWallZ;
  DepthEstimate same = mine, farther = mine, nearer = mine;
  for (float& z : farther.depth.grid().data()) z = 2 * kWallZ;
  for (float& z : nearer.depth.grid().data()) z = 0.5f * kWallZ;
  const auto sigma = [&](const DepthEstimate& other) {
    const OtherDepth others[] = {{&b, &same}, {&c, &other}};
    return FilterByConsistency(a, mine, others, {.min_agreeing = 1, .tolerance_px = 1})
        .inverse_depth_sigma(32, 24);
  };
  EXPECT_FLOAT_EQ(sigma(same), 0.01f);
  EXPECT_FLOAT_EQ(sigma(nearer), 0.01f);                           // hides the point: says nothing
  EXPECT_FLOAT_EQ(sigma(farther), 0.01f * std::exp(5.0f / 3.0f));  // one of two, and one to spare
}

}  // namespace
}  // namespace dtr::stereo
