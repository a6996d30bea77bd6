// Rendering where scales, cameras or surfaces are at their limits, both methods, by any renderer.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "cli/selftest/drawing.h"
#include "dtr/base/random.h"
#include "dtr/render/scene.h"

namespace dtr::selftest {
namespace {

using testing::kNoHit;
using testing::Moved;
using testing::OptionsOf;
using testing::Photograph;
using testing::Plane;
using testing::SetOf;
using testing::ShareApart;
using testing::Shot;
using testing::ShotFrom;
using testing::Square;
using testing::Surface;
using testing::Union;

/// `count` views `step` apart on the x axis, all looking at `target`.
DtrSet OnALine(const Surface& surface, int count, double step, const Eigen::Vector3d& target,
               double texture_period = 4) {
  std::vector<View> views;
  for (int i = 0; i < count; ++i) {
    Shot shot =
        ShotFrom("v" + std::to_string(1000 + i), {step * (i - 0.5 * (count - 1)), 0, 0}, target);
    shot.texture_period = texture_period;
    views.push_back(Photograph(surface, shot));
  }
  return SetOf(std::move(views));
}

Outcome NearAndFar(Drawing draw) {
  Outcome outcome;
  // A square 0.01 away before a plane a million times farther; 10 px of disparity from view to
  // view.
  const Surface surface = Union(Square(0, 0, 0.01, 0.002), Plane({0, 0, 1}, 1e4));
  const DtrSet set = OnALine(surface, 5, 0.001, {0, 0, 1e4});
  const Shot novel = ShotFrom("n", {0.0004, 0.0002, 0.0005}, {0, 0, 1e4});
  const View truth = Photograph(surface, novel);
  for (const RenderMethod method : draw.methods()) {
    const Score score = ScoreOf(draw.Draw(set, novel, OptionsOf(method)), truth, 0.01);
    outcome.Add(AtLeast(std::string("share of the image that is seen") + InWords(method),
                        score.seen, 0.95, "five views see all but a rim"));
    outcome.Add(AtLeast(std::string("share of it with the depth within 1 %") + InWords(method),
                        score.right, 0.95, "the square's outline of 170 px may lie a pixel off"));
  }
  return draw.Finish(outcome);
}

/// A view's own map drawn from its own place by that view alone.
struct GivenBack {
  static constexpr float kNearest = 2e-3f;  ///< beyond the near plane, 0.0015 at most
  double measured = 0, back = 0;            ///< pixels that have a depth, and those drawn with it
  double made_up = 0;                       ///< pixels drawn where the map has none
  void Count(const RenderResult& result, const DepthImage& map) {
    for (int y = 0; y < map.height(); ++y) {
      for (int x = 0; x < map.width(); ++x) {
        const float z = map(x, y);
        if (z >= kNearest && z <= 1e3f) {
          ++measured;
          back += std::abs(result.depth(x, y) / z - 1) <= 1e-3;
        } else if (DepthImage::IsHole(z) || std::isinf(z)) {
          made_up += result.coverage(x, y) != 0;
        }
      }
    }
  }
};

// Depths from 0.001 to 1000 at random in one map, holes, and depths that no camera measures.
Outcome WildDepth(Drawing draw) {
  Outcome outcome;
  DtrSet set = testing::SquareBeforePlane();
  Random random(5);
  constexpr float kOdd[] = {0, -1, 1e-38f, 3e38f, INFINITY, NAN};
  for (View& view : set.frames[0].views) {
    for (float& z : view.depth.grid().data()) {
      z = static_cast<float>(std::pow(10.0, random.Uniform(-3, 3)));
      if (random.Index(9) == 0) z = kOdd[random.Index(6)];
    }
  }
  for (const RenderMethod method : draw.methods()) {
    double min_seen = 1;
    for (const double x : {0.0, 0.3, 2.0}) {
      const Shot novel = ShotFrom("n", {x, 0.1, 0}, {0, 0, 9});
      min_seen = std::min(min_seen, draw.Draw(set, novel, OptionsOf(method)).coverage_share);
    }
    RenderOptions alone = OptionsOf(method);
    alone.views = 1;
    GivenBack given;
    for (const View& view : set.frames[0].views) {
      Shot own;
      own.cam_from_world = view.cam_from_world;
      given.Count(draw.Draw(set, own, alone), view.depth);
    }
    outcome.Add(AtLeast(std::string("smallest share of an image that is seen") + InWords(method),
                        min_seen, 0.5,
                        "19 of 20 samples are cells of their own, most behind others; seen: 0.63"));
    outcome.Add(AtLeast(std::string("share of a view's depths that are drawn at its own position") +
                            InWords(method),
                        given.back / given.measured, 0.999, "each pixel is a cell of its own"));
    outcome.Add(
        Exactly(std::string("pixels drawn where a view alone has no depth") + InWords(method),
                given.made_up, 0, "what no view saw is not shown"));
  }
  return draw.Finish(std::move(outcome));
}

/// Images of a world that is scaled or moved against those of the world at home.
Outcome InWorlds(Drawing draw, const std::vector<std::pair<double, Eigen::Vector3d>>& worlds,
                 const char* reason) {
  Outcome outcome;
  const Surface surface = Union(Union(testing::Sphere({-1, 0.3, 6}, 1.2), Square(1, -0.4, 7, 0.8)),
                                Plane({0.2, 0, 1}, 11));
  const DtrSet set = testing::FromAround(surface, 6, 0.7, {0, 0, 9});
  const Shot novel = ShotFrom("n", {0.17, 0.11, 0.3}, {0.2, -0.1, 10});
  for (const RenderMethod method : draw.methods()) {
    const RenderResult home = draw.Draw(set, novel, OptionsOf(method));
    double worst = 0;
    for (const auto& [scale, offset] : worlds) {
      worst = std::max(
          worst, ShareApart(home, draw.Draw(Moved(set, scale, offset), Moved(novel, scale, offset),
                                            OptionsOf(method))));
    }
    outcome.Add(
        AtMost(std::string("share of pixels that change by more than a level") + InWords(method),
               worst, testing::kOutlineShare, reason));
  }
  return draw.Finish(outcome);
}

Outcome Scaled(Drawing draw) {
  return InWorlds(std::move(draw), {{1e-6, {0, 0, 0}}, {1e6, {0, 0, 0}}},
                  "rounding moves a vertex by 1e-4 px; pixels on outlines may change hands");
}

Outcome FarFromTheOrigin(Drawing draw) {
  return InWorlds(std::move(draw), {{1, {1e7, -1e7, 1e7}}},
                  "positions at 1e7 are rounded to 2e-9; pixels on outlines may change hands");
}

Outcome GrazingPlane(Drawing draw) {
  Outcome outcome;
  // A floor 0.02 below cameras that look along it: the topmost row meets it at 0.3 degrees.
  const Surface floor = Plane({0, 1, 0}, 0.02);
  std::vector<View> views;
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector3d centre(0.01 * (i % 2), -0.004 * (i / 2), 0);
    views.push_back(Photograph(
        floor, ShotFrom("v" + std::to_string(i), centre, centre + Eigen::Vector3d(0, 0, 1))));
  }
  const DtrSet set = SetOf(std::move(views));
  const Shot novel = ShotFrom("n", {0.004, -0.002, 0.002}, {0.004, -0.002, 1});
  const View truth = Photograph(floor, novel);
  for (const RenderMethod method : draw.methods()) {
    const Score score = ScoreOf(draw.Draw(set, novel, OptionsOf(method)), truth, 0.02);
    outcome.Add(AtLeast(std::string("share of the floor that is seen") + InWords(method),
                        score.seen, 0.9,
                        "one row at the horizon of 36 is beyond what the views saw; rims"));
    outcome.Add(AtLeast(std::string("share of it with the depth within 2 %") + InWords(method),
                        score.right, 0.95, "a plane is interpolated exactly"));
  }
  return draw.Finish(outcome);
}

/// A strip from top to bottom at z, facing -z.
Surface Rod(double x, double z, double half_width) {
  return [=](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
    const double t = (z - o.z()) / d.z();
    return d.z() != 0 && t > 0 && std::abs(o.x() + t * d.x() - x) <= half_width ? t : kNoHit;
  };
}

Outcome OnePixelRods(Drawing draw) {
  Outcome outcome;
  Surface surface = Plane({0, 0, 1}, 10);
  for (int k = -3; k <= 3; ++k) surface = Union(surface, Rod(0.55 * k + 0.02, 5, 0.025));
  const DtrSet set = OnALine(surface, 5, 0.3, {0, 0, 10});
  Shot input;
  input.cam_from_world = set.frames[0].views[2].cam_from_world;
  for (const auto& [novel, where, least] :
       {std::tuple{input, ", from an input camera", 0.99},
        {ShotFrom("n", {0.1, 0.05, 0}, {0, 0, 10}), ", between cameras", 0.8}}) {
    const DepthImage truth = Photograph(surface, novel).depth;
    for (const RenderMethod method : draw.methods()) {
      const RenderResult result = draw.Draw(set, novel, OptionsOf(method));
      double rods = 0, found = 0;
      for (int y = 0; y < truth.height(); ++y) {
        for (int x = 0; x < truth.width(); ++x) {
          if (truth(x, y) > 7) continue;
          ++rods;
          for (int i = std::max(0, x - 1); i <= std::min(truth.width() - 1, x + 1); ++i) {
            if (result.coverage(i, y) == 0 || std::abs(result.depth(i, y) / 5 - 1) > 0.02) continue;
            ++found;
            break;
          }
        }
      }
      outcome.Add(AtLeast(std::string("share of the rods' pixels that are drawn within a pixel") +
                              where + InWords(method),
                          found / rods, least,
                          least > 0.9 ? "the view itself has them all"
                                      : "a rod of one pixel may fall between two pixel centres"));
    }
  }
  return draw.Finish(outcome);
}

Outcome ZoomedIn(Drawing draw) {
  Outcome outcome;
  const Surface surface = Plane({0.4, 0.1, 0.9}, 8);
  const DtrSet set = testing::FromAround(surface, 4, 0.8, {0, 0, 9});
  Shot novel = ShotFrom("n", {0.17, 0.11, 0.3}, {0.2, -0.1, 10});
  novel.camera = PinholeCamera(96, 72, 1e5, 1e5, 48, 36);
  const View truth = Photograph(surface, novel);
  for (const RenderMethod method : draw.methods()) {
    const Score score = ScoreOf(draw.Draw(set, novel, OptionsOf(method)), truth, 1e-4);
    outcome.Add(Exactly(std::string("share of the image that is seen") + InWords(method),
                        score.seen, 1, "a tenth of a pixel of the views, well inside of them"));
    outcome.Add(AtLeast(std::string("share of it with the depth within 1e-4") + InWords(method),
                        score.right, 0.99, "a plane is interpolated exactly"));
  }
  return draw.Finish(outcome);
}

/// Pixels of the true image whose surface lies in the image of some view: all of a plane in
/// the union of the views' frusta.
double Photographed(const View& truth, const DtrSet& set) {
  const Pose world_from_cam = truth.cam_from_world.Inverse();
  double count = 0;
  for (int y = 0; y < truth.depth.height(); ++y) {
    for (int x = 0; x < truth.depth.width(); ++x) {
      if (DepthImage::IsHole(truth.depth(x, y))) continue;
      const Eigen::Vector3d point =
          world_from_cam *
          (truth.depth(x, y) * truth.camera.RayFromPixel({x + 0.5, y + 0.5})).eval();
      count += std::ranges::any_of(set.frames[0].views, [&](const View& view) {
        const auto pixel = view.camera.PixelFromCam(view.cam_from_world * point);
        return pixel && view.camera.Contains(*pixel);
      });
    }
  }
  return count;
}

Outcome FieldsOfView(Drawing draw) {
  Outcome outcome;
  const Surface surface = Plane({0.4, 0.1, 0.9}, 8);
  const DtrSet set = testing::FromAround(surface, 4, 0.8, {0, 0, 9});
  for (const double degrees : {1.0, 10.0, 60.0, 120.0, 170.0, 179.0}) {
    Shot novel = ShotFrom("n", {0.17, 0.11, 0.3}, {0.2, -0.1, 10});
    const double focal = 48 / std::tan(degrees / 360 * std::numbers::pi);
    // A pixel's centre lies on the axis: at 179 degrees two pixels see all that the views saw.
    novel.camera = PinholeCamera(96, 72, focal, focal, 48.5, 36.5);
    const View truth = Photograph(surface, novel);
    const double photographed = Photographed(truth, set);
    const std::string at = std::to_string(static_cast<int>(degrees)) + " degrees";
    for (const RenderMethod method : draw.methods()) {
      const RenderResult result = draw.Draw(set, novel, OptionsOf(method));
      const Score score = ScoreOf(result, truth, 0.01);
      if (degrees <= 10) {
        outcome.Add(Exactly("share of the image that is seen, " + at + InWords(method), score.seen,
                            1, "well inside of all views"));
      }
      const auto seen = static_cast<double>(std::ranges::count(result.coverage.data(), 255));
      outcome.Add(AtMost(
          "pixels seen against those whose surface a view shows, share, " + at + InWords(method),
          std::abs(seen / photographed - 1), 0.05,
          "all that the views' frusta hold, give or take their rim"));
      outcome.Add(
          AtLeast("share of what is seen with the depth within 1 %, " + at + InWords(method),
                  score.right, 0.98, "a plane is interpolated exactly; rims"));
    }
  }
  return draw.Finish(outcome);
}

Outcome EmptySets(Drawing draw) {
  Outcome outcome;
  const Shot novel = ShotFrom("n", {0, 0, 0}, {0, 0, 9});
  DtrSet holes = testing::SquareBeforePlane();
  for (View& view : holes.frames[0].views) view.depth = DepthImage(96, 72);
  const DtrSet whole = testing::SquareBeforePlane();
  double seen = 0;
  for (const RenderMethod method : draw.methods()) {
    for (const Primitive primitive : {Primitive::kMesh, Primitive::kSplat}) {
      RenderOptions options = OptionsOf(method);
      options.primitive = primitive;
      options.fill_holes = true;
      seen += draw.Draw(RenderScene{}, novel, options).coverage_share;
      seen += draw.Draw(holes, novel, options).coverage_share;
      seen += draw.Draw(whole, ShotFrom("n", {0, 0, 30}, {0, 0, 10}), options).coverage_share;
    }
  }
  outcome.Add(Exactly("share seen of no views, of holes alone, from behind", seen, 0,
                      "what no view saw is not shown"));
  ExpectRejection(outcome, "a set without a frame", [] { MakeRenderScene(DtrSet{}); });
  return draw.Finish(outcome);
}

}  // namespace

