// Rendering from many views, from copies of views, and with weights at their limits.
#include <algorithm>
#include <numbers>

#include "cli/selftest/drawing.h"
#include "dtr/base/random.h"
#include "dtr/render/scene.h"

namespace dtr::selftest {
namespace {

using testing::OptionsOf;
using testing::Photograph;
using testing::Shot;
using testing::ShotFrom;

/// That an image is there at all and is the right one, where a case is about something else.
void AddImage(const RenderResult& result, const View& truth, RenderMethod method,
              Outcome& outcome) {
  const Score score = ScoreOf(result, truth, 0.01);
  outcome.Add(AtLeast(std::string("share of the image that is seen") + InWords(method), score.seen,
                      0.95, "the views see all but what the square hides and a rim"));
  outcome.Add(AtLeast(std::string("share of it with the depth within 1 %") + InWords(method),
                      score.right, 0.95, "the square's outline of 160 px may lie a pixel off"));
  outcome.Add(AtLeast(std::string("share of it with the true colour") + InWords(method),
                      score.colour, 0.95, "4 levels; the outline again"));
}

int MostBlended(const RenderResult& result) {
  return *std::ranges::max_element(result.view_count.data());
}

/// The views of a scene in other orders: from another one on, backwards, and at random.
std::vector<RenderScene> Reordered(const RenderScene& scene) {
  std::vector<RenderScene> orders(3, scene);
  std::vector<const View*>& views = orders[0].views;
  std::rotate(views.begin(), views.begin() + std::ssize(views) / 3, views.end());
  std::ranges::reverse(orders[1].views);
  Random random(6);
  for (size_t i = scene.views.size(); i > 1; --i) {
    std::swap(orders[2].views[i - 1],
              orders[2].views[static_cast<size_t>(random.Index(static_cast<int>(i)))]);
  }
  return orders;
}

/// 16 x 16 views, 0.25 apart: 2.5 px of disparity between the square and the plane.
DtrSet Grid256() {
  std::vector<View> views;
  for (int i = 0; i < 256; ++i) {
    views.push_back(
        Photograph(testing::SquareAndPlane(),
                   ShotFrom("v" + std::to_string(1000 + i),
                            {0.25 * (i % 16 - 7.5), 0.25 * (i / 16 - 7.5), 0}, {0, 0, 10})));
  }
  return testing::SetOf(std::move(views));
}

RenderOptions ExtremeOptions(RenderMethod method, BlendWeight weight, double max_angle_rad) {
  RenderOptions options = OptionsOf(method);
  options.blend = weight;
  options.exponent = 1000;
  options.falloff = 1e6;
  options.max_angle_rad = max_angle_rad;
  return options;
}

/// The worst of all weights, in each respect.
void KeepWorst(const Score& score, Score& worst) {
  worst = {std::min(worst.seen, score.seen), std::min(worst.right, score.right),
           std::min(worst.colour, score.colour)};
}

constexpr double kNarrowRad = 1e-3, kAllRad = std::numbers::pi;

/// Images from the middle view's place and from half-way to the next, of views that agree.
void AddExtremeImages(Drawing& draw, RenderMethod method, Outcome& outcome) {
  const DtrSet& set = draw.Keep(testing::SquareBeforePlane());
  const Shot own = ShotFrom("n", {0, 0, 0}, {0, 0, 10}),
             between = ShotFrom("n", {0.25, 0, 0}, {0, 0, 10});
  const View true_own = Photograph(testing::SquareAndPlane(), own),
             true_between = Photograph(testing::SquareAndPlane(), between);
  Score worst_own{1, 1, 1}, worst_between{1, 1, 1};
  double seen_by_nobody = 0;
  for (const BlendWeight weight : testing::kAllWeights) {
    const auto drawn = [&](const Shot& novel, double max_angle_rad) {
      return draw.Draw(set, novel, ExtremeOptions(method, weight, max_angle_rad));
    };
    for (const double max_angle_rad : {kNarrowRad, kAllRad}) {
      KeepWorst(ScoreOf(drawn(own, max_angle_rad), true_own, 0.01), worst_own);
    }
    KeepWorst(ScoreOf(drawn(between, kAllRad), true_between, 0.01), worst_between);
    seen_by_nobody += drawn(between, kNarrowRad).coverage_share;
  }
  const std::string name = InWords(method);
  constexpr const char* kOutline = "the square's outline of 160 px may lie a pixel off";
  outcome.Add(Exactly("smallest share seen from a view's own position" + name, worst_own.seen, 1,
                      "the view shows all of it, whatever the others weigh"));
  outcome.Add(AtLeast("smallest share of it with the depth within 1 %" + name, worst_own.right,
                      0.95, kOutline));
  outcome.Add(AtLeast("smallest share of it with the true colour" + name, worst_own.colour, 0.95,
                      "4 levels; the outline again"));
  outcome.Add(AtLeast("smallest share seen between two views" + name, worst_between.seen, 0.95,
                      "the views see all but what the square hides and a rim"));
  outcome.Add(AtLeast("smallest share of that with the depth within 1 %" + name,
                      worst_between.right, 0.95, kOutline));
  outcome.Add(AtLeast("smallest share of that with the true colour" + name, worst_between.colour,
                      0.95, "4 levels; the outline again"));
  outcome.Add(Exactly("share seen between views within 0.001 rad" + name, seen_by_nobody, 0,
                      "the nearest is 0.025 rad away: not valid"));
}

/// Where a view is alone, by its place or by its weight, its photo comes back; gains, as every
/// other view has one, tell which photos an image is mixed of.
void AddAloneAmongOthers(Drawing& draw, RenderMethod method, Outcome& outcome) {
  DtrSet gained = testing::SquareBeforePlane();
  for (View& view : gained.frames[0].views) view.gain = {0.5, 0.6, 0.7};
  gained.frames[0].views[2].gain = {1, 1, 1};
  const DtrSet& set = draw.Keep(std::move(gained));
  const View& middle = set.frames[0].views[2];
  Shot own;
  own.cam_from_world = middle.cam_from_world;
  const auto share_of_photo = [&](BlendWeight weight, double max_angle_rad) {
    const RenderResult result = draw.Draw(set, own, ExtremeOptions(method, weight, max_angle_rad));
    double same = 0;
    for (int y = 0; y < middle.image.height(); ++y) {
      for (int x = 0; x < middle.image.width(); ++x) {
        same += testing::PixelDifference(result.image, middle.image, x, y) <= kSameColour;
      }
    }
    return same / static_cast<double>(result.coverage.data().size());
  };
  double least = 1;
  for (const BlendWeight weight : testing::kAllWeights) {
    least = std::min(least, share_of_photo(weight, kNarrowRad));
  }
  outcome.Add(
      Exactly(std::string("smallest share of a photo that comes back, others beyond the limit") +
                  InWords(method),
              least, 1, "the only valid view, drawn from its own position"));
  outcome.Add(AtLeast(std::string("share of it beside others at e^(-1e6 t)") + InWords(method),
                      share_of_photo(BlendWeight::kExponential, kAllRad), 0.95,
                      "the others are 0.05 rad away: e^-50 000; the square's outline"));
}

}  // namespace

Outcome ManyViews(Drawing draw) {
  Outcome outcome;
  const DtrSet set = Grid256();
  const Shot novel = ShotFrom("n", {0.17, 0.11, 0.3}, {0, 0, 10});
  const View truth = Photograph(testing::SquareAndPlane(), novel);
  const RenderScene scene = MakeRenderScene(set);
  for (const RenderMethod method : draw.methods()) {
    RenderOptions options = OptionsOf(method);
    options.views = 256;
    const RenderResult expected = draw.Draw(scene, novel, options);
    AddImage(expected, truth, method, outcome);
    outcome.Add(Exactly(std::string("views used") + InWords(method),
                        static_cast<double>(expected.views_used.size()), 256,
                        "all are valid, and asked for"));
    outcome.Add(Exactly(std::string("views blended at a pixel, at most") + InWords(method),
                        MostBlended(expected), 255, "all see the middle; counted to 255"));
    double changed = 0;
    for (const RenderScene& order : Reordered(scene)) {
      changed += !testing::SameBytes(expected, draw.Draw(order, novel, options));
    }
    outcome.Add(
        Exactly(std::string("images that change with the order of 256 views") + InWords(method),
                changed, 0, "sums are taken in one order"));
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
  const View truth = Photograph(testing::SquareAndPlane(), novel);
  for (const RenderMethod method : draw.methods()) {
    const RenderResult expected = draw.Draw(set, novel, OptionsOf(method));
    AddImage(expected, truth, method, outcome);
    outcome.Add(Exactly(std::string("views blended at a pixel, at most") + InWords(method),
                        MostBlended(expected), 5, "all five see the middle"));
    double changed = !testing::SameBytes(expected, draw.Draw(twice, novel, OptionsOf(method)));
    for (const RenderScene& order : Reordered(MakeRenderScene(twice))) {
      changed += !testing::SameBytes(expected, draw.Draw(order, novel, OptionsOf(method)));
    }
    outcome.Add(
        Exactly(std::string("images that change when every view is there twice") + InWords(method),
                changed, 0, "equal views count once"));
  }
  return draw.Finish(outcome);
}

Outcome ExtremeWeights(Drawing draw) {
  Outcome outcome;
  for (const RenderMethod method : draw.methods()) {
    AddExtremeImages(draw, method, outcome);
    AddAloneAmongOthers(draw, method, outcome);
  }
  return draw.Finish(outcome);
}

}  // namespace dtr::selftest
