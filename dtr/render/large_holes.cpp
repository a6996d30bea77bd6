#include "dtr/render/large_holes.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "dtr/base/order_statistics.h"
#include "dtr/base/parallel_for.h"
#include "dtr/render/hole_cells.h"
#include "dtr/render/semi_global.h"

namespace dtr {
namespace {

// SPEC 7.3. Costs are in levels of sRGB.
constexpr float kMaxCost = HoleCells::kMaxCost;
constexpr int kMinDepths = 8, kMaxDepths = 256;
constexpr double kBeyondFarthest = 0.1, kBeforeNearest = 4;  // of the seen range of 1/z
constexpr double kStrayShare = 0.005;                        // seen depths left out at either end
constexpr float kSweepBonus = 18, kPlaneBonus = 12;          // of the guess
constexpr float kNextDepth = 4, kOtherDepth = 24, kOtherPlane = 60;
constexpr int kAnchorSteps = 4;  // a seen cell costs the most from here on

/// Inverse depths at even steps.
struct Depths {
  double farthest = 0, step = 0;
  int count = 0;
  double At(double label) const { return farthest + label * step; }
};

/// From what was seen and how far the views stand apart. No depth where there is nothing to sweep.
Depths ChooseDepths(const Grid<float>& seen, const GuessedColours& guesses, int cell_px) {
  Depths depths;
  if (guesses.views().size() < 2) return depths;
  const std::vector<float> ends =
      QuantilesOfPositive(seen.data(), std::array{kStrayShare, 1 - kStrayShare});
  if (ends.empty()) return depths;
  depths.farthest = kBeyondFarthest / static_cast<double>(ends[1]);
  const double range = kBeforeNearest / static_cast<double>(ends[0]) - depths.farthest;
  std::vector<double> baselines;
  for (const auto& view : guesses.views()) baselines.push_back(view.center_in_novel.norm());
  std::sort(baselines.begin(), baselines.end());
  const double disparity_px = guesses.novel().fx_px() * baselines[1] * range;
  const auto count =
      static_cast<int>(std::clamp<double>(disparity_px / cell_px, kMinDepths, kMaxDepths));
  depths.step = range / (count - 1);
  if (depths.step > 0 && std::isfinite(depths.step)) depths.count = count;
  return depths;
}

class LargeHoles {
 public:
  LargeHoles(const Grid<float>& seen, const Grid<float>& guessed, const GuessedColours& guesses,
             ShrunkPhotos& photos, int threads)
      : guessed_(guessed),
        threads_(threads),
        cells_(seen, guesses, photos, threads),
        depths_(ChooseDepths(seen, guesses, cells_.cell_px())) {}

  HolePlanes Run() const {
    HolePlanes found;
    if (depths_.count == 0) return found;
    found.cell_px = cells_.cell_px();
    found.planes = FindPlanes(Swept(), depths_.step);
    for (ImagePlane& plane : found.planes) plane.head<2>() /= cells_.cell_px();
    found.planes.push_back({0, 0, depths_.farthest});
    Choose(found);
    return found;
  }

 private:
  /// What stays where nothing better is found: 1/z at a cell, 0 where nothing was guessed.
  double GuessAt(int x, int y) const {
    const Eigen::Vector2d centre = cells_.Centre(x, y);
    const float z = guessed_(std::min(static_cast<int>(centre.x()), guessed_.width() - 1),
                             std::min(static_cast<int>(centre.y()), guessed_.height() - 1));
    return z > 0 ? 1 / static_cast<double>(z) : 0;
  }
  float CostOfGuess(int x, int y) const {
    const double guess = GuessAt(x, y);
    return guess > 0 ? cells_.CostAt(cells_.Centre(x, y), guess) : 2 * kMaxCost;
  }
  /// How far off what was seen of a cell an inverse depth is.
  float CostOfSeen(int x, int y, double inverse_depth) const {
    const double steps = std::abs(inverse_depth - cells_.known(x, y)) / depths_.step;
    return kMaxCost * static_cast<float>(std::min(1.0, steps / kAnchorSteps));
  }

  /// 1/z of the cells: what was seen of them, else the depth that the views agree on; 0 where the
  /// guess is as good.
  Grid<double> Swept() const {
    const auto depths = static_cast<size_t>(depths_.count);
    const size_t guess = depths;
    SemiGlobal sweep(cells_.columns(), cells_.rows(), depths + 1, {depths, kNextDepth, kOtherDepth},
                     threads_);
    std::vector<double> inverse_depths;
    for (int k = 0; k < depths_.count; ++k) inverse_depths.push_back(depths_.At(k));
    ParallelFor(0, cells_.rows(), threads_, [&](int y) {
      std::vector<float> costs(depths);
      for (int x = 0; x < cells_.columns(); ++x) {
        const bool seen = cells_.known(x, y) > 0;
        if (!seen) cells_.CostsAt(cells_.Centre(x, y), inverse_depths, costs.data());
        for (size_t k = 0; k < depths; ++k) {
          sweep.SetCost(x, y, k,
                        seen ? CostOfSeen(x, y, inverse_depths[k]) : costs[k] + kSweepBonus);
        }
        sweep.SetCost(x, y, guess, seen ? 0 : CostOfGuess(x, y));
      }
    });
    sweep.Solve();
    Grid<double> swept(cells_.columns(), cells_.rows());
    for (int y = 0; y < cells_.rows(); ++y) {
      for (int x = 0; x < cells_.columns(); ++x) {
        const double known = cells_.known(x, y);
        swept(x, y) = known > 0 ? known : BetweenSteps(sweep, x, y);
      }
    }
    return swept;
  }

