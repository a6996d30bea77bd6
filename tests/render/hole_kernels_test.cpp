// SPEC 7.2 and 7.3: the kernels against the same steps one by one in plain double precision, to the
// bit: images must not depend on what a processor's vectors hold.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "dtr/base/random.h"
#include "dtr/render/blend_weights.h"
#include "dtr/render/geometry.h"
#include "dtr/render/guess_kernel.h"
#include "dtr/render/guessed_colours.h"
#include "dtr/render/hole_cost.h"
#include "dtr/render/plane_support.h"
#include "tests/support/instruction_sets.h"

namespace dtr {
namespace {

using V2 = Eigen::Vector2d;
using V3 = Eigen::Vector3d;

constexpr int kWidth = 60, kHeight = 44, kCellPx = 6;

V3 At(const double* values) { return {values[0], values[1], values[2]}; }

/// A map with holes; what the kernels' views point to.
struct Photo {
  int scale = 1;
  Grid<float> depth;
  Grid<float> cells;
};

Photo RandomPhoto(int scale, Random& random) {
  Photo photo{scale, Grid<float>(kWidth / scale, kHeight / scale),
              Grid<float>((kWidth + kCellPx - 1) / kCellPx, (kHeight + kCellPx - 1) / kCellPx, 4)};
  for (float& z : photo.depth.data()) {
    z = random.Index(3) == 0 ? 0.0f : static_cast<float>(random.Uniform(3, 9));
  }
  for (int y = 0; y < photo.cells.height(); ++y) {
    for (int x = 0; x < photo.cells.width(); ++x) {
      if (random.Index(12) == 0) continue;
      for (int c = 0; c < 3; ++c) photo.cells(x, y, c) = static_cast<float>(random.Uniform(0, 255));
      photo.cells(x, y, 3) = 1;
    }
  }
  return photo;
}

bool OnPhoto(const V3& p, const V2& pixel) {
  return p.z() > 0 && PinholeCamera(kWidth, kHeight, 1, 1, 0, 0).Contains(pixel);
}

float DepthAt(const Photo& photo, const V2& pixel) {
  return photo.depth(static_cast<int>(pixel.x()) / photo.scale,
                     static_cast<int>(pixel.y()) / photo.scale);
}

/// Of homogeneous pixels around the photo's middle.
void Place(Random& random, double* at_0, double* per_w) {
  at_0[0] = random.Uniform(0, kWidth), at_0[1] = random.Uniform(0, kHeight), at_0[2] = 1;
  for (int i = 0; i < 3; ++i) per_w[i] = random.Uniform(-1, 1) * (i == 2 ? 1 : 100);
}

CostView CostViewOf(const Photo& photo, Random& random) {
  CostView view{};
  Place(random, view.pixel_at_infinity, view.pixel_per_inverse_depth);
  for (double& c : view.centre) c = random.Uniform(-1, 1);
  view.tolerance = 0.05;
  view.width_px = kWidth, view.height_px = kHeight;
  view.depth = photo.depth.data().data();
  view.depth_columns = photo.depth.width(), view.depth_scale = photo.scale;
  view.cells = photo.cells.data().data();
  view.cell_columns = photo.cells.width(), view.cell_rows = photo.cells.height();
  return view;
}

struct Shown {
  double angle;
  std::array<float, 3> rgb;
};

bool CellColour(const Grid<float>& cells, const V2& pixel, std::array<float, 3>& rgb) {
  const double u = std::clamp(pixel.x() / kCellPx - 0.5, 0.0, cells.width() - 1.0);
  const double v = std::clamp(pixel.y() / kCellPx - 0.5, 0.0, cells.height() - 1.0);
  const int x0 = static_cast<int>(u), y0 = static_cast<int>(v);
  const int x1 = std::min(x0 + 1, cells.width() - 1), y1 = std::min(y0 + 1, cells.height() - 1);
  const auto fx = static_cast<float>(u - x0), fy = static_cast<float>(v - y0);
  for (const int y : {y0, y1}) {
    for (const int x : {x0, x1}) {
      if (cells(x, y, 3) == 0) return false;
    }
  }
  for (int c = 0; c < 3; ++c) {
    rgb[static_cast<size_t>(c)] = (1 - fy) * ((1 - fx) * cells(x0, y0, c) + fx * cells(x1, y0, c)) +
                                  fy * ((1 - fx) * cells(x0, y1, c) + fx * cells(x1, y1, c));
  }
  return true;
}

/// Twice the weighted mean distance of the nearest four views' colours from their weighted mean.
float PlainDisagreement(std::vector<Shown> shown) {
  constexpr double kFloor = 0.02;
  if (shown.empty()) return 40;
  if (shown.size() == 1) return 20;
  std::stable_sort(shown.begin(), shown.end(),
                   [](const Shown& a, const Shown& b) { return a.angle < b.angle; });
  shown.resize(std::min<size_t>(shown.size(), 4));
  std::array<double, 3> mean{};
  double weights = 0, distance = 0;
  for (const Shown& s : shown) {
    weights += 1 / (s.angle + kFloor);
    for (size_t c = 0; c < 3; ++c) {
      mean[c] += 1 / (s.angle + kFloor) * static_cast<double>(s.rgb[c]);
    }
  }
  for (const Shown& s : shown) {
    for (size_t c = 0; c < 3; ++c) {
      const double off = std::abs(static_cast<double>(s.rgb[c]) - mean[c] / weights);
      distance += off / (s.angle + kFloor) / 3;
    }
  }
  return std::min(40.0f, static_cast<float>(2 * distance / weights));
}

float PlainCost(const CostPlace& place, const std::vector<CostView>& views,
                const std::vector<Photo>& photos, double w, size_t& answers) {
  const V3 ray = At(place.ray);
  std::vector<Shown> shown;
  double asked = 0, through = 0;
  for (size_t i = 0; i < views.size(); ++i) {
    const V3 p = At(views[i].pixel_at_infinity) + w * At(views[i].pixel_per_inverse_depth);
    const V2 pixel = p.head<2>() / p.z();
    if (!OnPhoto(p, pixel)) continue;
    const V3 c = w * At(views[i].centre);
    const double angle = QuickAngle(c.cross(ray).norm(), ray.squaredNorm() - c.dot(ray));
    asked += 1 / (angle + 0.02);
    const float z = DepthAt(photos[i], pixel);
    if (z > 0) {
      const double nearer = 1 / static_cast<double>(z) - w / p.z();
      if (nearer < -views[i].tolerance) through += 1 / (angle + 0.02);
      if (std::abs(nearer) > views[i].tolerance) continue;
    }
    Shown s{angle, {}};
    if (CellColour(photos[i].cells, pixel, s.rgb)) shown.push_back(s);
  }
  answers = shown.size();
  const float cost = PlainDisagreement(shown);
  return asked > 0 ? cost + 40 * static_cast<float>(through / asked) : cost;
}

void CheckHoleCosts() {
  Random random(11);
  std::array<int, 9> met{};  // by the number of views that answered
  for (int trial = 0; trial < 1000; ++trial) {
    std::vector<Photo> photos;
    std::vector<CostView> views;
    const int count = random.Index(9);
    for (int i = 0; i < count; ++i) photos.push_back(RandomPhoto(1 + trial % 2, random));
    for (const Photo& photo : photos) views.push_back(CostViewOf(photo, random));
    CostPlace place{{random.Uniform(-1, 1), random.Uniform(-1, 1), 1}, 0, kCellPx};
    place.ray_squared = At(place.ray).squaredNorm();
    std::vector<double> w(static_cast<size_t>(1 + random.Index(20)));
    for (double& value : w) value = random.Uniform(0.01, 0.6);
    std::vector<float> costs(w.size());
    HoleCosts(place, views, w, costs.data());
    for (size_t i = 0; i < w.size(); ++i) {
      size_t answers = 0;
      EXPECT_EQ(costs[i], PlainCost(place, views, photos, w[i], answers)) << trial;
      ++met[answers];
    }
  }
  for (size_t answers = 0; answers < 6; ++answers) EXPECT_GT(met[answers], 20) << answers;
}

TEST(HoleCosts, AreThoseOfPlainDoublesToTheBit) {
  testing::WithEachInstructionSet([](auto) { CheckHoleCosts(); });
}

/// Pixels of a row before some views, and the views.
struct Guesses {
  std::vector<Photo> photos;
  std::vector<GuessView> views;
  GuessRow row{30, 25, 0.3};
  GuessLanes x, farthest, nearest;

