// Rendering where scales, cameras or surfaces are at their limits, both methods, by any renderer.
#include <algorithm>
#include <cmath>
#include <deque>
#include <numbers>

#include "cli/selftest/cases.h"
#include "datasets/exact/render_scenes.h"
#include "dtr/base/random.h"
#include "dtr/render/scene.h"

namespace dtr::selftest {
namespace {

using testing::kBothMethods;
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

const char* NameOf(RenderMethod method) {
  return method == RenderMethod::kTwoPass ? ", two passes" : ", deferred";
}

/// What a case draws with: one renderer, counts of what is wrong with its pictures.
class Drawing {
 public:
  Drawing(const NamedRenderer& renderer, const Conditions& conditions)
      : render_(renderer.make()), threads_(conditions.threads) {}

  RenderResult Draw(const RenderScene& scene, const Shot& novel, RenderOptions options) {
    options.threads = threads_;
    RenderResult result = render_(scene, novel.camera, novel.cam_from_world, options);
    contradictions_ += testing::Contradictions(result);
    for (const float z : result.depth.grid().data()) not_finite_ += !std::isfinite(z);
    return result;
  }
  RenderResult Draw(const DtrSet& set, const Shot& novel, const RenderOptions& options) {
    return Draw(MakeRenderScene(set), novel, options);
  }
  /// Renderers know views by their addresses: one that died could be taken for the next set's.
  RenderResult Draw(DtrSet&& set, const Shot& novel, const RenderOptions& options) {
    kept_.push_back(std::move(set));
    return Draw(kept_.back(), novel, options);
  }
  Outcome Finish(Outcome outcome) const {
    outcome.not_finite += not_finite_;
    outcome.Add(Exactly("pixels whose depth, coverage and colour contradict each other",
                        static_cast<double>(contradictions_), 0,
                        "seen, with depth and from a view are one thing"));
    return outcome;
  }