  /// The cheapest inverse depth, between the steps by a parabola; 0 where the guess is.
  double BetweenSteps(const SemiGlobal& sweep, int x, int y) const {
    const size_t label = sweep.Best(x, y), guess = static_cast<size_t>(depths_.count);
    if (label == guess) return 0;
    double offset = 0;
    if (label > 0 && label + 1 < guess) {
      const float sum = sweep.SumOf(x, y, label);
      const auto before = static_cast<double>(sweep.SumOf(x, y, label - 1) - sum);
      const auto after = static_cast<double>(sweep.SumOf(x, y, label + 1) - sum);
      if (before + after > 0) offset = 0.5 * (before - after) / (before + after);
    }
    return depths_.At(static_cast<double>(label) + offset);
  }

  void Choose(HolePlanes& found) const {
    const size_t planes = found.planes.size(), guess = planes;
    SemiGlobal choice(cells_.columns(), cells_.rows(), planes + 1, {0, 0, kOtherPlane}, threads_);
    ParallelFor(0, cells_.rows(), threads_, [&](int y) {
      std::vector<double> w(planes);
      std::vector<float> costs(planes);
      for (int x = 0; x < cells_.columns(); ++x) {
        const Eigen::Vector2d centre = cells_.Centre(x, y);
        const float seen = cells_.seen_share(x, y), hole = 1 - seen;
        for (size_t k = 0; k < planes; ++k) w[k] = found.planes[k].dot(centre.homogeneous());
        if (hole > 0) cells_.CostsAt(centre, w, costs.data());
        for (size_t k = 0; k < planes; ++k) {
          float cost = 0;
          if (seen > 0) cost += seen * CostOfSeen(x, y, w[k]);
          if (hole > 0) cost += hole * (w[k] > 0 ? costs[k] + kPlaneBonus : 4 * kMaxCost);
          choice.SetCost(x, y, k, cost);
        }
        // The guess goes on from what was seen: it costs nothing there.
        choice.SetCost(x, y, guess, hole > 0 ? hole * CostOfGuess(x, y) : 0);
      }
    });
    choice.Solve();
    found.chosen = Grid<int>(cells_.columns(), cells_.rows());
    for (int y = 0; y < cells_.rows(); ++y) {
      for (int x = 0; x < cells_.columns(); ++x) {
        const size_t label = choice.Best(x, y);
        const bool whole = cells_.seen_share(x, y) == 1;
        found.chosen(x, y) = whole || label == guess ? HolePlanes::kGuess : static_cast<int>(label);
      }
    }
  }

  const Grid<float>& guessed_;
  const int threads_;
  const HoleCells cells_;
  const Depths depths_;
};

}  // namespace

HolePlanes::Mix HolePlanes::At(int x, int y) const {
  Mix mix;
  if (chosen.empty()) return mix;
  const double u = std::clamp((x + 0.5) / cell_px - 0.5, 0.0, chosen.width() - 1.0);
  const double v = std::clamp((y + 0.5) / cell_px - 0.5, 0.0, chosen.height() - 1.0);
  const int x0 = static_cast<int>(u), y0 = static_cast<int>(v);
  const int x1 = std::min(x0 + 1, chosen.width() - 1), y1 = std::min(y0 + 1, chosen.height() - 1);
  const double fx = u - x0, fy = v - y0;
  std::array<int, 4> plane_of{};
  const auto add = [&](int plane, double share) {
    if (plane == kGuess || !(share > 0)) return;
    const double w = planes[static_cast<size_t>(plane)].dot(ImagePlane(x + 0.5, y + 0.5, 1));
    if (!(w > 0)) return;
    const auto end = plane_of.begin() + mix.count;
    const auto k = static_cast<size_t>(std::find(plane_of.begin(), end, plane) - plane_of.begin());
    if (k == static_cast<size_t>(mix.count)) ++mix.count;
    plane_of[k] = plane;
    mix.inverse_depth[k] = w;
    mix.share[k] += share;
  };
  add(chosen(x0, y0), (1 - fx) * (1 - fy));
  add(chosen(x1, y0), fx * (1 - fy));
  add(chosen(x0, y1), (1 - fx) * fy);
  add(chosen(x1, y1), fx * fy);
  return mix;
}

HolePlanes ChooseHolePlanes(const Grid<float>& seen, const Grid<float>& guessed,
                            const GuessedColours& guesses, ShrunkPhotos& photos, int threads) {
  return LargeHoles(seen, guessed, guesses, photos, threads).Run();
}

}  // namespace dtr
