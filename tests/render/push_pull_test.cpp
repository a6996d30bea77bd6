#include "dtr/render/push_pull.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "dtr/base/random.h"
#include "tests/support/on_threads.h"

namespace dtr {
namespace {

constexpr double kRounding = 1e-12;  // the same sums in the same order; values are below 100
constexpr std::uint8_t kHole = 255;

struct Known {
  Grid<double> value;
  Mask hole;
};

Known RandomImage(int width, int height, double hole_share, Random& random) {
  Known known{Grid<double>(width, height), Mask(width, height)};
  for (size_t p = 0; p < known.hole.data().size(); ++p) {
    known.value.data()[p] = random.Uniform(0, 1);
    known.hole.data()[p] = random.Uniform(0, 1) < hole_share ? kHole : 0;
  }
  return known;
}

PushPull Filled(const Known& known, int threads = 1) {
  return OnThreads(threads, [&] {
    return PushPull(HolePyramid(known.hole), [&](int x, int y) {
      if (known.hole(x, y) != 0) return PushPull::Cell{};
      const double value = known.value(x, y);
      return PushPull::Cell{1, {value, 1 - value, 0.5, 2 * value}};
    });
  });
}

/// SPEC 7.1 word by word, one cell after the other and nothing left out.
struct Plain {
  struct Cell {
    double weight = 0, value = 0;
  };
  static Cell Mean(const std::vector<std::pair<Cell, double>>& cells) {
    Cell mean;
    for (const auto& [cell, tap] : cells) {
      mean.value += cell.weight * tap * cell.value, mean.weight += cell.weight * tap;
    }
    if (mean.weight > 0) mean.value /= mean.weight;
    return mean;
  }
  static Grid<Cell> Fill(Grid<Cell> fine) {
    if (fine.width() == 1 && fine.height() == 1) return fine;
    Grid<Cell> coarse((fine.width() + 1) / 2, (fine.height() + 1) / 2);
    for (int y = 0; y < coarse.height(); ++y) {
      for (int x = 0; x < coarse.width(); ++x) {
        std::vector<std::pair<Cell, double>> children;
        for (int c = 0; c < 4; ++c) {
          const int cx = 2 * x + c % 2, cy = 2 * y + c / 2;
          if (fine.Contains(cx, cy)) children.emplace_back(fine(cx, cy), 1.0);
        }
        coarse(x, y) = Mean(children);
        coarse(x, y).weight = std::min(coarse(x, y).weight, 1.0);
      }
    }
    coarse = Fill(std::move(coarse));
    for (int y = 0; y < fine.height(); ++y) {
      for (int x = 0; x < fine.width(); ++x) {
        if (fine(x, y).weight > 0) continue;
        const double cx = (x + 0.5) / 2 - 0.5, cy = (y + 0.5) / 2 - 0.5;
        const int x0 = static_cast<int>(std::floor(cx)), y0 = static_cast<int>(std::floor(cy));
        std::vector<std::pair<Cell, double>> around;
        for (int j = 0; j < 2; ++j) {
          for (int i = 0; i < 2; ++i) {
            if (!coarse.Contains(x0 + i, y0 + j)) continue;
            around.emplace_back(coarse(x0 + i, y0 + j),
                                (1 - std::abs(x0 + i - cx)) * (1 - std::abs(y0 + j - cy)));
          }
        }
        fine(x, y) = Mean(around);
        if (fine(x, y).weight > 0) fine(x, y).weight = 1;
      }
    }
    return fine;
  }
};

TEST(PushPull, AHoleTakesItsNeighboursWithEqualWeights) {
  // A single coarse cell, the mean of the three seen pixels, one of them ten times as near.
  Mask hole(2, 2);
  hole(1, 1) = kHole;
  const PushPull filled(HolePyramid(hole), [&](int x, int y) {
    if (hole(x, y) != 0) return PushPull::Cell{};
    const bool near = x == 0 && y == 0;
    return PushPull::Cell{1, {near ? 0.9 : 0, near ? 0 : 0.6, 0.3, near ? 1 : 0.1}};
  });
  const PushPull::Cell cell = filled.At(1, 1);
  EXPECT_EQ(cell.weight, 1);
  EXPECT_NEAR(cell.values[0], 0.3, kRounding);
  EXPECT_NEAR(cell.values[1], 0.4, kRounding);
  EXPECT_NEAR(cell.values[2], 0.3, kRounding);
  EXPECT_NEAR(cell.values[3], 0.4, kRounding);
}

TEST(PushPull, WithoutAKnownPixelNothingIsKnown) {
  for (const auto& [width, height] : {std::pair{1, 1}, {5, 4}, {64, 64}}) {
    const Known nothing{Grid<double>(width, height), Mask(width, height, 1, kHole)};
    EXPECT_EQ(Filled(nothing).At(width / 2, height / 2).weight, 0);
  }
}

TEST(PushPull, MakesOnlyWhatHolesDrawOnAndStillGivesWhatTheWholePyramidGives) {
  Random random(11);
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 7}, {9, 1}, {33, 20}, {64, 65}}) {
    for (const double share : {0.01, 0.3, 0.95, 1.0}) {
      Known known = RandomImage(width, height, share, random);
      for (int x = 0; x < width / 2; ++x) known.hole(x, height / 2) = kHole;
      Grid<Plain::Cell> plain(width, height);
      for (size_t p = 0; p < plain.data().size(); ++p) {
        if (known.hole.data()[p] == 0) plain.data()[p] = {1, known.value.data()[p]};
      }
      plain = Plain::Fill(std::move(plain));
      const PushPull filled = Filled(known);
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          if (known.hole(x, y) == 0) continue;
          const PushPull::Cell cell = filled.At(x, y);
          EXPECT_EQ(cell.weight, plain(x, y).weight);
          EXPECT_NEAR(cell.values[0], plain(x, y).value, kRounding);
          EXPECT_NEAR(cell.values[3], 2 * plain(x, y).value, kRounding);
        }
      }
    }
  }
}

TEST(PushPull, DoesNotDependOnTheNumberOfThreads) {
  Random random(5);
  const Known known = RandomImage(200, 300, 0.8, random);
  const PushPull one = Filled(known, 1), three = Filled(known, 3);
  for (int y = 0; y < 300; ++y) {
    for (int x = 0; x < 200; ++x) {
      if (known.hole(x, y) == 0) continue;
      EXPECT_EQ(one.At(x, y).values, three.At(x, y).values);
    }
  }
}

TEST(HolePyramid, APictureWithoutHolesNeedsNoLevelAndASmallHoleFewCells) {
  Mask hole(256, 256);
  EXPECT_TRUE(HolePyramid(hole).needed().empty());
  hole(100, 100) = kHole;
  const HolePyramid one(hole);
  ASSERT_EQ(one.needed().size(), 1u);
  const auto& needed = one.needed()[0].data();
  EXPECT_EQ(std::count(needed.begin(), needed.end(), kHole), 9);
}

}  // namespace
}  // namespace dtr
