#include "stereo/background.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "dtr/base/parallel_for.h"

namespace dtr::stereo {
namespace {

constexpr int kBlock = 2;                   // side of the blocks whose differences tell the noise
constexpr double kRounding = 1.0 / 12;      // variance of rounding to 8 bits
constexpr double kMedianOfNormal = 0.6745;  // of |x|, in standard deviations
constexpr double kAgreeing = 11.34;         // 99 % of chi-square with 3 degrees of freedom
constexpr int kLeastSupport = 3;
constexpr double kLeastShare = 0.3;
constexpr int kWindowRadius = 3;  // of stereo's windows (patchmatch/kernel.h)
constexpr double kChangedSigmas = 6, kChangedSlack = 1.2;

void RequireSameSize(const ViewOverTime& view) {
  if (view.images.empty() || view.images.size() > kMaxTimeSteps) {
    throw std::invalid_argument("background: expected 1 to 64 images");
  }
  const ImageRgb8& first = view.images.front();
  for (const ImageRgb8& image : view.images) {
    if (image.width() != first.width() || image.height() != first.height()) {
      throw std::invalid_argument("background: expected images of one size");
    }
  }
  if (!view.masks.empty() && view.masks.size() != view.images.size()) {
    throw std::invalid_argument("background: expected one mask for each image");
  }
}

bool IsUsable(const ViewOverTime& view, size_t image, int x, int y) {
  return view.masks.empty() || view.masks[image].empty() || view.masks[image](x, y) != 0;
}

/// Sum over a block and its channels of `after` less `before`.
int BlockDifference(const ImageRgb8& before, const ImageRgb8& after, int x, int y) {
  int sum = 0;
  for (int j = 0; j < kBlock; ++j) {
    const std::uint8_t *a = before.row(y + j) + 3 * x, *b = after.row(y + j) + 3 * x;
    for (int k = 0; k < 3 * kBlock; ++k) sum += b[k] - a[k];
  }
  return sum;
}

int SquaredDistance(const std::uint8_t* a, const std::uint8_t* b) {
  int sum = 0;
  for (int c = 0; c < 3; ++c) sum += (a[c] - b[c]) * (a[c] - b[c]);
  return sum;
}

/// The colour that most of the images agree on at (x, y); its support, 0 where that is too small.
int ColourOfMost(const ViewOverTime& view, int x, int y, int farthest,
                 std::array<std::uint8_t, 3>* colour) {
  std::array<const std::uint8_t*, kMaxTimeSteps> seen;
  int count = 0;
  for (size_t i = 0; i < view.images.size(); ++i) {
    if (IsUsable(view, i, x, y)) seen[static_cast<size_t>(count++)] = view.images[i].row(y) + 3 * x;
  }
  int most = 0, centre = -1;
  for (int i = 0; i < count; ++i) {
    int agreeing = 0;
    for (int j = 0; j < count; ++j) {
      agreeing +=
          SquaredDistance(seen[static_cast<size_t>(i)], seen[static_cast<size_t>(j)]) <= farthest;
    }
    if (agreeing > most) {
      most = agreeing;
      centre = i;
    }
  }
  if (most < kLeastSupport || most < kLeastShare * count) return 0;
  std::array<int, 3> sum{};
  for (int j = 0; j < count; ++j) {
    const std::uint8_t* other = seen[static_cast<size_t>(j)];
    if (SquaredDistance(seen[static_cast<size_t>(centre)], other) > farthest) continue;
    for (size_t c = 0; c < 3; ++c) sum[c] += other[c];
  }
  for (size_t c = 0; c < 3; ++c) {
    (*colour)[c] = static_cast<std::uint8_t>((sum[c] + most / 2) / most);
  }
  return most;
}

/// How much a photo differs from the background at a pixel, in variances of what noise explains,
/// summed over the channels.
float Difference(const std::uint8_t* photo, const std::uint8_t* background, int support,
                 double variance) {
  const double expected = variance * (1 + 1.0 / support) + kRounding;
  return static_cast<float>(SquaredDistance(photo, background) / expected);
}

/// Sums over a window of `2 kWindowRadius + 1` along a row, cut off at its ends.
void SumAlong(const std::vector<float>& values, std::vector<float>* sums) {
  const int n = static_cast<int>(values.size());
  for (int x = 0; x < n; ++x) {
    float sum = 0;
    for (int i = std::max(0, x - kWindowRadius); i <= std::min(n - 1, x + kWindowRadius); ++i) {
      sum += values[static_cast<size_t>(i)];
    }
    (*sums)[static_cast<size_t>(x)] = sum;
  }
}

}  // namespace

double NoiseOverTime(const ViewOverTime& view) {
  RequireSameSize(view);
  if (view.images.size() < 2) return 0;
  const int rows = view.images.front().height() / kBlock, width = view.images.front().width();
  constexpr int kLargest = 3 * kBlock * kBlock * 255;
  std::vector<std::vector<long>> counts(static_cast<size_t>(rows));
  ParallelFor(0, rows, [&](int row) {
    std::vector<long>& own = counts[static_cast<size_t>(row)];
    own.assign(kLargest + 1, 0);
    const int y = row * kBlock;
    for (size_t i = 0; i + 1 < view.images.size(); ++i) {
      for (int x = 0; x + kBlock <= width; x += kBlock) {
        if (!IsUsable(view, i, x, y) || !IsUsable(view, i + 1, x, y)) continue;
        const int sum = BlockDifference(view.images[i], view.images[i + 1], x, y);
        ++own[static_cast<size_t>(std::abs(sum))];
      }
    }
  });
  std::vector<long> all(kLargest + 1, 0);
  long blocks = 0;
  for (const std::vector<long>& own : counts) {
    for (size_t d = 0; d < own.size(); ++d) {
      all[d] += own[d];
      blocks += own[d];
    }
  }
  if (blocks == 0) return std::sqrt(kRounding);
  // The median, between whole numbers by the share of its own that lies below it.
  long below = 0;
  size_t at = 0;
  while (2 * (below + all[at]) < blocks) below += all[at++];
  const double part = (0.5 * static_cast<double>(blocks) - static_cast<double>(below)) /
                      static_cast<double>(std::max(1L, all[at]));
  // |0| has half the room of the others, which stand for both signs.
  const double median = at == 0 ? 0.5 * part : static_cast<double>(at) - 0.5 + part;
  const double deviation = median / kMedianOfNormal / std::sqrt(2.0 * 3 * kBlock * kBlock);
  return std::max(deviation, std::sqrt(kRounding));
}

Background FindBackground(const ViewOverTime& view) {
  RequireSameSize(view);
  const int w = view.images.front().width(), h = view.images.front().height();
  Background background{ImageRgb8(w, h, 3), Grid<std::uint8_t>(w, h), NoiseOverTime(view)};
  const double variance = background.noise * background.noise;
  const auto farthest = static_cast<int>(std::ceil(2 * variance * kAgreeing));
  ParallelFor(0, h, [&](int y) {
    std::array<std::uint8_t, 3> colour{};
    for (int x = 0; x < w; ++x) {
      const int support = ColourOfMost(view, x, y, farthest, &colour);
      background.support(x, y) = static_cast<std::uint8_t>(support);
      if (support > 0) std::copy(colour.begin(), colour.end(), background.image.row(y) + 3 * x);
    }
  });
  return background;
}

Mask ChangedPixels(const ImageRgb8& image, const Mask& usable, const Background& background) {
  const int w = image.width(), h = image.height();
  if (w != background.image.width() || h != background.image.height()) {
    throw std::invalid_argument("background: expected an image of its size");
  }
  const double variance = background.noise * background.noise;
  // Sums along rows first; a pixel without a background is as good as changed.
  Grid<float> sums(w, h), counts(w, h), unknown(w, h);
  ParallelFor(0, h, [&](int y) {
    const auto width = static_cast<size_t>(w);
    std::vector<float> difference(width, 0), counted(width, 0), lost(width, 0), along(width);
    for (int x = 0; x < w; ++x) {
      const auto i = static_cast<size_t>(x);
      if (!usable.empty() && usable(x, y) == 0) continue;
      const int support = background.support(x, y);
      lost[i] = support == 0 ? 1.0f : 0.0f;
      if (support == 0) continue;
      counted[i] = 3;
      difference[i] =
          Difference(image.row(y) + 3 * x, background.image.row(y) + 3 * x, support, variance);
    }
    for (auto& [from, to] :
         {std::pair{&difference, &sums}, {&counted, &counts}, {&lost, &unknown}}) {
      SumAlong(*from, &along);
      std::copy(along.begin(), along.end(), to->row(y));
    }
  });
  Mask changed(w, h);
  ParallelFor(0, h, [&](int y) {
    for (int x = 0; x < w; ++x) {
      float sum = 0, count = 0, lost = 0;
      for (int j = std::max(0, y - kWindowRadius); j <= std::min(h - 1, y + kWindowRadius); ++j) {
        sum += sums(x, j);
        count += counts(x, j);
        lost += unknown(x, j);
      }
      const double n = static_cast<double>(count);
      const double limit = kChangedSlack * (n + kChangedSigmas * std::sqrt(2 * n));
      changed(x, y) = lost > 0 || static_cast<double>(sum) > limit ? 255 : 0;
    }
  });
  return changed;
}

}  // namespace dtr::stereo
