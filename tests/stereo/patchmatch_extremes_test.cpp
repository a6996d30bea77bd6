// The PatchMatch engine where geometry or images are at their limits; those that concern users
// are cases of `dtr selftest` (cli/selftest/stereo_cases.cpp). Bounds come from
// what the images can tell (datasets/exact/stereo_score.h) and from geometry.
#include <gtest/gtest.h>

#include <cmath>

#include "datasets/exact/stereo_score.h"

namespace dtr::stereo {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using testing::Facing;
using testing::MatchingLimitPx;
using testing::Photograph;
using testing::Plane;
using testing::Score;
using testing::ScoreFirst;
using testing::Shot;
using testing::Slanted;
using testing::Texture;
using testing::ViewsOf;
using testing::WholeRun;

constexpr int kWidth = 96, kHeight = 72;
constexpr double kFocal = 84;
const PinholeCamera kCamera(kWidth, kHeight, kFocal, kFocal, 0.5 * kWidth, 0.5 * kHeight);
constexpr DepthRange kRange{2.5, 8};
/// Its coarsest detail has 15 px at depth 4, its finest 2: images of it are hardly aliased.
constexpr double kTextureSize = 0.7;
/// Noise of a grey value: two roundings to 8 bits (0.29 each), sampling by 2x2 rays and linearly
/// between pixels.
constexpr double kNoise = 1.0;
/// The windows' borders have less weight than the Cramer-Rao bound supposes, see MatchingLimitPx.
constexpr double kWindowFactor = 2.0;

std::vector<Shot> ShotsFrom(const testing::Surface& surface, const std::vector<Pose>& poses) {
  std::vector<Shot> shots;
  for (const Pose& pose : poses) shots.push_back(Photograph(surface, kCamera, pose, kTextureSize));
  return shots;
}

/// Smallest median error that is to be expected, along a baseline in direction `along`.
double LimitPx(const Shot& shot, const Vector2d& along) {
  return kWindowFactor * MatchingLimitPx(shot.image, along, kNoise);
}

TEST(PatchMatchExtremes, ForwardMotionIsExactAwayFromTheEpipoleAndHonestAtIt) {
  const auto shots =
      ShotsFrom(Slanted(), {Facing({0, 0, 0}), Facing({0, 0, 0.5}), Facing({0, 0, -0.5})});
  const auto views = ViewsOf(shots);
  const DepthEstimate estimate = WholeRun(views, kRange);
  const auto radius = [](int x, int y) {
    return std::hypot(x + 0.5 - 0.5 * kWidth, y + 0.5 - 0.5 * kHeight);
  };
  const Score away =
      ScoreFirst(views, estimate, shots[0].truth, [&](int x, int y) { return radius(x, y) > 10; });
  EXPECT_GT(away.kept, 0.95);
  EXPECT_LT(away.median_px, LimitPx(shots[0], {1, 0}));
  EXPECT_LT(away.past_1px, 0.01);
  // A pixel at the epipole does not move whatever its depth.
  const Score at =
      ScoreFirst(views, estimate, shots[0].truth, [&](int x, int y) { return radius(x, y) <= 10; });
  EXPECT_GT(at.within_3_sigma, 0.95);
}

TEST(PatchMatchExtremes, SpotsWithoutTextureGetTheDepthOfTheWallTheyAreOn) {
  // A row of round spots, 15 px wide, of one grey.
  const auto in_spot = [](const Vector3d& p) {
    const double x = p.x() / 1.4;
    return std::hypot(1.4 * (x - std::round(x)), p.y()) < 0.36;
  };
  const auto paint = [&](const Vector3d& p, const Vector3d&) {
    return in_spot(p) ? 128.0 : Texture(p, kTextureSize);
  };
  std::vector<Shot> shots;
  for (const double x : {0.0, 0.4, -0.4}) {
    shots.push_back(Photograph(Plane({0, 0, 1}, 4), kCamera, Facing({x, 0, 0}), paint));
  }
  const auto views = ViewsOf(shots);
  const DepthEstimate estimate = WholeRun(views, kRange);
  // Inside, where a window sees nothing else: 3 px from the rim.
  const auto inside = [&](int x, int y) {
    const Vector3d p = kCamera.CamFromPixel({x + 0.5, y + 0.5}, 4, DepthKind::kPlaneZ);
    for (const double dx : {-3.5, 0.0, 3.5}) {
      for (const double dy : {-3.5, 0.0, 3.5}) {
        if (!in_spot(p + Vector3d(dx, dy, 0) * 4 / kFocal)) return false;
      }
    }
    return true;
  };
  const Score score = ScoreFirst(views, estimate, shots[0].truth, inside);
  EXPECT_GT(score.kept, 0.8);
  EXPECT_LT(score.past_1px, 0.01);
  EXPECT_GT(score.within_3_sigma, 0.95);
  // What is not seen but supposed is less sure.
  EXPECT_GT(score.median_sigma_px, 0.5);
}

TEST(PatchMatchExtremes, AMirrorHasNoDepthAndHarmsNothingBesideIt) {
  // Left of the middle, a mirror of things far away; the wall it hangs on beside it.
  std::vector<Shot> shots;
  for (const Vector3d& centre :
       {Vector3d(0, 0, 0), Vector3d(0.4, 0, 0), Vector3d(-0.4, 0, 0), Vector3d(0, 0.4, 0)}) {
    const auto paint = [](const Vector3d& p, const Vector3d& direction) {
      const Vector3d mirrored(direction.x(), direction.y(), -direction.z());
      return p.x() < 0 ? Texture(4 * mirrored.normalized(), kTextureSize)
                       : Texture(p, kTextureSize);
    };
    shots.push_back(Photograph(Plane({0, 0, 1}, 4), kCamera, Facing(centre), paint));
  }
  const auto views = ViewsOf(shots);
  const DepthEstimate estimate = WholeRun(views, kRange);
  const Score mirror =
      ScoreFirst(views, estimate, shots[0].truth, [](int x, int) { return x < kWidth / 2 - 3; });
  EXPECT_LT(mirror.kept, 0.05);
  // The windows are 7 pixels wide.
  const Score beside =
      ScoreFirst(views, estimate, shots[0].truth, [](int x, int) { return x > kWidth / 2 + 3; });
  EXPECT_GT(beside.kept, 0.95);
  EXPECT_LT(beside.median_px, LimitPx(shots[0], {1, 0}));
  EXPECT_LT(beside.past_1px, 0.01);
}

TEST(PatchMatchExtremes, PicturesOfEightPixels) {
  const PinholeCamera camera(8, 8, 8, 8, 4, 4);
  std::vector<Shot> shots;
  for (const double x : {0.0, 0.4, -0.4}) {
    shots.push_back(Photograph(Slanted(), camera, Facing({x, 0, 0}), 7.0));
  }
  const auto views = ViewsOf(shots);
  const Score score = ScoreFirst(views, WholeRun(views, kRange), shots[0].truth);
  EXPECT_GT(score.kept, 0.8);
  EXPECT_LT(score.median_px, LimitPx(shots[0], {1, 0}));
}

}  // namespace
}  // namespace dtr::stereo
