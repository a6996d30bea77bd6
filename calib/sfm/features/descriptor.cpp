#include "calib/sfm/features/descriptor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace dtr::sfm {
namespace {

constexpr int kSmoothings = 6;        // means of three bins, as VLFeat
constexpr float kPeakShare = 0.8f;    // of the highest peak
constexpr float kMaxOfLength = 0.2f;  // a bin's, before normalisation
constexpr float kStoredScale = 512.0f;
constexpr size_t kBins = kCells * kCells * kCellDirections;

void Smooth(std::array<float, kDirections>* histogram) {
  for (int step = 0; step < kSmoothings; ++step) {
    const auto before = *histogram;
    for (size_t i = 0; i < kDirections; ++i) {
      const float left = before[(i + kDirections - 1) % kDirections];
      (*histogram)[i] = (left + before[i] + before[(i + 1) % kDirections]) * (1.0f / 3);
    }
  }
}

/// In eight interleaved parts: the additions need not wait for each other.
template <typename Of>
float SumOverBins(const Of& of) {
  std::array<float, 8> parts{};
  for (size_t i = 0; i < kBins; i += parts.size()) {
    for (size_t k = 0; k < parts.size(); ++k) parts[k] += of(i + k);
  }
  return ((parts[0] + parts[4]) + (parts[1] + parts[5])) +
         ((parts[2] + parts[6]) + (parts[3] + parts[7]));
}

}  // namespace

std::vector<float> Orientations(std::array<float, kDirections> histogram, int max_count) {
  Smooth(&histogram);
  const float highest = *std::max_element(histogram.begin(), histogram.end());
  struct Peak {
    float height, bin;
  };
  std::vector<Peak> peaks;
  for (size_t i = 0; i < kDirections; ++i) {
    const float h = histogram[i];
    const float left = histogram[(i + kDirections - 1) % kDirections];
    const float right = histogram[(i + 1) % kDirections];
    if (!(h > kPeakShare * highest && h > left && h > right)) continue;
    const float offset = 0.5f * (right - left) / (2 * h - left - right);  // of a parabola
    peaks.push_back({h, static_cast<float>(i) + 0.5f + offset});
  }
  std::stable_sort(peaks.begin(), peaks.end(),
                   [](const Peak& a, const Peak& b) { return a.height > b.height; });
  peaks.resize(std::min(peaks.size(), static_cast<size_t>(std::max(max_count, 0))));
  std::vector<float> radians;
  constexpr float kBin = 2 * std::numbers::pi_v<float> / kDirections;
  for (const Peak& peak : peaks) {
    const float bin = peak.bin < 0 ? peak.bin + kDirections
                                   : (peak.bin >= kDirections ? peak.bin - kDirections : peak.bin);
    radians.push_back(bin * kBin);
  }
  return radians;
}

Descriptor StoredDescriptor(const std::array<float, kBins>& cells) {
  Descriptor stored{};
  const float limit =
      kMaxOfLength * std::sqrt(SumOverBins([&](size_t i) { return cells[i] * cells[i]; }));
  std::array<float, kBins> clamped;
  for (size_t i = 0; i < kBins; ++i) clamped[i] = std::min(cells[i], limit);
  const float sum = SumOverBins([&](size_t i) { return clamped[i]; });
  if (!(sum > 0)) return stored;
  const float scale = kStoredScale * kStoredScale / sum;
  std::array<float, kBins> rooted;
  for (size_t i = 0; i < kBins; ++i) {
    rooted[i] = std::min(std::sqrt(std::max(clamped[i], 0.0f) * scale) + 0.5f, 255.0f);
  }
  for (size_t cell = 0; cell < kBins; cell += kCellDirections) {
    for (size_t o = 0; o < kCellDirections; ++o) {
      // COLMAP counts directions the other way round.
      const size_t at = cell + (kCellDirections - o) % kCellDirections;
      stored[at] = static_cast<std::uint8_t>(rooted[cell + o]);
    }
  }
  return stored;
}

}  // namespace dtr::sfm