 private:
  std::deque<DtrSet> kept_;
  RenderFunction render_;
  int threads_;
  long long contradictions_ = 0, not_finite_ = 0;
};

/// A drawn depth against the true one.
struct DepthScore {
  double seen = 0;   ///< share of the true pixels that are covered
  double right = 0;  ///< share of the covered ones whose depth is within `tolerance` of the truth
};
DepthScore ScoreOf(const RenderResult& result, const DepthImage& truth, double tolerance) {
  double all = 0, seen = 0, right = 0;
  for (int y = 0; y < truth.height(); ++y) {
    for (int x = 0; x < truth.width(); ++x) {
      if (DepthImage::IsHole(truth(x, y))) continue;
      ++all;
      if (result.coverage(x, y) == 0) continue;
      ++seen;
      right += std::abs(result.depth(x, y) / truth(x, y) - 1) <= tolerance;
    }
  }
  return {all > 0 ? seen / all : 0, seen > 0 ? right / seen : 0};
}

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
  const DepthImage truth = Photograph(surface, novel).depth;
  for (const RenderMethod method : kBothMethods) {
    const DepthScore score = ScoreOf(draw.Draw(set, novel, OptionsOf(method)), truth, 0.01);
    outcome.Add(AtLeast(std::string("share of the picture that is seen") + NameOf(method),
                        score.seen, 0.95, "five views see all but a rim"));
    outcome.Add(AtLeast(std::string("share of it with the depth within 1 %") + NameOf(method),
                        score.right, 0.95, "the square's outline of 170 px may lie a pixel off"));
  }
  return draw.Finish(outcome);
}

// Depths from 0.001 to 1000 at random in one map, holes, and depths that no camera measures.
Outcome WildDepth(Drawing draw) {
  DtrSet set = testing::SquareBeforePlane();
  Random random(5);
  constexpr float kOdd[] = {0, -1, 1e-38f, 3e38f, INFINITY, NAN};
  for (View& view : set.frames[0].views) {
    for (float& z : view.depth.grid().data()) {
      z = static_cast<float>(std::pow(10.0, random.Uniform(-3, 3)));
      if (random.Index(9) == 0) z = kOdd[random.Index(6)];
    }
  }
  for (const RenderMethod method : kBothMethods) {
    for (const double x : {0.0, 0.3, 2.0}) {
      draw.Draw(set, ShotFrom("n", {x, 0.1, 0}, {0, 0, 9}), OptionsOf(method));
    }
  }
  return draw.Finish({});
}

/// Pictures of a world that is scaled or moved against those of the world at home.
Outcome InWorlds(Drawing draw, const std::vector<std::pair<double, Eigen::Vector3d>>& worlds,
                 const char* reason) {
  Outcome outcome;
  const Surface surface = Union(Union(testing::Sphere({-1, 0.3, 6}, 1.2), Square(1, -0.4, 7, 0.8)),
                                Plane({0.2, 0, 1}, 11));
  const DtrSet set = testing::FromAround(surface, 6, 0.7, {0, 0, 9});
  const Shot novel = ShotFrom("n", {0.17, 0.11, 0.3}, {0.2, -0.1, 10});
  for (const RenderMethod method : kBothMethods) {
    const RenderResult home = draw.Draw(set, novel, OptionsOf(method));
    double worst = 0;
    for (const auto& [scale, offset] : worlds) {
      worst = std::max(
          worst, ShareApart(home, draw.Draw(Moved(set, scale, offset), Moved(novel, scale, offset),
                                            OptionsOf(method))));
    }
    outcome.Add(
        AtMost(std::string("share of pixels that change by more than a level") + NameOf(method),
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
  const DepthImage truth = Photograph(floor, novel).depth;
  for (const RenderMethod method : kBothMethods) {
    const DepthScore score = ScoreOf(draw.Draw(set, novel, OptionsOf(method)), truth, 0.02);
    outcome.Add(AtLeast(std::string("share of the floor that is seen") + NameOf(method), score.seen,
                        0.9, "one row at the horizon of 36 is beyond what the views saw; rims"));
    outcome.Add(AtLeast(std::string("share of it with the depth within 2 %") + NameOf(method),
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
    for (const RenderMethod method : kBothMethods) {
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
                              where + NameOf(method),
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
  const DepthImage truth = Photograph(surface, novel).depth;
  for (const RenderMethod method : kBothMethods) {
    const DepthScore score = ScoreOf(draw.Draw(set, novel, OptionsOf(method)), truth, 1e-4);
    outcome.Add(Exactly(std::string("share of the picture that is seen") + NameOf(method),
                        score.seen, 1, "a tenth of a pixel of the views, well inside of them"));
    outcome.Add(AtLeast(std::string("share of it with the depth within 1e-4") + NameOf(method),
                        score.right, 0.99, "a plane is interpolated exactly"));
  }
  return draw.Finish(outcome);
}

Outcome FieldsOfView(Drawing draw) {
  Outcome outcome;
  const Surface surface = Plane({0.4, 0.1, 0.9}, 8);
  const DtrSet set = testing::FromAround(surface, 4, 0.8, {0, 0, 9});
  for (const double degrees : {1.0, 10.0, 60.0, 120.0, 170.0, 179.0}) {
    Shot novel = ShotFrom("n", {0.17, 0.11, 0.3}, {0.2, -0.1, 10});
    const double focal = 48 / std::tan(degrees / 360 * std::numbers::pi);
    // A pixel's centre lies on the axis: at 179 degrees it is all that sees what the views saw.
    novel.camera = PinholeCamera(96, 72, focal, focal, 48.5, 36.5);
    const DepthImage truth = Photograph(surface, novel).depth;
    const std::string at = std::to_string(static_cast<int>(degrees)) + " degrees";
    for (const RenderMethod method : kBothMethods) {
      const DepthScore score = ScoreOf(draw.Draw(set, novel, OptionsOf(method)), truth, 0.01);
      if (degrees <= 10) {
        outcome.Add(Exactly("share of the picture that is seen, " + at + NameOf(method), score.seen,
                            1, "well inside of all views"));
      }
      outcome.Add(AtLeast("pixels seen, " + at + NameOf(method), std::round(96 * 72 * score.seen),
                          1, "the axis hits what the views saw"));
      outcome.Add(AtLeast("share of what is seen with the depth within 1 %, " + at + NameOf(method),
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
  for (const RenderMethod method : kBothMethods) {
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
                      "what nobody saw is not shown"));
  ExpectRefusal(outcome, "a set without a frame", [] { MakeRenderScene(DtrSet{}); });
  return draw.Finish(outcome);
}

Outcome ManyViews(Drawing draw) {
  Outcome outcome;
  const Surface surface = Union(Square(0, 0, 5, 1), Plane({0, 0, 1}, 10));
  const DtrSet set = OnALine(surface, 256, 0.01, {0, 0, 10});
  const Shot novel = ShotFrom("n", {0.17, 0.11, 0.3}, {0, 0, 10});
  RenderScene turned = MakeRenderScene(set);
  std::rotate(turned.views.begin(), turned.views.begin() + 100, turned.views.end());
  for (const RenderMethod method : kBothMethods) {
    RenderOptions options = OptionsOf(method);
    options.views = 256;
    const RenderResult expected = draw.Draw(set, novel, options);
    outcome.Add(
        Exactly(std::string("pictures that change with the order of 256 views") + NameOf(method),
                !testing::SameBytes(expected, draw.Draw(turned, novel, options)), 0,
                "sums are taken in one order"));
  }
  return draw.Finish(outcome);
}

Outcome DuplicateCameras(Drawing draw) {
  Outcome outcome;
  const DtrSet set = testing::SquareBeforePlane();
  DtrSet twice = set;
  for (View view : set.frames[0].views) {
    view.id = view.name = "w" + view.id;
    twice.frames[0].views.push_back(std::move(view));
  }
  const Shot novel = ShotFrom("n", {0.17, 0.11, 0.3}, {0, 0, 10});
  for (const RenderMethod method : kBothMethods) {
    outcome.Add(
        Exactly(std::string("pictures that change when every view is there twice") + NameOf(method),
                !testing::SameBytes(draw.Draw(set, novel, OptionsOf(method)),
                                    draw.Draw(twice, novel, OptionsOf(method))),
                0, "equal views count once"));
  }
  return draw.Finish(outcome);
}

Outcome ExtremeWeights(Drawing draw) {
  const DtrSet set = testing::SquareBeforePlane();
  for (const RenderMethod method : kBothMethods) {
    for (const BlendWeight weight : testing::kAllWeights) {
      for (const double max_angle : {1e-3, std::numbers::pi}) {
        RenderOptions options = OptionsOf(method);
        options.blend = weight;
        options.exponent = 1000;
        options.falloff = 1e6;
        options.max_angle_rad = max_angle;
        Shot at_a_view = ShotFrom("n", {0, 0, 0}, {0, 0, 10});
        draw.Draw(set, at_a_view, options);
        draw.Draw(set, ShotFrom("n", {0.25, 0, 0}, {0, 0, 10}), options);
      }
    }
  }
  return draw.Finish({});
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
      all.push_back({"Rendering, " + renderer.name, name,
                     renderer.name == "cpu" && run != ManyViews,
                     [renderer, run = run](const Conditions& conditions) {
                       return run(Drawing(renderer, conditions));
                     }});
    }
  }
  return all;
}

}  // namespace dtr::selftest
