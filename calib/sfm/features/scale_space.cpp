#include "calib/sfm/features/scale_space.h"

#include <algorithm>
#include <cmath>

#include "calib/sfm/features/blur_kernel.h"
#include "calib/sfm/features/extrema_kernel.h"
#include "calib/sfm/features/refine_extremum.h"

namespace dtr::sfm {
namespace {

constexpr int kDifferences = kLevels - 1;
constexpr int kDifferenceRows = 4;  // in memory at a time; three are looked at
static_assert(kFirstSigma < 2);

double SigmaOf(double level) { return kFirstSigma * std::exp2(level / kScalesPerOctave); }

/// What makes a level from the one below it.
Taps TapsOfLevel(int level) {
  const double sigma = SigmaOf(level), below = SigmaOf(level - 1);
  return GaussianTaps(std::sqrt(sigma * sigma - below * below));
}

/// Rows of a level that the ones above it and the refinement of extrema need at a time.
int RowsInMemory() {
  int rows = kBlurRows + 2 * (kRefineReach + 2);
  for (int level = 1; level < kLevels; ++level) rows += TapsOfLevel(level).radius;
  return rows;
}

bool IsWhole(int level) { return level >= 1 && level <= kScalesPerOctave; }

/// Makes all levels together from top to bottom, so that most rows are in the cache when the next
/// level, the differences and the extrema need them.
class OctaveMaker {
 public:
  OctaveMaker(int width, int height, double pixel, const ExtremumLimits& limits)
      : limits_(limits),
        scratch_(width),
        difference_(width, kDifferenceRows * kDifferences, kDifferenceRows * kDifferences) {
    octave_.width = width;
    octave_.height = height;
    octave_.pixel = pixel;
    for (int level = 0; level < kLevels; ++level) {
      octave_.levels[static_cast<size_t>(level)] =
          RowStore(width, height, IsWhole(level) ? height : RowsInMemory());
      if (level > 0) taps_[static_cast<size_t>(level)] = TapsOfLevel(level);
    }
  }

  /// `fill(y, row)` makes a row of the first level.
  template <typename Fill>
  Octave Make(const Fill& fill) {
    for (int y = 0; y < octave_.height; y += kBlurRows) {
      done_[0] = std::min(y + kBlurRows, octave_.height);
      for (int row = y; row < done_[0]; ++row) fill(row, octave_.levels[0].row(row));
      for (int level = 1; level < kLevels; ++level) Advance(level);
      Scan();
    }
    return std::move(octave_);
  }

 private:
  /// Blurs the rows of a level for which the level below has enough.
  void Advance(int level) {
    const size_t l = static_cast<size_t>(level);
    RowStore& below = octave_.levels[l - 1];
    const int radius = taps_[l].radius;
    const int end = done_[l - 1] == octave_.height ? octave_.height : done_[l - 1] - radius;
    while (done_[l] < end) {
      const int count = std::min(kBlurRows, end - done_[l]);
      std::array<const float*, kBlurRows + 2 * kMaxBlurRadius> rows;
      for (int i = 0; i < count + 2 * radius; ++i) {
        rows[static_cast<size_t>(i)] =
            below.row(std::clamp(done_[l] - radius + i, 0, octave_.height - 1));
      }
      std::array<float*, kBlurRows> out;
      for (int i = 0; i < count; ++i) {
        out[static_cast<size_t>(i)] = octave_.levels[l].row(done_[l] + i);
      }
      BlurRows(rows.data(), count, octave_.width, taps_[l], &scratch_, out.data());
      done_[l] += count;
    }
  }

  float* DifferenceRow(int scale, int y) {
    return difference_.row(scale * kDifferenceRows + y % kDifferenceRows);
  }

  void Subtract(int y) {
    for (int i = 0; i < kDifferences; ++i) {
      const size_t l = static_cast<size_t>(i);
      SubtractRow(octave_.levels[l].row(y), octave_.levels[l + 1].row(y), octave_.width,
                  DifferenceRow(i, y));
    }
  }

  /// Looks for extrema in all rows around which the refinement has what it may need.
  void Scan() {
    const int last = done_[kLevels - 1];
    const int end = last == octave_.height ? last - 1 : last - kRefineReach;
    for (; scanned_ < end; ++scanned_) {
      if (scanned_ == 1) {
        Subtract(0);
        Subtract(1);
      }
      Subtract(scanned_ + 1);
      for (int scale = 1; scale <= kScalesPerOctave; ++scale) ScanRow(scale, scanned_);
    }
  }

  void ScanRow(int scale, int y) {
    ScaleRows rows;
    for (int s = 0; s < 3; ++s) {
      for (int r = 0; r < 3; ++r) {
        rows[static_cast<size_t>(s)][static_cast<size_t>(r)] =
            DifferenceRow(scale - 1 + s, y - 1 + r);
      }
    }
    // Refinement raises the contrast; this share of the limit is VLFeat's.
    constexpr double kBeforeRefinement = 0.8;
    columns_.clear();
    FindExtrema(rows, octave_.width, static_cast<float>(kBeforeRefinement * limits_.min_contrast),
                &columns_);
    for (const int x : columns_) {
      const auto refined = RefineExtremum(octave_, scale, x, y, limits_);
      if (refined) octave_.extrema.push_back(*refined);
    }
  }

  const ExtremumLimits limits_;
  Octave octave_;
  std::array<Taps, kLevels> taps_;
  std::array<int, kLevels> done_{};  ///< rows of each level
  int scanned_ = 1;                  ///< the next row to look for extrema in
  BlurScratch scratch_;
  RowStore difference_;
  std::vector<int> columns_;
};

}  // namespace

Octave FirstOctave(const RowStore& image, int height, const ExtremumLimits& limits) {
  // In pixels of the doubled image, which doubles the camera's blur.
  const double camera = 2 * kCameraSigma;
  const DoublingTaps taps =
      LinearDoublingTaps(std::sqrt(kFirstSigma * kFirstSigma - camera * camera));
  const int radius = taps.even.radius, width = image.width();
  BlurScratch scratch(width);
  return OctaveMaker(2 * width, 2 * height, 0.5, limits).Make([&](int y, float* row) {
    std::array<const float*, 2 * kMaxBlurRadius + 1> rows;
    for (int i = 0; i <= 2 * radius; ++i) {
      rows[static_cast<size_t>(i)] = image.row(std::clamp(y / 2 - radius + i, 0, height - 1));
    }
    DoubleRow(rows.data(), y % 2, width, taps, &scratch, row);
  });
}

Octave NextOctave(const Octave& below, const ExtremumLimits& limits) {
  const int width = below.width / 2;
  const RowStore& image = below.levels[kScalesPerOctave];  // blurred by 2 kFirstSigma
  return OctaveMaker(width, below.height / 2, 2 * below.pixel, limits).Make([&](int y, float* row) {
    const float* from = image.row(2 * y);
    for (int x = 0; x < width; ++x) row[x] = from[2 * x];
  });
}

std::size_t OctaveBytes(int width, int height) {
  std::size_t values = RowStore::Values(width, kDifferenceRows * kDifferences, 1 << 30) +
                       static_cast<size_t>(width + 4 * RowStore::kRowUnit) * 2 * kBlurRows;
  for (int level = 0; level < kLevels; ++level) {
    values += RowStore::Values(width, height, IsWhole(level) ? height : RowsInMemory());
  }
  return values * sizeof(float);
}

}  // namespace dtr::sfm
