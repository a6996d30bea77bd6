// The PatchMatch engine where geometry, light or images are at their limits. Bounds come from
// what the images can tell (datasets/exact/stereo_score.h) and from geometry.
#include <cmath>
#include <numbers>

#include "cli/selftest/cases.h"
#include "datasets/exact/stereo_score.h"

namespace dtr::selftest {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using stereo::DepthEstimate;
using stereo::DepthRange;
using stereo::StereoView;
using stereo::testing::Facing;
using stereo::testing::LookingAt;
using stereo::testing::MatchingLimitPx;
using stereo::testing::Photograph;
using stereo::testing::Plane;
using stereo::testing::Score;
using stereo::testing::ScoreFirst;
using stereo::testing::Shot;
using stereo::testing::Slanted;
using stereo::testing::SphereBeforeWall;
using stereo::testing::Surface;
using stereo::testing::Texture;
using stereo::testing::ViewsOf;

constexpr const char* kStereoStage = "Stereo";
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
/// A window of radius 3 px is taken as affine: with strong perspective its corners, and at worst
/// the match, are off by the second-order term r^2 / focal length.
constexpr double kAffinePx = 9 / kFocal;

/// What a well-textured surface must reach, and why just that.
struct Expected {
  double min_kept = 0.95;
  const char* kept_reason = "textured everywhere; a border of one pixel is 5 %";
  double beyond_limit_px = 0;  ///< allowed to the median error beyond LimitPx
  const char* median_reason = "twice the Cramer-Rao bound of 7 x 7 windows of this image";
  double max_past_1px = 0.01;
  const char* past_reason = "wrong depth is worse than none: one pixel in a hundred, a choice";
};

std::vector<Shot> ShotsFrom(const Surface& surface, const std::vector<Pose>& poses) {
  std::vector<Shot> shots;
  for (const Pose& pose : poses) shots.push_back(Photograph(surface, kCamera, pose, kTextureSize));
  return shots;
}

/// Smallest median error that is to be expected, along the baseline.
double LimitPx(const Shot& shot) {
  return kWindowFactor * MatchingLimitPx(shot.image, {1, 0}, kNoise);
}

DepthEstimate Run(const std::vector<StereoView>& views, const DepthRange& range, Outcome& outcome) {
  DepthEstimate estimate = stereo::testing::WholeRun(views, range);
  outcome.LookAtAll(estimate.depth.grid().data());
  outcome.LookAtAll(estimate.inverse_depth_sigma.data());
  return estimate;
}

void AddScore(const Score& score, const Shot& shot, const Expected& expected, Outcome& outcome,
              const std::string& where = "") {
  outcome.Add(AtLeast("share of pixels with depth" + where, score.kept, expected.min_kept,
                      expected.kept_reason));
  outcome.Add(AtMost("median error, px" + where, score.median_px,
                     LimitPx(shot) + expected.beyond_limit_px, expected.median_reason));
  outcome.Add(AtMost("share of these off by more than 1 px" + where, score.past_1px,
                     expected.max_past_1px, expected.past_reason));
}

void AddNothingKept(const Score& score, double most, const char* reason, Outcome& outcome,
                    const std::string& where = "") {
  outcome.Add(AtMost("share of pixels with depth" + where, score.kept, most, reason));
  outcome.rejection = "holes: a pixel that cannot be measured has no depth";
}

/// A lens so long that the range is the same number of pixels of disparity at any baseline.
Outcome SmallBaseline(double baseline_over_depth) {
  Outcome outcome;
  const double baseline = 4 * baseline_over_depth, longer = 140 * 1e-4 / baseline_over_depth;
  const PinholeCamera camera(kWidth, kHeight, longer * kFocal, longer * kFocal, 0.5 * kWidth,
                             0.5 * kHeight);
  std::vector<Shot> shots;
  for (const double x : {0.0, baseline, -baseline}) {
    shots.push_back(Photograph(Slanted(), camera, Facing({x, 0, 0}), kTextureSize / longer));
  }
  const auto views = ViewsOf(shots);
  const Score score = ScoreFirst(views, Run(views, kRange, outcome), shots[0].truth);
  AddScore(score, shots[0], {}, outcome);
  outcome.Add(AtLeast("errors within 3 of their own sigmas, share", score.within_3_sigma, 0.95,
                      "a sigma that is too small would be a lie; 0.997 for a normal law"));
  return outcome;
}

Outcome LessThanNoise() {
  Outcome outcome;  // the whole range, 2.5 to 8, is 0.01 px of disparity
  const auto shots = ShotsFrom(Slanted(), {Facing({0, 0, 0}), Facing({4e-4, 0, 0})});
  const auto views = ViewsOf(shots);
  AddNothingKept(ScoreFirst(views, Run(views, kRange, outcome), shots[0].truth), 0,
                 "the whole range is 0.01 px of disparity: nothing can be determined", outcome);
  return outcome;
}

Outcome BaselineOfATenth() {
  Outcome outcome;
  const auto shots = ShotsFrom(Slanted(), {Facing({0, 0, 0}), Facing({0.4, 0, 0})});
  const auto views = ViewsOf(shots);
  AddScore(ScoreFirst(views, Run(views, kRange, outcome), shots[0].truth), shots[0], {}, outcome);
  return outcome;
}

Outcome BaselineAsLongAsTheDepth() {
  Outcome outcome;
  const Vector3d target(0, 0, 4);
  const auto shots =
      ShotsFrom(Slanted(), {LookingAt({0, 0, 0}, target), LookingAt({4, 0, 0}, target)});
  const auto views = ViewsOf(shots);
  const Expected expected{
      .min_kept = 0.85,
      .kept_reason = "a tenth of the image is outside the other one; a border of one pixel is 5 %",
      .beyond_limit_px = kAffinePx,
      .median_reason =
          "twice the Cramer-Rao bound of 7 x 7 windows, and the 0.107 px that corners "
          "of windows taken as affine are off by at 45 degrees",
      .max_past_1px = 0.03,
      .past_reason =
          "wrong depth is worse than none: one pixel in a hundred, a choice, and two more "
          "where the two images' common part ends, whose windows are cut"};
  AddScore(ScoreFirst(views, Run(views, kRange, outcome), shots[0].truth), shots[0], expected,
           outcome);
  return outcome;
}

Outcome DepthsOneToAThousand() {
  Outcome outcome;
  const auto surface =
      stereo::testing::Union({stereo::testing::Sphere({0, 0, 1.3}, 0.3), Plane({0, 0, 1}, 1000)});
  std::vector<Shot> shots;
  for (const Vector3d& centre :
       {Vector3d(0, 0, 0), Vector3d(0.1, 0, 0), Vector3d(-0.1, 0, 0), Vector3d(0, 0.1, 0)}) {
    shots.push_back(Photograph(
        surface, kCamera, Facing(centre),
        [](const Vector3d& p, const Vector3d&) { return Texture(p, p.z() > 10 ? 180 : 0.18); }));
  }
  const auto views = ViewsOf(shots);
  const DepthImage& truth = shots[0].truth;
  const DepthEstimate estimate = Run(views, {0.8, 1500}, outcome);
  Expected expected{.max_past_1px = 0.02,
                    .past_reason =
                        "wrong depth is worse than none: two pixels in a hundred, a choice: one of "
                        "surfaces, one where windows along the outline hold both"};
  AddScore(ScoreFirst(views, estimate, truth, [&](int x, int y) { return truth(x, y) < 10; }),
           shots[0], expected, outcome, ", near");
  // 0.008 px of disparity: all that can be told is that it is far, with a sigma that says so.
  expected.min_kept = 0.93;
  expected.kept_reason = "windows within 3 px of the sphere's outline, 125 px long, hold both: 7 %";
  const Score far =
      ScoreFirst(views, estimate, truth, [&](int x, int y) { return truth(x, y) > 10; });
  AddScore(far, shots[0], expected, outcome, ", far");
  outcome.Add(AtLeast("errors within 3 of their own sigmas, share, far", far.within_3_sigma, 0.9,
                      "0.008 px of disparity: the sigma must say that it is only known to be far"));
  return outcome;
}

Outcome WithoutTexture() {
  Outcome outcome;
  auto shots = ShotsFrom(Plane({0, 0, 1}, 4),
                         {Facing({0, 0, 0}), Facing({0.4, 0, 0}), Facing({-0.4, 0, 0})});
  std::uint64_t n = 0;
  for (Shot& shot : shots) {
    for (std::uint8_t& value : shot.image.data()) {
      value = static_cast<std::uint8_t>(127 + HashBits(n++) % 3);
    }
  }
  const auto views = ViewsOf(shots);
  AddNothingKept(ScoreFirst(views, Run(views, kRange, outcome), shots[0].truth), 0.01,
                 "noise of one level agrees by chance alone", outcome);
  return outcome;
}

Outcome Repetition() {
  Outcome outcome;
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
    AddNothingKept(ScoreFirst(views, Run(views, {2, 16}, outcome), shots[0].truth), 0.05,
                   "three depths explain the images alike; a border of one pixel is 5 %", outcome,
                   count == 2 ? ", 2 views" : ", 3 views");
  }
  return outcome;
}

