// The vectorised parts against the formulas, in double and one value at a time.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "calib/sfm/features/blur_kernel.h"
#include "calib/sfm/features/descriptor.h"
#include "calib/sfm/features/patch_kernel.h"
#include "calib/sfm/features/row_store.h"
#include "dtr/base/random.h"
#include "tests/support/instruction_sets.h"

namespace dtr::sfm::testing {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

RowStore Noise(int width, int height, std::uint64_t seed) {
  Random random(seed);
  RowStore image(width, height, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.row(y)[x] = static_cast<float>(random.Uniform());
  }
  return image;
}

double WeightAt(const Taps& taps, int i) {
  return std::abs(i) > taps.radius ? 0 : taps.weight[static_cast<size_t>(std::abs(i))];
}

TEST(BlurKernel, RowsAreTheSumOfTheFormula) {
  const Taps taps = GaussianTaps(1.7);
  const int width = 150, radius = taps.radius;
  const RowStore image = Noise(width, kBlurRows + 2 * radius, 2);
  std::vector<const float*> rows;
  for (int y = 0; y < kBlurRows + 2 * radius; ++y) rows.push_back(image.row(y));
  RowStore out(width, kBlurRows, kBlurRows);
  std::array<float*, kBlurRows> to;
  for (int y = 0; y < kBlurRows; ++y) to[static_cast<size_t>(y)] = out.row(y);
  dtr::testing::WithEachInstructionSet([&](std::int64_t) {
    BlurScratch scratch(width);
    BlurRows(rows.data(), kBlurRows, width, taps, &scratch, to.data());
    for (int y = 0; y < kBlurRows; y += 5) {
      for (int x = 0; x < width; ++x) {
        double sum = 0;
        for (int j = -radius; j <= radius; ++j) {
          for (int i = -radius; i <= radius; ++i) {
            sum += WeightAt(taps, i) * WeightAt(taps, j) *
                   image.row(y + radius + j)[std::clamp(x + i, 0, width - 1)];
          }
        }
        ASSERT_NEAR(out.row(y)[x], sum, 2e-6) << x << ", " << y;
      }
    }
  });
}

TEST(BlurKernel, WeightsAddUpToOne) {
  for (const double sigma : {0.6, 1.2, 1.9, 3.1}) {
    const Taps taps = GaussianTaps(sigma);
    const DoublingTaps doubling = LinearDoublingTaps(sigma);
    double sum = 0, even = 0, odd = 0;
    for (int i = -taps.radius; i <= taps.radius; ++i) sum += WeightAt(taps, i);
    for (int i = -doubling.even.radius; i <= doubling.even.radius; ++i) {
      even += WeightAt(doubling.even, i);
    }
    for (int i = 0; i < doubling.odd.radius; ++i) odd += 2 * WeightAt(doubling.odd, i);
    EXPECT_NEAR(sum, 1, 1e-6);
    EXPECT_NEAR(even, 1, 1e-6);
    EXPECT_NEAR(odd, 1, 1e-6);
  }
}

// Linear values stay what they are, at positions half a pixel apart.
TEST(BlurKernel, ADoubledRampHasHalfTheSlopeAndThePixelsInTheirPlaces) {
  const DoublingTaps taps = LinearDoublingTaps(1.25);
  const int width = 70, radius = taps.even.radius, height = 2 * radius + 2;
  RowStore image(width, height, height), out(2 * width, 2, 2);
  std::vector<const float*> rows;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.row(y)[x] = static_cast<float>(0.01 * x + 0.02 * y);
    rows.push_back(image.row(y));
  }
  dtr::testing::WithEachInstructionSet([&](std::int64_t) {
    BlurScratch scratch(width);
    for (int phase = 0; phase < 2; ++phase) {
      DoubleRow(rows.data(), phase, width, taps, &scratch, out.row(phase));
      for (int x = 2 * radius; x < 2 * (width - radius); ++x) {
        ASSERT_NEAR(out.row(phase)[x], 0.005 * x + 0.02 * (radius + 0.5 * phase), 1e-5) << x;
      }
    }
  });
}

/// One gradient of an image.
struct Gradient {
  double dx, dy, magnitude, angle;
};

/// Of the rows at a multiple of `row_step` from the feature's.
std::vector<Gradient> GradientsOf(const RowStore& image, int height, const PatchPosition& at,
                                  int row_step) {
  std::vector<Gradient> all;
  for (int y = 1; y < height - 1; ++y) {
    if ((y - static_cast<int>(std::lround(at.y))) % row_step != 0) continue;
    for (int x = 1; x < image.width() - 1; ++x) {
      const double gx = image.row(y)[x + 1] - image.row(y)[x - 1];
      const double gy = image.row(y + 1)[x] - image.row(y - 1)[x];
      all.push_back({x - at.x, y - at.y, std::hypot(gx, gy), std::atan2(gy, gx)});
    }
  }
  return all;
}

double Share(double position, int bin) { return std::max(0.0, 1 - std::abs(position - bin)); }