std::vector<Case> RenderingCases(std::span<const NamedRenderer> renderers) {
  const std::tuple<const char*, Outcome (*)(Drawing)> kCases[] = {
      {"near : far = 1 : 1e6", NearAndFar},
      {"depths at random, NaN and infinity among them", WildDepth},
      {"worlds in units of 1e-6 and 1e6", Scaled},
      {"a world 1e7 units from its origin", FarFromTheOrigin},
      {"a plane seen at 0.3 to 20 degrees", GrazingPlane},
      {"rods of one pixel", OnePixelRods},
      {"zoom x 1000", ZoomedIn},
      {"fields of view of 1 to 179 degrees", FieldsOfView},
      {"empty sets", EmptySets},
      {"256 views at once, in any order", ManyViews},
      {"duplicate cameras", DuplicateCameras},
      {"cos^1000, e^(-1e6 t), limits of 0.001 rad", ExtremeWeights}};
  std::vector<Case> all;
  for (const NamedRenderer& renderer : renderers) {
    for (const auto& [name, run] : kCases) {
      all.push_back({"Rendering, " + renderer.name, name, run != ManyViews,
                     [renderer, run = run]() { return run(Drawing(renderer)); }, renderer.missing});
    }
  }
  return all;
}

}  // namespace dtr::selftest