/// As a camera would have taken it: in linear light, clipped at white, sRGB-coded again.
void Expose(double factor, ImageRgb8& image) {
  for (std::uint8_t& value : image.data()) {
    const double code = value / 255.0;
    const double light =
        factor * (code <= 0.04045 ? code / 12.92 : std::pow((code + 0.055) / 1.055, 2.4));
    const double coded = light <= 0.0031308
                             ? 12.92 * light
                             : 1.055 * std::pow(std::min(light, 1.0), 1 / 2.4) - 0.055;
    value = static_cast<std::uint8_t>(255 * coded + 0.5);
  }
}

Outcome Exposure() {
  Outcome outcome;
  auto shots = ShotsFrom(Slanted(), {Facing({0, 0, 0}), Facing({0.4, 0, 0}), Facing({-0.4, 0, 0})});
  Expose(2.0, shots[1].image);
  Expose(0.5, shots[2].image);
  const auto views = ViewsOf(shots);
  AddScore(ScoreFirst(views, Run(views, kRange, outcome), shots[0].truth), shots[0], {}, outcome);
  return outcome;
}

Outcome OneBit() {
  Outcome outcome;
  auto shots = ShotsFrom(Slanted(), {Facing({0, 0, 0}), Facing({0.4, 0, 0}), Facing({-0.4, 0, 0})});
  for (Shot& shot : shots) {
    for (std::uint8_t& value : shot.image.data()) value = value < 128 ? 0 : 255;
  }
  const auto views = ViewsOf(shots);
  const Score score = ScoreFirst(views, Run(views, kRange, outcome), shots[0].truth);
  outcome.Add(AtLeast("share of pixels with depth", score.kept, 0.5,
                      "where a window holds an edge; black and white areas have none"));
  outcome.Add(AtMost("median error, px", score.median_px, 0.5 / std::sqrt(3.0),
                     "an edge is known to half a pixel: a uniform law of that half-width"));
  outcome.Add(AtMost("share of these off by more than 1 px", score.past_1px, 0.05,
                     "edges are off by 0.5 px in each image at most; windows hold several"));
  return outcome;
}

