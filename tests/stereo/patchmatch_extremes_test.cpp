// The PatchMatch engine where geometry, light or pictures are at their limits. Bounds come from
// what the pictures can tell (extremes_rig.h) and from geometry.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/stereo/extremes_rig.h"

namespace dtr::stereo {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using testing::Facing;
using testing::LookingAt;
using testing::MatchingLimitPx;
using testing::Photograph;
using testing::Plane;
using testing::Score;
using testing::ScoreFirst;
using testing::Shot;
using testing::Slanted;
using testing::SphereBeforeWall;
using testing::Texture;
using testing::ViewsOf;
using testing::WholeRun;

constexpr int kWidth = 96, kHeight = 72;
constexpr double kFocal = 84;
const PinholeCamera kCamera(kWidth, kHeight, kFocal, kFocal, 0.5 * kWidth, 0.5 * kHeight);
constexpr DepthRange kRange{2.5, 8};
/// Its coarsest detail has 15 px at depth 4, its finest 2: pictures of it are hardly aliased.
constexpr double kTextureSize = 0.7;
/// Noise of a grey value: two roundings to 8 bits (0.29 each), sampling by 2x2 rays and linearly
/// between pixels.
constexpr double kNoise = 1.0;
/// The windows' borders have less weight than the Cramer-Rao bound supposes, see MatchingLimitPx.
constexpr double kWindowFactor = 2.0;
/// A window of radius 3 px is taken as affine: with strong perspective its corners, and at worst
/// the match, are off by the second-order term r^2 / focal length.
constexpr double kAffinePx = 9 / kFocal;

std::vector<Shot> ShotsFrom(const testing::Surface& surface, const std::vector<Pose>& poses) {
  std::vector<Shot> shots;
  for (const Pose& pose : poses) shots.push_back(Photograph(surface, kCamera, pose, kTextureSize));
  return shots;
}

/// Smallest median error that is to be expected, along a baseline in direction `along`.
double LimitPx(const Shot& shot, const Vector2d& along) {
  return kWindowFactor * MatchingLimitPx(shot.image, along, kNoise);
}

TEST(PatchMatchExtremes, TwoViewsTellWhatTheirPicturesAllow) {
  const auto shots = ShotsFrom(Slanted(), {Facing({0, 0, 0}), Facing({0.4, 0, 0})});
  const auto views = ViewsOf(shots);
  const Score score = ScoreFirst(views, WholeRun(views, kRange), shots[0].truth);
  EXPECT_GT(score.kept, 0.95);
  EXPECT_LT(score.median_px, LimitPx(shots[0], {1, 0}));
  EXPECT_LT(score.past_1px, 0.01);
}

TEST(PatchMatchExtremes, ABaselineOfATenThousandthOfTheDepthSufficesALongLens) {
  // A focal length of 11760 px: 1.2 px of disparity at depth 4.
  const double focal = 140 * kFocal;
  const PinholeCamera camera(kWidth, kHeight, focal, focal, 0.5 * kWidth, 0.5 * kHeight);
  std::vector<Shot> shots;
  for (const double x : {0.0, 4e-4, -4e-4}) {
    shots.push_back(Photograph(Slanted(), camera, Facing({x, 0, 0}), kTextureSize / 140));
  }
  const auto views = ViewsOf(shots);
  const DepthEstimate estimate = WholeRun(views, kRange);
  const Score score = ScoreFirst(views, estimate, shots[0].truth);
  EXPECT_GT(score.kept, 0.95);
  EXPECT_LT(score.median_px, LimitPx(shots[0], {1, 0}));
  // The depth is as uncertain as the pixel says: a sigma below the bound would be a lie.
  EXPECT_GT(score.median_sigma_px, MatchingLimitPx(shots[0].image, {1, 0}, kNoise) / 2);
  EXPECT_GT(score.within_3_sigma, 0.95);
}

TEST(PatchMatchExtremes, WhatMovesLessThanNoiseIsNotMeasured) {
  // The whole range, 2.5 to 8, is 0.01 px of disparity.
  const auto shots = ShotsFrom(Slanted(), {Facing({0, 0, 0}), Facing({4e-4, 0, 0})});
  const auto views = ViewsOf(shots);
  EXPECT_EQ(ScoreFirst(views, WholeRun(views, kRange), shots[0].truth).kept, 0);
}

TEST(PatchMatchExtremes, ABaselineAsLongAsTheDepth) {
  const Vector3d target(0, 0, 4);
  const auto shots =
      ShotsFrom(Slanted(), {LookingAt({0, 0, 0}, target), LookingAt({4, 0, 0}, target)});
  const auto views = ViewsOf(shots);
  const Score score = ScoreFirst(views, WholeRun(views, kRange), shots[0].truth);
  EXPECT_GT(score.kept, 0.85);
  EXPECT_LT(score.median_px, LimitPx(shots[0], {1, 0}) + kAffinePx);
  EXPECT_LT(score.past_1px, 0.03);
}

TEST(PatchMatchExtremes, NearAndAThousandTimesFartherInOnePicture) {
  const auto surface = testing::Union({testing::Sphere({0, 0, 1.3}, 0.3), Plane({0, 0, 1}, 1000)});
  std::vector<Shot> shots;
  for (const Vector3d& centre :
       {Vector3d(0, 0, 0), Vector3d(0.1, 0, 0), Vector3d(-0.1, 0, 0), Vector3d(0, 0.1, 0)}) {
    shots.push_back(Photograph(
        surface, kCamera, Facing(centre),
        [](const Vector3d& p, const Vector3d&) { return Texture(p, p.z() > 10 ? 180 : 0.18); }));
  }
  const auto views = ViewsOf(shots);
  const DepthImage& truth = shots[0].truth;
  const DepthEstimate estimate = WholeRun(views, {0.8, 1500});
  const Score near =
      ScoreFirst(views, estimate, truth, [&](int x, int y) { return truth(x, y) < 10; });
  const Score far =
      ScoreFirst(views, estimate, truth, [&](int x, int y) { return truth(x, y) > 10; });
  EXPECT_GT(near.kept, 0.95);
  EXPECT_LT(near.median_px, LimitPx(shots[0], {1, 0}));
  EXPECT_LT(near.past_1px, 0.02);
  // 0.008 px of disparity: all that can be told is that it is far, with a sigma that says so.
  // Windows within 3 px of the sphere's outline, 125 px long, hold both surfaces: 7 %.
  EXPECT_GT(far.kept, 0.93);
  EXPECT_LT(far.median_px, LimitPx(shots[0], {1, 0}));
  EXPECT_LT(far.past_1px, 0.02);
  EXPECT_GT(far.within_3_sigma, 0.9);
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

TEST(PatchMatchExtremes, TwoStopsBetweenNeighboursCostNothing) {
  auto shots = ShotsFrom(Slanted(), {Facing({0, 0, 0}), Facing({0.4, 0, 0}), Facing({-0.4, 0, 0})});
  // In linear light, clipped at white, sRGB-coded again.
  const auto expose = [](ImageRgb8* image, double factor) {
    for (std::uint8_t& value : image->data()) {
      const double code = value / 255.0;
      const double light =
          factor * (code <= 0.04045 ? code / 12.92 : std::pow((code + 0.055) / 1.055, 2.4));
      const double coded = light <= 0.0031308
                               ? 12.92 * light
                               : 1.055 * std::pow(std::min(light, 1.0), 1 / 2.4) - 0.055;
      value = static_cast<std::uint8_t>(255 * coded + 0.5);
    }
  };
  expose(&shots[1].image, 2.0);
  expose(&shots[2].image, 0.5);
  const auto views = ViewsOf(shots);
  const Score score = ScoreFirst(views, WholeRun(views, kRange), shots[0].truth);
  EXPECT_GT(score.kept, 0.95);
  EXPECT_LT(score.median_px, LimitPx(shots[0], {1, 0}));
  EXPECT_LT(score.past_1px, 0.01);
}

TEST(PatchMatchExtremes, AWallWithoutTextureHasNoDepthAfterAllRounds) {
  auto shots = ShotsFrom(Plane({0, 0, 1}, 4),
                         {Facing({0, 0, 0}), Facing({0.4, 0, 0}), Facing({-0.4, 0, 0})});
  std::uint64_t n = 0;
  for (Shot& shot : shots) {
    for (std::uint8_t& value : shot.image.data()) {
      value = static_cast<std::uint8_t>(127 + HashBits(n++) % 3);
    }
  }
  const auto views = ViewsOf(shots);
  EXPECT_LT(ScoreFirst(views, WholeRun(views, kRange), shots[0].truth).kept, 0.01);
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

TEST(PatchMatchExtremes, WallpaperThatRepeatsWithinTheRangeHasNoDepth) {
  // A period of 5 px of disparity; the range has 15. Other views on both sides at equal distances:
  // every period is as right in all of them.
  std::vector<Shot> shots;
  for (const double x : {0.0, 0.4, -0.4}) {
    const auto paint = [](const Vector3d& p, const Vector3d&) {
      const double turn = 2 * std::numbers::pi * kFocal / (5 * 4);
      return 127 + 50 * std::sin(turn * p.x()) + 30 * std::cos(2 * turn * p.x()) +
             25 * std::sin(turn * p.y());
    };
    shots.push_back(Photograph(Plane({0, 0, 1}, 4), kCamera, Facing({x, 0, 0}), paint));
  }
  for (const size_t count : {2, 3}) {
    std::vector<StereoView> views = ViewsOf(shots);
    views.resize(count);
    EXPECT_LT(ScoreFirst(views, WholeRun(views, {2, 16}), shots[0].truth).kept, 0.05) << count;
  }
}

TEST(PatchMatchExtremes, CopiesOfOnePhotoFromDifferentPlacesHaveNoDepth) {
  // All lies at infinity, which the range excludes.
  for (const size_t count : {2, 3}) {
    auto shots =
        ShotsFrom(Slanted(), {Facing({0, 0, 0}), Facing({0.4, 0, 0}), Facing({-0.4, 0.2, 0})});
    shots.resize(count);
    for (Shot& shot : shots) shot.image = shots[0].image;
    const auto views = ViewsOf(shots);
    EXPECT_LT(ScoreFirst(views, WholeRun(views, kRange), shots[0].truth).kept, 0.05) << count;
  }
}

TEST(PatchMatchExtremes, CopiesOfOnePhotoFromOnePlaceHaveNoDepth) {
  const auto shots = ShotsFrom(Slanted(), {Facing({0, 0, 0}), Facing({0, 0, 0})});
  const auto views = ViewsOf(shots);
  EXPECT_EQ(ScoreFirst(views, WholeRun(views, kRange), shots[0].truth).kept, 0);
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

/// Share of pixels whose depth, after undoing a scale of the world, is off by more than 1e-5.
double ChangedShare(const DepthImage& base, const DepthImage& other, double scale) {
  int changed = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double z = base(x, y), moved = other(x, y) / scale;
      changed += std::abs(moved - z) > 1e-5 * std::max(z, moved);
    }
  }
  return static_cast<double>(changed) / (kWidth * kHeight);
}

TEST(PatchMatchExtremes, NoPixelDependsOnTheWorldsUnitOrOrigin) {
  const auto shots = ShotsFrom(
      SphereBeforeWall(), {Facing({0, 0, 0}), Facing({0.4, 0, 0}, 10), Facing({0, 0.4, 0}, -5)});
  const auto in_world = [&](double scale, const Vector3d& offset) {
    auto views = ViewsOf(shots);
    for (StereoView& view : views) {
      const Vector3d centre = scale * view.cam_from_world.TargetOriginInSource() + offset;
      view.cam_from_world.translation = -(view.cam_from_world.rotation * centre);
    }
    return WholeRun(views, {kRange.near_z * scale, kRange.far_z * scale}).depth;
  };
  const DepthImage base = in_world(1, {0, 0, 0});
  for (const double scale : {1e-6, 1e6}) {
    EXPECT_EQ(ChangedShare(base, in_world(scale, {0, 0, 0}), scale), 0) << scale;
  }
  EXPECT_EQ(ChangedShare(base, in_world(1, {1e7, -1e7, 1e7}), 1), 0);
}

}  // namespace
}  // namespace dtr::stereo
