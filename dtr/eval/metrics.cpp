#include "dtr/eval/metrics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "dtr/base/parallel_for.h"

namespace dtr::eval {
namespace {

constexpr double kPeak = 255.0;
constexpr int kWindow = 11;  // Wang et al. 2004, sec. III-B
constexpr double kWindowSigma = 1.5;
constexpr double kC1 = (0.01 * kPeak) * (0.01 * kPeak);
constexpr double kC2 = (0.03 * kPeak) * (0.03 * kPeak);

void RequireSameSize(const ImageRgb8& image, const ImageRgb8& reference, const Mask& mask) {
  if (image.empty() || image.channels() != 3 || reference.channels() != 3 ||
      image.width() != reference.width() || image.height() != reference.height()) {
    throw std::invalid_argument("eval: the images to compare must be RGB and of one size");
  }
  if (!mask.empty() && (mask.width() != image.width() || mask.height() != image.height())) {
    throw std::invalid_argument("eval: the mask must have the size of the images");
  }
}

std::array<double, kWindow> WindowWeights() {
  std::array<double, kWindow> weights{};
  double sum = 0;
  for (int i = 0; i < kWindow; ++i) {
    const double d = i - kWindow / 2;
    weights[static_cast<size_t>(i)] = std::exp(-d * d / (2 * kWindowSigma * kWindowSigma));
    sum += weights[static_cast<size_t>(i)];
  }
  for (double& w : weights) w /= sum;
  return weights;
}

/// Windowed first and second moments of two signals.
struct Moments {
  double x = 0, y = 0, xx = 0, yy = 0, xy = 0;
  void Add(double weight, const Moments& m) {
    x += weight * m.x;
    y += weight * m.y;
    xx += weight * m.xx;
    yy += weight * m.yy;
    xy += weight * m.xy;
  }
};

double SsimIndex(const Moments& m) {
  const double var_x = m.xx - m.x * m.x, var_y = m.yy - m.y * m.y, cov = m.xy - m.x * m.y;
  return ((2 * m.x * m.y + kC1) * (2 * cov + kC2)) /
         ((m.x * m.x + m.y * m.y + kC1) * (var_x + var_y + kC2));
}

/// 1 for every window position (top-left corner) that touches no masked pixel.
Grid<std::uint8_t> CleanWindows(const Mask& mask, int columns, int rows) {
  Grid<std::uint8_t> clean(columns, rows, 1, 1);
  if (mask.empty()) return clean;
  for (int y = 0; y < mask.height(); ++y) {
    for (int x = 0; x < mask.width(); ++x) {
      if (mask(x, y) != 0) continue;
      for (int v = std::max(0, y - kWindow + 1); v <= std::min(y, rows - 1); ++v) {
        for (int u = std::max(0, x - kWindow + 1); u <= std::min(x, columns - 1); ++u) {
          clean(u, v) = 0;
        }
      }
    }
  }
  return clean;
}

}  // namespace

SquaredError CompareSquared(const ImageRgb8& image, const ImageRgb8& reference, const Mask& mask) {
  RequireSameSize(image, reference, mask);
  SquaredError error;
  for (int y = 0; y < image.height(); ++y) {
    const std::uint8_t* a = image.row(y);
    const std::uint8_t* b = reference.row(y);
    long long row_sum = 0;
    for (int x = 0; x < image.width(); ++x) {
      if (!mask.empty() && mask(x, y) == 0) continue;
      for (int c = 0; c < 3; ++c) {
        const int d = int{a[3 * x + c]} - int{b[3 * x + c]};
        row_sum += d * d;
      }
      error.samples += 3;
    }
    error.sum += static_cast<double>(row_sum);
  }
  return error;
}

std::optional<double> Psnr(const ImageRgb8& image, const ImageRgb8& reference, const Mask& mask) {
  const SquaredError error = CompareSquared(image, reference, mask);
  if (error.samples == 0) return std::nullopt;
  if (error.sum == 0) return std::numeric_limits<double>::infinity();
  return 10 * std::log10(kPeak * kPeak * static_cast<double>(error.samples) / error.sum);
}

std::optional<double> ColourCorrectedPsnr(const ImageRgb8& image, const ImageRgb8& reference,
                                          const Mask& mask) {
  RequireSameSize(image, reference, mask);
  constexpr int kChannels = 3;
  std::array<Moments, kChannels> sums{};
  long long pixels = 0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      if (!mask.empty() && mask(x, y) == 0) continue;
      ++pixels;
      for (int c = 0; c < kChannels; ++c) {
        const double a = image(x, y, c), b = reference(x, y, c);
        sums[static_cast<size_t>(c)].Add(1, {a, b, a * a, b * b, a * b});
      }
    }
  }
  if (pixels == 0) return std::nullopt;
  // Equal images have equal sums, which leave exactly nothing.
  const auto n = static_cast<double>(pixels);
  double left = 0;
  for (const Moments& m : sums) {
    const double xx = n * m.xx - m.x * m.x, yy = n * m.yy - m.y * m.y, xy = n * m.xy - m.x * m.y;
    left += std::max(0.0, xx > 0 ? yy - xy * (xy / xx) : yy) / n;
  }
  return 10 * std::log10(kPeak * kPeak * kChannels * n / left);
}