Outcome CopiesOfOnePhoto() {
  Outcome outcome;  // all lies at infinity, which the range excludes
  auto shots = ShotsFrom(Slanted(), {Facing({0, 0, 0}), Facing({0.4, 0, 0}), Facing({0, 0, 0})});
  shots[1].image = shots[0].image;
  const auto views = ViewsOf(shots);
  AddNothingKept(
      ScoreFirst({views[0], views[1]}, Run({views[0], views[1]}, kRange, outcome), shots[0].truth),
      0.05, "zero disparity is infinity, beyond the range", outcome, ", other position");
  AddNothingKept(
      ScoreFirst({views[0], views[2]}, Run({views[0], views[2]}, kRange, outcome), shots[0].truth),
      0, "no baseline", outcome, ", same position");
  return outcome;
}

/// Share of pixels whose depth, after undoing a scale of the world, is off by more than 1e-5.
double ChangedShare(const DepthImage& base, const DepthImage& other, double scale) {
  int changed = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double z = base(x, y), moved = other(x, y) / scale;
      changed += !(std::abs(moved - z) <= 1e-5 * std::max(z, moved));
    }
  }
  return static_cast<double>(changed) / (kWidth * kHeight);
}

Outcome UnitAndOrigin() {
  Outcome outcome;
  const auto shots = ShotsFrom(
      SphereBeforeWall(), {Facing({0, 0, 0}), Facing({0.4, 0, 0}, 10), Facing({0, 0.4, 0}, -5)});
  const auto in_world = [&](double scale, const Vector3d& offset) {
    auto views = ViewsOf(shots);
    for (StereoView& view : views) {
      const Vector3d centre = scale * view.cam_from_world.TargetOriginInSource() + offset;
      view.cam_from_world.translation = -(view.cam_from_world.rotation * centre);
    }
    return Run(views, {kRange.near_z * scale, kRange.far_z * scale}, outcome).depth;
  };
  const DepthImage base = in_world(1, {0, 0, 0});
  const char* reason = "the world's unit and origin do not matter";
  for (const double scale : {1e-6, 1e6}) {
    outcome.Add(
        Exactly(std::string("share of pixels that change, unit ") + (scale < 1 ? "1e-6" : "1e6"),
                ChangedShare(base, in_world(scale, {0, 0, 0}), scale), 0, reason));
  }
  outcome.Add(Exactly("share of pixels that change, 1e7 away",
                      ChangedShare(base, in_world(1, {1e7, -1e7, 1e7}), 1), 0, reason));
  return outcome;
}

}  // namespace

std::vector<Case> StereoCases() {
  const auto baseline = [](double share) { return [share]() { return SmallBaseline(share); }; };
  return {{kStereoStage, "baseline / depth 1e-4, a long lens", true, baseline(1e-4)},
          {kStereoStage, "baseline / depth 1e-3, a long lens", false, baseline(1e-3)},
          {kStereoStage, "baseline / depth 1e-2, a long lens", false, baseline(1e-2)},
          {kStereoStage, "baseline / depth 1e-4, a short lens", true, LessThanNoise},
          {kStereoStage, "baseline / depth 0.1, two views", true, BaselineOfATenth},
          {kStereoStage, "baseline / depth 1", true, BaselineAsLongAsTheDepth},
          {kStereoStage, "depths 1 : 1000 in one image", true, DepthsOneToAThousand},
          {kStereoStage, "no texture", true, WithoutTexture},
          {kStereoStage, "a pattern that repeats 3 times within the range", true, Repetition},
          {kStereoStage, "exposure +-1 EV between neighbours", true, Exposure},
          {kStereoStage, "1-bit images", true, OneBit},
          {kStereoStage, "copies of one photo", true, CopiesOfOnePhoto},
          {kStereoStage, "worlds in other units, 1e7 from the origin", true, UnitAndOrigin}};
}

}  // namespace dtr::selftest