std::vector<double> CellsByFormula(const std::vector<Gradient>& gradients, double sigma,
                                   double orientation) {
  std::vector<double> cells(kCells * kCells * kCellDirections);
  const double cell = 3 * sigma, c = std::cos(orientation), s = std::sin(orientation);
  for (const Gradient& g : gradients) {
    const double x = (c * g.dx + s * g.dy) / cell, y = (c * g.dy - s * g.dx) / cell;
    if (std::abs(x) > 2.5 || std::abs(y) > 2.5) continue;
    const double weight = g.magnitude * std::exp(-(x * x + y * y) / 8);
    double turns = (g.angle - orientation) / kTurn;
    turns = kCellDirections * (turns - std::floor(turns));
    for (int o = 0; o <= kCellDirections; ++o) {
      for (int i = 0; i < kCells * kCells; ++i) {
        cells[static_cast<size_t>(i * kCellDirections + o % kCellDirections)] +=
            weight * Share(x + 1.5, i % kCells) * Share(y + 1.5, i / kCells) * Share(turns, o);
      }
    }
  }
  return cells;
}

TEST(PatchKernel, CellsAreTheSumsOfTheFormula) {
  const RowStore image = Noise(120, 110, 5);
  const PatchPosition middle{image.row(0), image.stride(), 120, 110, 60.3f, 52.8f, 2.9f};
  PatchPosition corner = middle;
  corner.x = 4.2f;
  corner.y = 107.1f;
  PatchPosition border = middle;  // its own row has no gradients
  border.y = 0.1f;
  dtr::testing::WithEachInstructionSet([&](std::int64_t) {
    for (const PatchPosition& at : {middle, corner, border}) {
      const auto gradients = GradientsOf(image, 110, at, kDescriptorRowStep);
      for (const double orientation : {0.0, 0.7, 2.9, 4.0, 6.2}) {
        const auto cells = GradientCells(at, static_cast<float>(orientation));
        const auto expected = CellsByFormula(gradients, at.sigma, orientation);
        const double largest = *std::max_element(expected.begin(), expected.end());
        for (size_t i = 0; i < cells.size(); ++i) {
          ASSERT_NEAR(cells[i], expected[i], 1e-3 * largest) << i << " at " << orientation;
        }
      }
    }
  });
}

TEST(PatchKernel, DirectionsAreTheSumsOfTheFormula) {
  const RowStore image = Noise(60, 60, 6);
  const PatchPosition at{image.row(0), image.stride(), 60, 60, 28.4f, 31.7f, 3.1f};
  std::vector<double> expected(kDirections);
  double largest = 0;
  const double sigma = 1.5 * at.sigma;
  for (const Gradient& g : GradientsOf(image, 60, at, 1)) {
    const double r2 = g.dx * g.dx + g.dy * g.dy;
    if (r2 > 9 * sigma * sigma) continue;
    const double turns = g.angle / kTurn;
    const double position = kDirections * (turns - std::floor(turns)) - 0.5;
    for (int i = -1; i <= kDirections; ++i) {
      const double share = Share(position, i) * g.magnitude * std::exp(-0.5 * r2 / (sigma * sigma));
      largest = std::max(largest,
                         expected[static_cast<size_t>((i + kDirections) % kDirections)] += share);
    }
  }
  dtr::testing::WithEachInstructionSet([&](std::int64_t) {
    const auto histogram = DirectionHistogram(at);
    for (size_t i = 0; i < histogram.size(); ++i) {
      EXPECT_NEAR(histogram[i], expected[i], 1e-3 * largest) << i;
    }
  });
}

TEST(PatchKernel, TheOrientationOfARampIsItsDirection) {
  RowStore image(60, 60, 60);
  for (double angle = 0.05; angle < kTurn; angle += 0.4) {
    for (int y = 0; y < 60; ++y) {
      for (int x = 0; x < 60; ++x) {
        image.row(y)[x] = static_cast<float>(0.01 * (x * std::cos(angle) + y * std::sin(angle)));
      }
    }
    const PatchPosition at{image.row(0), image.stride(), 60, 60, 30.2f, 29.5f, 2.5f};
    const auto found = Orientations(DirectionHistogram(at), 4);
    ASSERT_EQ(found.size(), 1u) << angle;
    EXPECT_NEAR(std::remainder(found[0] - angle, kTurn), 0, 0.01) << angle;
  }
}

TEST(Orientations, AreTheStrongestPeaksFirst) {
  std::array<float, kDirections> histogram{};
  histogram[4] = 0.9f;
  histogram[20] = 1.0f;
  histogram[30] = 0.5f;
  const float bin = static_cast<float>(kTurn / kDirections);
  const auto found = Orientations(histogram, 2);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_NEAR(found[0], 20.5f * bin, 1e-4f);
  EXPECT_NEAR(found[1], 4.5f * bin, 1e-4f);
  EXPECT_EQ(Orientations(histogram, 1).size(), 1u);
  EXPECT_TRUE(Orientations({}, 2).empty());
}

TEST(StoredDescriptor, IsTheRootOfTheClampedSharesInColmapsOrder) {
  std::array<float, kCells * kCells * kCellDirections> cells{};
  EXPECT_EQ(StoredDescriptor(cells), Descriptor{});
  cells[8] = 10;  // alone far above 0.2 of the length
  for (size_t i = 16; i < 32; ++i) cells[i] = 1;
  cells[11] = 1;
  const double limit = 0.2 * std::sqrt(100 + 17), sum = 17 + limit;
  const Descriptor stored = StoredDescriptor(cells);
  const auto of = [&](double value) {
    return std::min(255.0, std::floor(512 * std::sqrt(value / sum) + 0.5));
  };
  EXPECT_EQ(stored[8], of(limit));
  EXPECT_EQ(stored[13], of(1));  // direction 3 is the fifth when counted the other way round
  EXPECT_EQ(stored[11], 0);
  EXPECT_EQ(stored[16], of(1));
}

}  // namespace
}  // namespace dtr::sfm::testing
