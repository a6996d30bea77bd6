// Depth of another instrument: its planes, how it agrees with points, what it does to PatchMatch.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "datasets/exact/stereo_score.h"
#include "dtr/base/random.h"
#include "stereo/depth_prior.h"
#include "stereo/prior_agreement.h"
#include "tests/support/on_threads.h"

namespace dtr::stereo {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using testing::Facing;
using testing::Photograph;
using testing::Plane;
using testing::Shot;
using testing::Sphere;
using testing::Surface;
using testing::Union;

const PinholeCamera kCamera(160, 120, 150, 150, 80, 60);

/// True z of a surface for a camera's pixels, with the noise and errors of an instrument.
struct Instrument {
  double shrink = 4;        ///< pixels of the photo per pixel of the map
  double scale = 1;         ///< what all depths are too large by
  double noise = 0;         ///< standard deviation, relative
  Vector2d shift = {0, 0};  ///< of what the map shows, shares of the width and height
  std::uint64_t seed = 1;
};

DepthImage MapOf(const Surface& surface, const PinholeCamera& camera, const Pose& cam_from_world,
                 const Instrument& by) {
  const PinholeCamera small = camera.Resized(static_cast<int>(camera.width_px() / by.shrink),
                                             static_cast<int>(camera.height_px() / by.shrink));
  Random random(by.seed);
  DepthImage map(small.width_px(), small.height_px());
  const Vector3d origin = cam_from_world.TargetOriginInSource();
  for (int y = 0; y < map.height(); ++y) {
    for (int x = 0; x < map.width(); ++x) {
      const Vector2d at((x + 0.5) - by.shift.x() * map.width(),
                        (y + 0.5) - by.shift.y() * map.height());
      const auto z = surface(origin, cam_from_world.rotation.conjugate() * small.RayFromPixel(at));
      // The sum of twelve uniform numbers has a variance of 1.
      double error = -6;
      for (int k = 0; k < 12; ++k) error += random.Uniform(0, 1);
      if (z) map(x, y) = static_cast<float>(*z * by.scale * (1 + by.noise * error));
    }
  }
  return map;
}

Surface BallBeforeWall() {
  return Union({Sphere({0.3, 0.1, 4}, 0.8), Plane(Vector3d(0.1, -0.15, 1).normalized(), 5.5)});
}

/// Views on a line, and points that they all may see.
struct World {
  explicit World(const Surface& of, int count = 6, int points = 900) : surface(of) {
    for (int v = 0; v < count; ++v) poses.push_back(Facing({0.2 * v - 0.5, 0.03 * (v % 2), 0}));
    for (const Pose& pose : poses) views.push_back({kCamera, pose, nullptr, nullptr});
    Random random(5);
    for (int i = 0; i < points; ++i) {
      const Vector3d from(random.Uniform(-0.5, 0.5), 0, 0);
      const Vector3d ray(random.Uniform(-0.4, 0.4), random.Uniform(-0.3, 0.3), 1);
      scene.points.push_back({from + *surface(from, ray) * ray});
    }
    for (int v = 0; v < count; ++v) {
      for (int i = 0; i < points; ++i) scene.observations.push_back({v, i, {0, 0}});
    }
    // Hidden points are no observations.
    std::erase_if(scene.observations, [&](const SparseObservation& seen) {
      const Vector3d eye = poses[static_cast<size_t>(seen.view)].TargetOriginInSource();
      const Vector3d ray = scene.points[static_cast<size_t>(seen.point)].p_in_world - eye;
      return std::abs(*surface(eye, ray) - 1) > 1e-6;
    });
  }
  PriorAgreement Measure(const std::function<Instrument(int view)>& by) const {
    return MeasurePriors(views, scene, [&](int view) -> std::optional<DepthImage> {
      return MapOf(surface, kCamera, poses[static_cast<size_t>(view)], by(view));
    });
  }
  Surface surface;
  std::vector<Pose> poses;
  std::vector<StereoView> views;
  SparseScene scene;
};

TEST(RelativeNoise, IsLinearBetweenDistancesAndConstantBeyond) {
  const RelativeNoise noise{{1, 3}, {0.01, 0.03}};
  EXPECT_DOUBLE_EQ(noise.At(0.5), 0.01);
  EXPECT_DOUBLE_EQ(noise.At(2), 0.02);
  EXPECT_DOUBLE_EQ(noise.At(9), 0.03);
}

TEST(PriorPlanes, APlaneOfTheSceneIsContinuedExactly) {
  const Surface wall = Plane(Vector3d(0.3, -0.2, 1).normalized(), 4);
  const Pose pose = Facing({0, 0, 0});
  const PriorPlanes planes(MapOf(wall, kCamera, pose, {.shrink = 8}));
  constexpr double kFloat = 1e-6;  // inverse depths are kept as float
  for (const Vector2d& share : {Vector2d(0.5, 0.5), Vector2d(0.131, 0.77), Vector2d(0.91, 0.24)}) {
    const auto at = planes.At(share);
    ASSERT_TRUE(at);
    const Vector2d pixel(share.x() * 160, share.y() * 120);
    const double z = *wall({0, 0, 0}, kCamera.RayFromPixel(pixel));
    EXPECT_NEAR(at->inverse_depth * z, 1, kFloat);
    const double beside = *wall({0, 0, 0}, kCamera.RayFromPixel(pixel + Vector2d(1, 0)));
    EXPECT_NEAR(at->slope_x / 160, 1 / beside - 1 / z, kFloat);
    EXPECT_FALSE(at->at_edge);
  }
}

TEST(PriorPlanes, SurfacesAreNotMixedAndEdgesAreNamed) {
  DepthImage map(20, 10);
  for (int y = 0; y < 10; ++y) {
    for (int x = 0; x < 20; ++x) map(x, y) = x < 10 ? 2.0f : 4.0f;
  }
  map(3, 3) = 0;
  const PriorPlanes planes(map);
  for (int x = 0; x < 20; ++x) {
    const auto at = planes.At({(x + 0.5) / 20, 0.75});
    ASSERT_TRUE(at);
    EXPECT_NEAR(1 / at->inverse_depth, x < 10 ? 2 : 4, 1e-5) << x;
    EXPECT_EQ(at->at_edge, x == 9 || x == 10) << x;
  }
  EXPECT_FALSE(planes.At({3.5 / 20, 3.5 / 10}));
  EXPECT_TRUE(planes.At({4.5 / 20, 3.5 / 10})->at_edge);
  EXPECT_FALSE(planes.At({1.2, 0.5}));
  EXPECT_THROW(PriorPlanes(DepthImage(4, 4, DepthKind::kRayDistance)), std::invalid_argument);
}

TEST(PriorPlanes, NoiseOfPixelsIsAveraged) {
  const Surface wall = Plane(Vector3d(0.3, -0.2, 1).normalized(), 4);
  const Pose pose = Facing({0, 0, 0});
  constexpr double kNoise = 0.02;
  const PriorPlanes planes(MapOf(wall, kCamera, pose, {.shrink = 2, .noise = kNoise}));
  double sum = 0;
  int count = 0;
  for (double y = 0.1; y < 0.9; y += 0.05) {
    for (double x = 0.1; x < 0.9; x += 0.05, ++count) {
      const double z = *wall({0, 0, 0}, kCamera.RayFromPixel({x * 160, y * 120}));
      sum += std::pow(planes.At({x, y})->inverse_depth * z - 1, 2);
    }
  }
  // A plane through 25 pixels has a fifth of their noise at its middle.
  EXPECT_LT(std::sqrt(sum / count), kNoise / 3);
}

TEST(PriorAgreement, FindsScaleAndNoiseWithinItsOwnUncertainty) {
  const World world(BallBeforeWall());
  const PriorAgreement found = world.Measure([](int view) {
    return Instrument{.scale = 1.07, .noise = 0.01, .seed = static_cast<std::uint64_t>(view)};
  });
  EXPECT_EQ(found.Count(ViewPrior::Fit::kFits), 6);
  EXPECT_LT(found.scale_sigma, 0.002);
  EXPECT_NEAR(found.scale, 1.07, 3 * 1.07 * found.scale_sigma + 1e-4);
  EXPECT_TRUE(found.shift.isZero(0)) << found.shift.transpose();
  ASSERT_FALSE(found.by_distance.empty());
  for (const PriorBin& bin : found.by_distance) {
    EXPECT_LT(std::abs(bin.bias), 0.01);  // planes of 20 px cut off the curve of the ball
    EXPECT_LT(bin.noise, 0.01);           // less than that of one pixel
    EXPECT_GT(bin.noise, 0.001);
  }
}

TEST(PriorAgreement, NamesTheMapOfAnotherPhoto) {
  World world(BallBeforeWall());
  const Surface other = Plane(Vector3d(-0.5, 0.3, 1).normalized(), 4);
  const PriorAgreement found =
      MeasurePriors(world.views, world.scene, [&](int view) -> std::optional<DepthImage> {
        return MapOf(view == 2 ? other : world.surface, kCamera,
                     world.poses[static_cast<size_t>(view)], {.noise = 0.01});
      });
  for (const ViewPrior& view : found.views) {
    EXPECT_EQ(view.fit, view.view == 2 ? ViewPrior::Fit::kDiffers : ViewPrior::Fit::kFits)
        << view.view << ": " << view.ratio << " " << view.noise;
  }
  EXPECT_NEAR(found.scale, 1, 0.005);
}

TEST(PriorAgreement, FindsAShift) {
  const World world(BallBeforeWall());
  const PriorAgreement found = world.Measure([](int) {
    return Instrument{.shrink = 2, .noise = 0.005, .shift = {0.015, 0.01}};
  });
  // The maps must be moved back; y in shares of the width, too.
  EXPECT_NEAR(found.shift.x(), -0.015, 0.004);
  EXPECT_NEAR(found.shift.y(), -0.0075, 0.004);
}

TEST(PriorAgreement, SaysHowNoiseGrowsWithDistance) {
  const World world(Plane(Vector3d(0.9, 0, 1).normalized(), 4), 6, 3000);
  const PriorAgreement found =
      MeasurePriors(world.views, world.scene, [&](int view) -> std::optional<DepthImage> {
        DepthImage map =
            MapOf(world.surface, kCamera, world.poses[static_cast<size_t>(view)], {.shrink = 2});
        Random random(static_cast<std::uint64_t>(view) + 9);
        for (float& z : map.grid().data()) {
          const double sigma = 0.004 * std::pow(z / 4, 2);
          z = static_cast<float>(z * (1 + std::sqrt(3.0) * sigma * random.Uniform(-1, 1)));
        }
        return map;
      });
  ASSERT_GE(found.by_distance.size(), 4u);
  EXPECT_GT(found.by_distance.back().noise, 1.5 * found.by_distance.front().noise);
  EXPECT_GT(found.expected.At(100), found.expected.At(0.1));
}

TEST(PriorAgreement, ViewsWithFewPointsAreNotJudged) {
  World world(BallBeforeWall(), 3, 200);
  std::erase_if(world.scene.observations,
                [](const SparseObservation& seen) { return seen.view == 1 && seen.point > 9; });
  const PriorAgreement found = world.Measure([](int) { return Instrument{}; });
  EXPECT_EQ(found.views[1].fit, ViewPrior::Fit::kFewPoints);
  EXPECT_EQ(found.Count(ViewPrior::Fit::kFits), 2);
}

/// A wall whose right half shows nothing, in six photos.
class HalfPlainWall : public ::testing::Test {
 protected:
  static constexpr double kNoise = 0.008;

