#include "dtr/render/fill_holes.h"

#include <algorithm>

#include "dtr/base/parallel_for.h"
#include "dtr/render/colour.h"
#include "dtr/render/guessed_colours.h"
#include "dtr/render/large_holes.h"
#include "dtr/render/push_pull.h"

namespace dtr {
namespace {

/// What is known of an image: plane z where its colour stands, 0 at a hole.
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

/// SPEC 7.2: inverse depths of the holes where some view answers, else 0; these become known.
/// `background` gets the farthest guess of every hole, plane z.
Grid<double> GuessDepths(const GuessedColours& guesses, const Mask& coverage, int threads,
                         KnownDepth& known, Grid<float>& background) {
  using Depths = PushPull<0>;
  const Mask holes = HolesOf(known);
  const HolePyramid pyramid(holes);
  const auto finest = [&](int x, int y) {
    return holes(x, y) != 0 ? Depths::Cell{} : Depths::Cell{InverseOf(known(x, y)), 1, {}};
  };
  const Depths far(pyramid, Favour::kFar, threads, finest);
  const Depths even(pyramid, Favour::kNone, threads, finest);
  Grid<double> guessed(known.width(), known.height());
  ParallelFor(0, known.height(), threads, [&](int y) {
    std::vector<GuessedColours::Row::Hole> asked;
    for (int x = 0; x < known.width(); ++x) {
      if (holes(x, y) == 0 || coverage(x, y) != 0) continue;
      const Depths::Cell farthest = far.At(x, y);
      if (!(farthest.weight > 0)) continue;
      background(x, y) = static_cast<float>(1 / farthest.inverse_depth);
      asked.push_back({x, farthest.inverse_depth, even.At(x, y).inverse_depth});
    }
    if (asked.empty()) return;
    GuessedColours::Row row(guesses, y);
    const std::vector<double>& found = row.DepthsOf(asked);
    for (size_t i = 0; i < asked.size(); ++i) {
      if (!(found[i] > 0)) continue;
      guessed(asked[i].x, y) = found[i];
      known(asked[i].x, y) = static_cast<float>(1 / found[i]);
    }
  });
  return guessed;
}

/// A row's holes between what was guessed and the planes of SPEC 7.3.
class HoleRow {
 public:
  HoleRow(const GuessedColours& guesses, const HolePlanes& planes, const Grid<double>& guessed,
          const Mask& coverage, int y)
      : row_(guesses, y) {
    for (int x = 0; x < guessed.width(); ++x) {
      if (coverage(x, y) != 0) continue;
      Hole hole{x, planes.At(x, y), guessed(x, y)};
      for (size_t i = 0; i < static_cast<size_t>(hole.mix.count); ++i) {
        hole.rest -= hole.mix.share[i];
      }
      if (hole.mix.count > 0 || hole.guess > 0) holes_.push_back(hole);
    }
  }

  /// What is answered becomes known; `background` gets the depth of planes that have most of a
  /// hole.
  void Colour(int y, KnownDepth& known, Grid<float>& background, ImageRgb8& image) {
    AskOnPlanes();
    AskAtGuesses();
    for (const Hole& hole : holes_) {
      if (!(hole.answered > 0)) continue;
      Write(hole.sum / hole.answered, &image(hole.x, y));
      if (!(hole.guess > 0) || hole.most > hole.rest) {
        known(hole.x, y) = background(hole.x, y) = static_cast<float>(hole.depth);
      }
    }
  }

 private:
  struct Hole {
    int x;
    HolePlanes::Mix mix;
    double guess;     ///< 1/z; 0: none
    double rest = 1;  ///< the guess's share
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double answered = 0;         ///< share of what stands in `sum`
    double most = 0, depth = 0;  ///< of the planes that answered
  };

  void AskOnPlanes() {
    points_.clear();
    for (const Hole& hole : holes_) {
      for (size_t i = 0; i < static_cast<size_t>(hole.mix.count); ++i) {
        points_.push_back({hole.x, hole.mix.inverse_depth[i]});
      }
    }
    auto colour = row_.ColoursAt(points_).begin();
    for (Hole& hole : holes_) {
      for (size_t i = 0; i < static_cast<size_t>(hole.mix.count); ++i, ++colour) {
        if (!*colour) continue;
        const double share = hole.mix.share[i];
        hole.sum += share * **colour;
        hole.answered += share;
        if (share > hole.most) hole.most = share, hole.depth = 1 / hole.mix.inverse_depth[i];
      }
    }
  }

  /// Only where something of the guess remains. As the image would show it alone, in 8 bits.
  void AskAtGuesses() {
    const auto needed = [](const Hole& hole) {
      return hole.guess > 0 && (hole.rest > 0 || !(hole.answered > 0));
    };
    points_.clear();
    for (const Hole& hole : holes_) {
      if (needed(hole)) points_.push_back({hole.x, hole.guess});
    }
    const std::array<double, 256>& linear = LinearFromSrgb8();
    auto colour = row_.ColoursAt(points_).begin();
    for (Hole& hole : holes_) {
      if (!needed(hole)) continue;
      const auto& shown = *colour++;
      if (!shown) continue;
      std::uint8_t rgb[3];
      Write(*shown, rgb);
      const Eigen::Vector3d level(linear[rgb[0]], linear[rgb[1]], linear[rgb[2]]);
      if (!(hole.answered > 0)) {
        hole.sum = level, hole.answered = 1, hole.rest = 1;
      } else {
        hole.sum += hole.rest * level;
        hole.answered += hole.rest;
      }
    }
  }

  GuessedColours::Row row_;
  std::vector<Hole> holes_;
  std::vector<GuessedColours::Row::Point> points_;
};

bool HasHoles(const RenderResult& result) {
  const auto& covered = result.coverage.data();
  return std::find(covered.begin(), covered.end(), 0) != covered.end();
}

}  // namespace

void FillHoles(RenderResult& result) {
  if (!HasHoles(result)) return;
  FillFromSurroundings(DepthOf(result), 1, result);
}

Grid<float> HoleFiller::Fill(const RenderScene& scene, const PinholeCamera& novel,
                             const Pose& novel_from_world, const RenderOptions& options,
                             RenderResult& result) {
  KnownDepth known = DepthOf(result);
  if (!HasHoles(result)) return known;
  const int threads = options.threads;
  GuessedColours guesses(scene, result.views_used, novel, novel_from_world, options);
  guesses.MatchExposures(known, result.image, threads);
  const KnownDepth seen = known;
  Grid<float> background = known;
  const Grid<double> guessed = GuessDepths(guesses, result.coverage, threads, known, background);
  const HolePlanes planes = ChooseHolePlanes(seen, known, guesses, photos_, threads);
  ParallelFor(0, known.height(), threads, [&](int y) {
    HoleRow(guesses, planes, guessed, result.coverage, y)
        .Colour(y, known, background, result.image);
  });
  FillFromSurroundings(known, threads, result);
  return background;
}

void FillHolesFromViews(const RenderScene& scene, const PinholeCamera& novel,
                        const Pose& novel_from_world, const RenderOptions& options,
                        RenderResult& result) {
  HoleFiller().Fill(scene, novel, novel_from_world, options, result);
}

}  // namespace dtr