std::vector<std::string> IdenticalFigures(
    std::initializer_list<std::pair<const char*, std::optional<double>>> psnrs_db) {
  std::vector<std::string> names;
  for (const auto& [name, value] : psnrs_db) {
    if (value && std::isinf(*value)) names.emplace_back(name);
  }
  return names;
}

std::optional<double> Ssim(const ImageRgb8& image, const ImageRgb8& reference, const Mask& mask) {
  RequireSameSize(image, reference, mask);
  const int columns = image.width() - kWindow + 1, rows = image.height() - kWindow + 1;
  if (columns < 1 || rows < 1) return std::nullopt;
  const std::array<double, kWindow> weights = WindowWeights();
  const Grid<std::uint8_t> clean = CleanWindows(mask, columns, rows);

  // One slot per row, summed in order below: the same bits for any number of threads.
  std::vector<double> row_sum(static_cast<size_t>(rows), 0.0);
  std::vector<long long> row_count(static_cast<size_t>(rows), 0);
  ParallelFor(0, rows, [&](int y) {
    std::vector<Moments> column(static_cast<size_t>(image.width()));
    for (int c = 0; c < 3; ++c) {
      for (int x = 0; x < image.width(); ++x) {
        Moments m;
        for (int i = 0; i < kWindow; ++i) {
          const double a = image(x, y + i, c), b = reference(x, y + i, c);
          m.Add(weights[static_cast<size_t>(i)], {a, b, a * a, b * b, a * b});
        }
        column[static_cast<size_t>(x)] = m;
      }
      for (int x = 0; x < columns; ++x) {
        if (clean(x, y) == 0) continue;
        Moments m;
        for (int i = 0; i < kWindow; ++i) {
          m.Add(weights[static_cast<size_t>(i)], column[static_cast<size_t>(x + i)]);
        }
        row_sum[static_cast<size_t>(y)] += SsimIndex(m);
        ++row_count[static_cast<size_t>(y)];
      }
    }
  });
  double sum = 0;
  long long count = 0;
  for (size_t y = 0; y < row_sum.size(); ++y) {
    sum += row_sum[y];
    count += row_count[y];
  }
  if (count == 0) return std::nullopt;
  return sum / static_cast<double>(count);
}

Mask Intersect(const Mask& a, const Mask& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  if (a.width() != b.width() || a.height() != b.height()) {
    throw std::invalid_argument("eval: masks of different sizes");
  }
  Mask both(a.width(), a.height());
  for (size_t i = 0; i < both.data().size(); ++i) {
    both.data()[i] = a.data()[i] != 0 && b.data()[i] != 0 ? 255 : 0;
  }
  return both;
}

double ShareOf(const Mask& mask, const Mask& within) {
  if (!within.empty() && (mask.width() != within.width() || mask.height() != within.height())) {
    throw std::invalid_argument("eval: masks of different sizes");
  }
  long long hits = 0, all = 0;
  for (size_t i = 0; i < mask.data().size(); ++i) {
    if (!within.empty() && within.data()[i] == 0) continue;
    ++all;
    if (mask.data()[i] != 0) ++hits;
  }
  return all == 0 ? 0.0 : static_cast<double>(hits) / static_cast<double>(all);
}

}  // namespace dtr::eval
