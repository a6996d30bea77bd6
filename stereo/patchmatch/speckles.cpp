#include "stereo/patchmatch/speckles.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "dtr/base/order_statistics.h"

namespace dtr::stereo::patchmatch {
namespace {

/// Connected areas smaller than this share of the image are speckles. Pixels connect across at most
/// this many pixels of disparity.
constexpr double kSpeckleShare = 1e-4;
constexpr float kConnectedPx = 1.0f;
/// Bars of a fence and leaves are small too; they stay when on average so many views' planes lead
/// to them. On plaza 0.6 % more true pixels within 1 %, 0.2 % more outliers.
constexpr float kMinSupport = 1.5f;
/// Other speckles are asked in the squares of so many pixels around a speckle's. They agree within
/// this share of the range that was searched, at least so many pixels; of those around, weighted by
/// their pixels, so many must.
constexpr int kSquarePx = 16;
constexpr float kAgreeingShareOfRange = 0.03f, kMinAgreeingPx = 2.0f;
constexpr float kMinCompany = 1.0f / 3;

struct Speckle {
  std::vector<std::pair<int, int>> pixels;
  int square = 0;      ///< of its mean position
  float w = 0;         ///< median near_z / z
  float px_per_w = 0;  ///< there
};

class Speckles {
 public:
  Speckles(const SpeckleEvidence& evidence, DepthEstimate* estimate)
      : evidence_(evidence),
        estimate_(*estimate),
        columns_((Width() + kSquarePx - 1) / kSquarePx),
        rows_((Height() + kSquarePx - 1) / kSquarePx),
        in_square_(static_cast<size_t>(columns_) * static_cast<size_t>(rows_)) {}

  void Remove() {
    Find();
    std::vector<const Speckle*> chance;
    for (const Speckle& speckle : speckles_) {
      if (!HasCompany(speckle)) chance.push_back(&speckle);
    }
    for (const Speckle* speckle : chance) Erase(speckle->pixels);
  }

 private:
  int Width() const { return evidence_.px_per_w.width(); }
  int Height() const { return evidence_.px_per_w.height(); }
  float WAt(int x, int y) const { return evidence_.near_z / estimate_.depth(x, y); }

  void Erase(const std::vector<std::pair<int, int>>& pixels) {
    for (const auto& [x, y] : pixels) {
      estimate_.depth(x, y) = estimate_.inverse_depth_sigma(x, y) = 0;
    }
  }

  /// The connected area around a pixel that was not seen yet.
  void Follow(int x0, int y0, Grid<std::uint8_t>& seen,
              std::vector<std::pair<int, int>>& area) const {
    const DepthImage& depth = estimate_.depth;
    area.assign(1, {x0, y0});
    seen(x0, y0) = 1;
    for (size_t next = 0; next < area.size(); ++next) {
      const auto [x, y] = area[next];
      for (const auto& [dx, dy] : {std::pair(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
        const int u = x + dx, v = y + dy;
        if (!depth.Contains(u, v) || seen(u, v) || DepthImage::IsHole(depth(u, v))) continue;
        const float step = WAt(x, y) - WAt(u, v);
        if (std::abs(step) * evidence_.px_per_w(x, y) > kConnectedPx) continue;
        seen(u, v) = 1;
        area.emplace_back(u, v);
      }
    }
  }

  bool IsSupported(const std::vector<std::pair<int, int>>& area) const {
    int support = 0;
    for (const auto& [x, y] : area) support += evidence_.consistent(x, y);
    return static_cast<float>(support) >= kMinSupport * static_cast<float>(area.size());
  }

  /// Erases what has no support; keeps the rest to be asked about.
  void Find() {
    const int least = static_cast<int>(std::ceil(kSpeckleShare * Width() * Height()));
    Grid<std::uint8_t> seen(Width(), Height());
    std::vector<std::pair<int, int>> area;
    for (int y = 0; y < Height(); ++y) {
      for (int x = 0; x < Width(); ++x) {
        if (seen(x, y) || DepthImage::IsHole(estimate_.depth(x, y))) continue;
        Follow(x, y, seen, area);
        if (static_cast<int>(area.size()) >= least) continue;
        if (IsSupported(area)) {
          Keep(area);
        } else {
          Erase(area);
        }
      }
    }
  }

  void Keep(const std::vector<std::pair<int, int>>& area) {
    Speckle speckle{area};
    std::vector<float> ws;
    long sum_x = 0, sum_y = 0;
    for (const auto& [x, y] : area) {
      ws.push_back(WAt(x, y));
      sum_x += x, sum_y += y;
    }
    speckle.w = UpperMedian(ws);
    const auto count = static_cast<long>(area.size());
    const int x = static_cast<int>(sum_x / count), y = static_cast<int>(sum_y / count);
    speckle.square = (y / kSquarePx) * columns_ + x / kSquarePx;
    speckle.px_per_w = evidence_.px_per_w(area.front().first, area.front().second);
    in_square_[static_cast<size_t>(speckle.square)].push_back(speckles_.size());
    speckles_.push_back(std::move(speckle));
  }

  bool HasCompany(const Speckle& speckle) const {
    const float reach =
        std::max(kMinAgreeingPx / speckle.px_per_w, kAgreeingShareOfRange * evidence_.w_range);
    size_t others = 0, agreeing = 0;
    const int column = speckle.square % columns_, row = speckle.square / columns_;
    for (int v = std::max(0, row - 1); v <= std::min(rows_ - 1, row + 1); ++v) {
      for (int u = std::max(0, column - 1); u <= std::min(columns_ - 1, column + 1); ++u) {
        for (const size_t k : in_square_[static_cast<size_t>(v * columns_ + u)]) {
          const Speckle& other = speckles_[k];
          if (&other == &speckle) continue;
          others += other.pixels.size();
          if (std::abs(other.w - speckle.w) <= reach) agreeing += other.pixels.size();
        }
      }
    }
    return static_cast<float>(agreeing) >= kMinCompany * static_cast<float>(others);
  }

  const SpeckleEvidence& evidence_;
  DepthEstimate& estimate_;
  const int columns_, rows_;
  std::vector<Speckle> speckles_;
  std::vector<std::vector<size_t>> in_square_;  ///< by square, indices of speckles_
};

}  // namespace

void RemoveSpeckles(const SpeckleEvidence& evidence, DepthEstimate* estimate) {
  Speckles(evidence, estimate).Remove();
}

}  // namespace dtr::stereo::patchmatch
