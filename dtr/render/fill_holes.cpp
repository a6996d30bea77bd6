#include "dtr/render/fill_holes.h"

#include <algorithm>

#include "dtr/base/parallel_for.h"
#include "dtr/render/colour.h"
#include "dtr/render/guessed_colours.h"
#include "dtr/render/large_holes.h"
#include "dtr/render/push_pull.h"

namespace dtr {
namespace {

/// What is known of a picture: plane z where its colour stands, 0 at a hole.
using KnownDepth = Grid<float>;

constexpr std::uint8_t kHole = 255;

Mask HolesOf(const KnownDepth& known) {
  Mask holes(known.width(), known.height());
  for (size_t p = 0; p < holes.data().size(); ++p) {
    holes.data()[p] = known.data()[p] > 0 ? 0 : kHole;
  }
  return holes;
}

KnownDepth DepthOf(const RenderResult& result) {
  KnownDepth known = result.depth.grid();
  for (size_t p = 0; p < known.data().size(); ++p) {
    if (result.coverage.data()[p] == 0) known.data()[p] = 0;
  }
  return known;
}

double InverseOf(float depth) { return 1.0 / static_cast<double>(depth); }

void Write(const Eigen::Vector3d& linear_rgb, std::uint8_t* rgb) {
  for (int channel = 0; channel < 3; ++channel) {
    rgb[channel] = Srgb8FromLinear(linear_rgb[channel]);
  }
}

/// SPEC 7.1: colours of the pixels that are not known, from those that are.
void FillFromSurroundings(const KnownDepth& known, int threads, RenderResult& result) {
  using Colours = PushPull<3>;
  const Mask holes = HolesOf(known);
  const std::array<double, 256>& linear = LinearFromSrgb8();
  const Colours colours(HolePyramid(holes), Favour::kFar, threads, [&](int x, int y) {
    if (holes(x, y) != 0) return Colours::Cell{};
    const std::uint8_t* rgb = &result.image(x, y);
    return Colours::Cell{
        InverseOf(known(x, y)), 1, {linear[rgb[0]], linear[rgb[1]], linear[rgb[2]]}};
  });
  ParallelFor(0, known.height(), threads, [&](int y) {
    for (int x = 0; x < known.width(); ++x) {
      if (holes(x, y) == 0 || result.coverage(x, y) != 0) continue;
      const Colours::Cell cell = colours.At(x, y);
      Write({cell.values[0], cell.values[1], cell.values[2]}, &result.image(x, y));
    }
  });
}

/// SPEC 7.2: asks the views for every hole; what they answer becomes known.
void FillFromViews(const GuessedColours& guesses, int threads, KnownDepth& known,
                   RenderResult& result) {
  using Depths = PushPull<0>;
  const Mask holes = HolesOf(known);
  const HolePyramid pyramid(holes);
  const auto finest = [&](int x, int y) {
    return holes(x, y) != 0 ? Depths::Cell{} : Depths::Cell{InverseOf(known(x, y)), 1, {}};
  };
  const Depths far(pyramid, Favour::kFar, threads, finest);
  const Depths even(pyramid, Favour::kNone, threads, finest);
  ParallelFor(0, known.height(), threads, [&](int y) {
    GuessedColours::Row row(guesses, y);
    for (int x = 0; x < known.width(); ++x) {
      if (holes(x, y) == 0 || result.coverage(x, y) != 0) continue;
      const Depths::Cell farthest = far.At(x, y);
      if (!(farthest.weight > 0)) continue;
      const auto guess = row.At(x, farthest.inverse_depth, even.At(x, y).inverse_depth);
      if (!guess) continue;
      Write(guess->linear_rgb, &result.image(x, y));
      known(x, y) = static_cast<float>(1 / guess->inverse_depth);
    }
  });
}

/// SPEC 7.3: asks again where the views agree better on a plane than on the guess.
void FillLargeHoles(const KnownDepth& seen, const GuessedColours& guesses, int threads,
                    KnownDepth& known, RenderResult& result) {
  const HolePlanes planes = ChooseHolePlanes(seen, known, guesses, threads);
  const std::array<double, 256>& linear = LinearFromSrgb8();
  ParallelFor(0, known.height(), threads, [&](int y) {
    GuessedColours::Row row(guesses, y);
    for (int x = 0; x < known.width(); ++x) {
      if (result.coverage(x, y) != 0) continue;
      const HolePlanes::Mix mix = planes.At(x, y);
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      double answered = 0, guessed = 1, most = 0, depth = 0;
      for (size_t i = 0; i < static_cast<size_t>(mix.count); ++i) {
        guessed -= mix.share[i];
        const auto colour = row.At(x, mix.inverse_depth[i], mix.inverse_depth[i]);
        if (!colour) continue;
        sum += mix.share[i] * colour->linear_rgb;
        answered += mix.share[i];
        if (mix.share[i] > most) most = mix.share[i], depth = 1 / mix.inverse_depth[i];
      }
      if (!(answered > 0)) continue;
      if (known(x, y) > 0 && guessed > 0) {
        const std::uint8_t* rgb = &result.image(x, y);
        sum += guessed * Eigen::Vector3d(linear[rgb[0]], linear[rgb[1]], linear[rgb[2]]);
        answered += guessed;
      }
      Write(sum / answered, &result.image(x, y));
      if (!(known(x, y) > 0) || most > guessed) known(x, y) = static_cast<float>(depth);
    }
  });
}

bool HasHoles(const RenderResult& result) {
  const auto& covered = result.coverage.data();
  return std::find(covered.begin(), covered.end(), 0) != covered.end();
}

}  // namespace

void FillHoles(RenderResult& result) {
  if (!HasHoles(result)) return;
  FillFromSurroundings(DepthOf(result), 1, result);
}

void FillHolesFromViews(const RenderScene& scene, const PinholeCamera& novel,
                        const Pose& novel_from_world, const RenderOptions& options,
                        RenderResult& result) {
  if (!HasHoles(result)) return;
  KnownDepth known = DepthOf(result);
  GuessedColours guesses(scene, result.views_used, novel, novel_from_world, options);
  guesses.MatchExposures(known, result.image);
  const KnownDepth seen = known;
  FillFromViews(guesses, options.threads, known, result);
  FillLargeHoles(seen, guesses, options.threads, known, result);
  FillFromSurroundings(known, options.threads, result);
}

}  // namespace dtr
