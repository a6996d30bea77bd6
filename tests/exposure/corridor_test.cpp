// Gains of an exact scene that was photographed with one exposure: a corridor, walked along.
#include <gtest/gtest.h>

#include <cmath>

#include "datasets/layout.h"
#include "datasets/render_truth.h"
#include "datasets/scene_builder.h"
#include "dtr/base/random.h"
#include "dtr/exposure/estimate_gains.h"
#include "dtr/render/colour.h"
#include "dtr/render/exposure.h"

namespace dtr::datasets {
namespace {

using Eigen::Vector3d;
using Pattern = Material::Pattern;

constexpr int kViews = 8, kWidth = 320, kHeight = 240;
constexpr double kHalfWidth = 1.2, kTop = 2.6, kLength = 24, kEye = 1.5;

// Along +y, with a lamp at its far end, so that walls brighten on the way.
Scene MakeCorridor() {
  SceneBuilder b(4);
  const int wall = b.Add({.pattern = Pattern::kPlaster,
                          .color = {0.62, 0.55, 0.45},
                          .color2 = {0.40, 0.36, 0.32},
                          .contrast = 0.5});
  const int floor = b.Add({.pattern = Pattern::kPaving,
                           .color = {0.40, 0.36, 0.33},
                           .color2 = {0.12, 0.11, 0.10},
                           .cell = 0.5});
  const int door = b.Add(
      {.pattern = Pattern::kPainting, .color = {0.35, 0.22, 0.15}, .cell = 0.7, .contrast = 0.4});
  const Vector3d along = 0.5 * kLength * Vector3d::UnitY(), up = 0.5 * kTop * Vector3d::UnitZ();
  const Vector3d across = kHalfWidth * Vector3d::UnitX();
  b.Rectangle(along, along, across, floor);
  b.Rectangle(along + 2 * up, along, across, wall);
  b.Rectangle(along - across + up, along, up, wall);
  b.Rectangle(along + across + up, along, up, wall);
  b.Rectangle(2 * along + up, across, up, door);
  for (int k = 0; k < 5; ++k) {
    b.Box({(k % 2 == 0 ? -1 : 1) * kHalfWidth, 3.0 + 4 * k, 1.0}, {0.08, 0.5, 1.0}, door);
  }
  Lighting light;
  light.is_sun = false;
  light.source = {0, 0.8 * kLength, kTop - 0.2};
  light.direct = 0.6 * Vector3d::Ones();
  light.from_above = light.from_below = 0.35 * Vector3d::Ones();
  light.lamp_reach = 6;
  return std::move(b).Build("corridor", light, {});
}

std::vector<Pose> Walk() {
  std::vector<Pose> poses;
  for (int k = 0; k < kViews; ++k) {
    const Vector3d eye(0.15 * std::sin(2.3 * k), 0.5 + 0.5 * k, kEye + 0.05 * std::cos(1.7 * k));
    poses.push_back(LookAt(eye, eye + Vector3d(0.1 * std::sin(1.1 * k), 4, -0.3)));
  }
  return poses;
}

std::vector<View> Photographed() {
  const PinholeCamera camera(kWidth, kHeight, 230, 230, kWidth / 2.0, kHeight / 2.0);
  PhotoOptions options;
  options.supersampling = 2;
  options.noise_sigma = 1.5;
  return RenderTruthSet(MakeCorridor(), camera, Walk(), options).frames.front().views;
}

std::vector<Vector3d> GainsOf(const std::vector<View>& views) {
  std::vector<SmallView> small;
  std::vector<std::vector<int>> partners(views.size());
  for (const View& view : views) small.push_back(ShrinkForGains(view));
  for (int i = 0; i < kViews; ++i) {
    for (int j = std::max(0, i - 3); j <= std::min(kViews - 1, i + 3); ++j) {
      if (j != i) partners[static_cast<size_t>(i)].push_back(j);
    }
  }
  return EstimateGains(small, partners);
}

// As stereo errs on bare walls: the walls of the left half nearer in all maps, so that they agree
// with each other on another surface than the photos show.
void BringNearer(std::vector<View>& views, double share) {
  for (View& view : views) {
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth / 2; ++x) {
        view.depth(x, y) = static_cast<float>(view.depth(x, y) * (1 - share));
      }
    }
  }
}

// A glossy floor shows the lamp, for each camera elsewhere.
void Gloss(std::vector<View>& views) {
  for (size_t k = 0; k < views.size(); ++k) {
    for (int y = 3 * kHeight / 5; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const double off = (x - kWidth * (0.3 + 0.06 * static_cast<double>(k))) / (0.2 * kWidth);
        const double by = 1 + 0.7 * std::exp(-off * off);
        for (int c = 0; c < 3; ++c) {
          std::uint8_t& value = views[k].image(x, y, c);
          value = Srgb8FromLinear(Exposed(LinearFromSrgb8()[value], by));
        }
      }
    }
  }
}

TEST(Corridor, OfOneExposureHasNoGains) {
  for (const Vector3d& gain : GainsOf(Photographed())) EXPECT_EQ(gain, Vector3d::Ones());
}

TEST(Corridor, WrongDepthOfAWallIsNoExposure) {
  std::vector<View> views = Photographed();
  BringNearer(views, 0.15);
  for (const Vector3d& gain : GainsOf(views)) EXPECT_EQ(gain, Vector3d::Ones());
}

TEST(Corridor, AGlossyFloorIsNoExposure) {
  std::vector<View> views = Photographed();
  Gloss(views);
  for (const Vector3d& gain : GainsOf(views)) EXPECT_EQ(gain, Vector3d::Ones());
}

TEST(Corridor, RealExposuresAreFoundAllTheSame) {
  std::vector<View> views = Photographed();
  Gloss(views);
  BringNearer(views, 0.15);
  for (size_t k = 1; k < views.size(); k += 2) {
    for (std::uint8_t& value : views[k].image.data()) {
      value = Srgb8FromLinear(std::min(1.0, 1.6 * LinearFromSrgb8()[value]));
    }
  }
  const std::vector<Vector3d> gains = GainsOf(views);
  constexpr double kWithin = 0.01;
  for (size_t k = 0; k + 1 < gains.size(); k += 2) {
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(gains[k][c] / gains[k + 1][c], 1.6, kWithin * 1.6);
  }
}

}  // namespace
}  // namespace dtr::datasets