  void SetUp() override {
    const Surface wall = Plane(Vector3d(0.2, -0.1, 1).normalized(), 4);
    for (int v = 0; v < 6; ++v) {
      const Pose pose = Facing({0.15 * v, 0.1 * (v % 2), 0});
      shots_.push_back(Photograph(wall, kCamera, pose, [](const Vector3d& p, const Vector3d&) {
        return p.x() > kPlainFrom ? 128.0 : testing::Texture(p, 0.35);
      }));
      maps_.push_back(MapOf(wall, kCamera, pose,
                            {.shrink = 4, .noise = kNoise, .seed = static_cast<std::uint64_t>(v)}));
    }
  }
  DepthEstimate Run(double scale, int threads = 2) {
    std::vector<StereoView> views;
    std::vector<DepthPrior> priors(shots_.size());
    for (size_t v = 0; v < shots_.size(); ++v) {
      views.push_back(shots_[v].View());
      if (scale == 0) continue;
      priors[v] = {[this, v, scale] {
                     DepthImage map = maps_[v];
                     for (float& z : map.grid().data()) z = static_cast<float>(scale * z);
                     return map;
                   },
                   {{1}, {kNoise}}};
      views[v].prior = &priors[v];
    }
    return OnThreads(threads, [&] { return testing::WholeRun(views, {2, 9}); });
  }
  /// Shares of the true pixels, in the plain or the textured part.
  struct Shares {
    double within_2pct = 0, wrong = 0;
  };
  Shares Score(const DepthEstimate& estimate, bool plain) const {
    const Shot& shot = shots_[0];
    int all = 0, near = 0, wrong = 0;
    for (int y = 8; y < 112; ++y) {
      for (int x = 8; x < 152; ++x) {
        const Vector3d p =
            kCamera.CamFromPixel({x + 0.5, y + 0.5}, shot.truth(x, y), DepthKind::kPlaneZ);
        const double off = p.x() - kPlainFrom;
        if (plain ? off < 0.15 : off > -0.15) continue;
        ++all;
        if (DepthImage::IsHole(estimate.depth(x, y))) continue;
        const bool right = std::abs(estimate.depth(x, y) / shot.truth(x, y) - 1) <= 0.02;
        near += right;
        wrong += !right;
      }
    }
    return {static_cast<double>(near) / all, static_cast<double>(wrong) / all};
  }
  static constexpr double kPlainFrom = 0.1;
  std::vector<Shot> shots_;
  std::vector<DepthImage> maps_;
};

TEST_F(HalfPlainWall, PriorDecidesWherePhotosShowNothing) {
  const DepthEstimate without = Run(0), with = Run(1);
  EXPECT_LT(Score(without, true).within_2pct, 0.3);
  EXPECT_GT(Score(with, true).within_2pct, 0.9);
  EXPECT_LT(Score(with, true).wrong, 0.03);
  // Where photos decide, nothing gets worse.
  EXPECT_GE(Score(with, false).within_2pct, Score(without, false).within_2pct - 0.005);
  EXPECT_LE(Score(with, false).wrong, Score(without, false).wrong + 0.005);
}

TEST_F(HalfPlainWall, PhotosThatContradictAPriorWin) {
  const DepthEstimate without = Run(0), with = Run(1.1);
  EXPECT_GT(Score(with, false).within_2pct, 0.93);
  // What is left is next to the plain half, whose windows have little texture of their own.
  EXPECT_LT(Score(with, false).wrong, Score(without, false).wrong + 0.03);
}

TEST_F(HalfPlainWall, ThreadsHaveNoInfluence) {
  const DepthEstimate one = Run(1, 1), four = Run(1, 4);
  EXPECT_EQ(one.depth, four.depth);
  EXPECT_EQ(one.inverse_depth_sigma, four.inverse_depth_sigma);
}

TEST_F(HalfPlainWall, SigmasOfFilledPixelsHold) {
  const DepthEstimate with = Run(1);
  int all = 0, within = 0;
  for (int y = 8; y < 112; ++y) {
    for (int x = 100; x < 152; ++x) {
      if (DepthImage::IsHole(with.depth(x, y))) continue;
      const double error = std::abs(1.0 / with.depth(x, y) - 1.0 / shots_[0].truth(x, y));
      ++all;
      within += error <= 3 * with.inverse_depth_sigma(x, y);
    }
  }
  ASSERT_GT(all, 1000);
  EXPECT_GT(static_cast<double>(within) / all, 0.95);
}

}  // namespace
}  // namespace dtr::stereo