  explicit Guesses(Random& random) {
    const int count = 1 + random.Index(8);
    for (int i = 0; i < count; ++i) photos.push_back(RandomPhoto(1 + i % 2, random));
    for (const Photo& photo : photos) {
      GuessView view{};
      Place(random, view.pixel_at_0, view.pixel_per_inverse_depth);
      view.pixel_per_x[0] = random.Uniform(-1, 1), view.pixel_per_x[1] = random.Uniform(-1, 1);
      for (double& c : view.centre) c = random.Uniform(-1, 1);
      for (double& e : view.exposure) e = random.Index(2) == 0 ? 1 : random.Uniform(0.5, 2);
      view.delta = 0.02;
      view.width_px = kWidth, view.height_px = kHeight;
      view.depth = photo.depth.data().data();
      view.depth_columns = photo.depth.width(), view.depth_scale = photo.scale;
      view.fade_width_px = 2.2;
      views.push_back(view);
    }
    for (size_t lane = 0; lane < kGuessesTogether; ++lane) {
      x[lane] = random.Index(kWidth);
      farthest[lane] = random.Uniform(0.05, 0.2);
      nearest[lane] = farthest[lane] + random.Uniform(-0.05, 0.4);
    }
  }

  V3 Homogeneous(size_t view, size_t lane, double w) const {
    const GuessView& v = views[view];
    return At(v.pixel_at_0) + x[lane] * At(v.pixel_per_x) + w * At(v.pixel_per_inverse_depth);
  }
  /// -1: the view is no witness; else its depth there times the point's inverse depth in it, once
  /// with Delta added and once taken away.
  std::array<double, 2> Measured(size_t view, size_t lane, double w, V2& pixel, bool& on) const {
    const V3 p = Homogeneous(view, lane, w);
    const double per_z = 1 / p.z();
    pixel = p.head<2>() * per_z;
    on = OnPhoto(p, pixel);
    const double z = on ? static_cast<double>(DepthAt(photos[view], pixel)) : 0;
    if (!(z > 0)) return {-1, -1};
    return {z * (w * per_z + views[view].delta), z * (w * per_z - views[view].delta)};
  }
};

void CheckFindGuesses() {
  Random random(12);
  int farthest = 0, others = 0;
  for (int trial = 0; trial < 500; ++trial) {
    const Guesses guesses(random);
    size_t sceptic = static_cast<size_t>(random.Index(static_cast<int>(guesses.views.size())));
    GuessLanes found;
    FindGuesses(guesses.views, guesses.x, guesses.farthest, guesses.nearest, sceptic, found);
    EXPECT_LT(sceptic, guesses.views.size());
    for (size_t lane = 0; lane < kGuessesTogether; ++lane) {
      const double far = guesses.farthest[lane], near = guesses.nearest[lane];
      double expected = far;
      for (int k = 7; k > 0 && near > far && expected == far; --k) {
        const double tried = far + (near - far) * k / 7;
        bool seen_through = false;
        for (size_t v = 0; v < guesses.views.size(); ++v) {
          V2 pixel;
          bool on;
          seen_through |= guesses.Measured(v, lane, tried, pixel, on)[1] > 1;
        }
        if (!seen_through) expected = tried;
      }
      EXPECT_EQ(found[lane], expected);
      ++(expected == far ? farthest : others);
    }
  }
  EXPECT_GT(farthest, 300);
  EXPECT_GT(others, 300);
}

TEST(FindGuesses, FindsTheNearestDepthThatNoViewSeesThrough) {
  testing::WithEachInstructionSet([](auto) { CheckFindGuesses(); });
}

/// As SPEC 7.4 fades a photo of 44 rows, whose rim is 2.2 px wide.
double PlainFade(const V2& pixel) {
  const double to_rim = std::min({pixel.x(), pixel.y(), kWidth - pixel.x(), kHeight - pixel.y()});
  const double t = std::clamp(to_rim / 2.2, 1e-3, 1.0);
  return t * t * (3 - 2 * t);
}

void CheckGuessAnswers() {
  constexpr double kPixelAngle = 1e-3;
  constexpr int kPower = 3;
  Random random(13);
  BlendParameters blend{BlendWeight::kInverseAngle, 8, 8, kPower, 1, kPixelAngle};
  std::array<int, 9> met{};
  for (int trial = 0; trial < 500; ++trial) {
    const Guesses guesses(random);
    GuessAnswers answers;
    answers.views.resize(guesses.views.size());
    const GuessLanes& w = guesses.farthest;
    AskViews(guesses.views, guesses.x, w, answers);
    AnglesOfViews(guesses.views, guesses.row, guesses.x, w, answers);
    for (auto& of : answers.views) {
      for (auto& channel : of.rgb) {
        for (double& light : channel) light = random.Uniform();
      }
    }
    ShareByInverseAngle(kPixelAngle, kPower, answers);
    GuessLanes rgb[3], answered;
    MixAnswers(guesses.views, answers, rgb, answered);
    for (size_t lane = 0; lane < kGuessesTogether; ++lane) {
      std::vector<double> angles, fades;
      std::vector<V3> colours;
      for (size_t v = 0; v < guesses.views.size(); ++v) {
        V2 pixel;
        bool on;
        const double against = guesses.Measured(v, lane, w[lane], pixel, on)[0];
        const GuessAnswers::OfView& of = answers.views[v];
        const bool expected = on && !(against >= 0 && against < 1);
        ASSERT_EQ(of.answers[lane], expected ? 1 : 0);
        if (!expected) continue;
        EXPECT_EQ(V2(of.pixel_x[lane], of.pixel_y[lane]), pixel);
        const V3 ray((guesses.x[lane] + 0.5 - guesses.row.cx_px) / guesses.row.fx_px,
                     guesses.row.ray_y, 1);
        const V3 c = w[lane] * At(guesses.views[v].centre);
        angles.push_back(QuickAngle(c.cross(ray).norm(), ray.squaredNorm() - c.dot(ray)));
        EXPECT_EQ(of.angle_rad[lane], angles.back());
        fades.push_back(PlainFade(pixel));
        EXPECT_EQ(of.fade[lane], fades.back());
        const double* e = guesses.views[v].exposure;
        colours.emplace_back(Exposed(of.rgb[0][lane], e[0]), Exposed(of.rgb[1][lane], e[1]),
                             Exposed(of.rgb[2][lane], e[2]));
      }
      ++met[angles.size()];
      ASSERT_EQ(answered[lane], angles.empty() ? 0 : 1);
      if (angles.empty()) continue;
      std::vector<double> shares(angles.size());
      BlendShares(blend, angles, shares);
      V3 sum = V3::Zero();
      double total = 0;
      for (size_t i = 0; i < shares.size(); ++i) {
        sum += shares[i] * fades[i] * colours[i];
        total += shares[i] * fades[i];
      }
      const V3 expected = angles.size() == 1 ? colours[0] : V3(sum / total);
      EXPECT_EQ(V3(rgb[0][lane], rgb[1][lane], rgb[2][lane]), expected);
    }
  }
  for (size_t views = 0; views < 5; ++views) EXPECT_GT(met[views], 50) << views;
}

TEST(GuessAnswers, AreThoseOfPlainDoublesToTheBit) {
  testing::WithEachInstructionSet([](auto) { CheckGuessAnswers(); });
}

void CheckPlaneSupport() {
  Random random(14);
  for (const int count : {0, 1, 7, 8, 9, 1000}) {
    PlaneSamples samples;
    for (int i = 0; i < count; ++i) {
      samples.x.push_back(random.Index(100) + 0.5);
      samples.y.push_back(random.Index(100) + 0.5);
      samples.inverse_depth.push_back(0.01 * samples.x.back() + random.Uniform(-0.1, 0.1));
    }
    // Some lie exactly at the tolerance: 0.01 x is what both sides compute there.
    const V3 plane(0.01, 0, 0);
    size_t expected = 0;
    for (size_t i = 0; i < samples.size(); ++i) {
      if (i % 5 == 0) samples.inverse_depth[i] = 0.01 * samples.x[i] - 0.05;
      const double on_plane = plane.dot(V3(samples.x[i], samples.y[i], 1));
      expected += std::abs(on_plane - samples.inverse_depth[i]) <= 0.05 ? 1 : 0;
    }
    EXPECT_EQ(PlaneSupport(samples, plane.x(), plane.y(), plane.z(), 0.05), expected) << count;
  }
}

TEST(PlaneSupport, CountsAsPlainDoublesDo) {
  testing::WithEachInstructionSet([](auto) { CheckPlaneSupport(); });
}

}  // namespace
}  // namespace dtr
