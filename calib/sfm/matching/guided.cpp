#include "calib/sfm/matching/guided.h"

#include <algorithm>
#include <cmath>

#include "calib/sfm/matching/nearest.h"

namespace dtr::sfm::matching {
namespace {

constexpr double kMostCells = 2048;     // along a strip, and strips
constexpr double kStripBands = 8;       // width of a strip
constexpr float kBandRatio = 0.85f;     // on angles, within the band
constexpr float kFarthestAngle = 0.7f;  // COLMAP's limit for matches anywhere

void Put(Nearest& nearest, int index, int dot) {
  if (dot > nearest.dot || nearest.index < 0) {
    nearest.second = nearest.index < 0 ? -1 : nearest.dot;
    nearest.dot = dot;
    nearest.index = index;
  } else {
    nearest.second = std::max(nearest.second, dot);
  }
}

// A feature that is alone in its band is distinct when it is near.
bool Passes(const Nearest& nearest) {
  return nearest.index >= 0 && DescriptorAngle(nearest.dot) < kFarthestAngle &&
         IsDistinct(nearest, kBandRatio);
}

}  // namespace

StripGrid::StripGrid(std::span<const Eigen::Vector2d> points, int across, double band)
    : across_(across) {
  std::vector<int> finite;
  for (size_t i = 0; i < points.size(); ++i) {
    if (points[i].allFinite()) finite.push_back(static_cast<int>(i));
  }
  if (finite.empty()) return;
  Eigen::Vector2d low = points[static_cast<size_t>(finite.front())], high = low;
  for (const int i : finite) {
    low = low.cwiseMin(points[static_cast<size_t>(i)]);
    high = high.cwiseMax(points[static_cast<size_t>(i)]);
  }
  corner_ = {low[across], low[1 - across]};
  const Eigen::Vector2d size = Eigen::Vector2d(high[across], high[1 - across]) - corner_;
  width_ = std::max({kStripBands * band, size[0] / kMostCells, 1e-12});
  height_ = std::max({band, size[1] / kMostCells, 1e-12});
  strips_ = static_cast<int>(size[0] / width_) + 1;
  cells_ = static_cast<int>(size[1] / height_) + 1;
  begin_.assign(static_cast<size_t>(strips_) * static_cast<size_t>(cells_) + 1, 0);
  const auto cell_of = [&](const Eigen::Vector2d& p) {
    const int strip = static_cast<int>((p[across] - corner_[0]) / width_);
    const int cell = static_cast<int>((p[1 - across] - corner_[1]) / height_);
    return static_cast<size_t>(strip * cells_ + cell);
  };
  for (const int i : finite) ++begin_[cell_of(points[static_cast<size_t>(i)]) + 1];
  for (size_t c = 1; c < begin_.size(); ++c) begin_[c] += begin_[c - 1];
  entries_.resize(finite.size());
  std::vector<int> next(begin_);
  for (const int i : finite) {
    const Eigen::Vector2d& p = points[static_cast<size_t>(i)];
    entries_[static_cast<size_t>(next[cell_of(p)]++)] = {p[across], p[1 - across], i};
  }
}

void StripGrid::Near(const Eigen::Vector3d& line, double band, std::vector<int>& found) const {
  const double across = line[across_], along = line[1 - across_];
  const double slope = -across / along, half = band / std::abs(along);
  found.resize(entries_.size());
  size_t count = 0;
  for (int s = 0; s < strips_; ++s) {
    const double x = corner_[0] + s * width_;
    const double y0 = -(across * x + line.z()) / along, y1 = y0 + slope * width_;
    const double from = (std::min(y0, y1) - half - corner_[1]) / height_;
    const double to = (std::max(y0, y1) + half - corner_[1]) / height_;
    if (!(to >= 0) || !(from < cells_)) continue;
    const int first = static_cast<int>(std::max(from, 0.0));
    const int last = static_cast<int>(std::min(to, cells_ - 1.0));
    const int end = begin_[static_cast<size_t>(s * cells_ + last + 1)];
    for (int i = begin_[static_cast<size_t>(s * cells_ + first)]; i < end; ++i) {
      const Entry& e = entries_[static_cast<size_t>(i)];
      found[count] = e.index;
      // Without a branch: half of those looked at are near.
      count += std::abs(across * e.across + along * e.along + line.z()) <= band ? 1 : 0;
    }
  }
  found.resize(count);
}

FeatureGrid::FeatureGrid(std::span<const Eigen::Vector2d> points,
                         std::span<const Descriptor> descriptors, double band)
    : points_(points),
      descriptors_(descriptors),
      upright_(points, 0, band),
      level_(points, 1, band) {}

void FeatureGrid::Near(const Eigen::Vector3d& line, double band, std::vector<int>& found) const {
  found.clear();
  const double norm = line.head<2>().norm();
  if (!(norm > 0) || !line.allFinite()) return;
  const Eigen::Vector3d unit = line / norm;
  (std::abs(unit.y()) >= std::abs(unit.x()) ? upright_ : level_).Near(unit, band, found);
}

FeatureMatches GuidedMatches(const FeatureGrid& a, const FeatureGrid& b, const Eigen::Matrix3d& m,
                             double band) {
  std::vector<Nearest> of_b(b.points().size());
  std::vector<Nearest> of_a(a.points().size());
  std::vector<int> near, dots;
  for (size_t i = 0; i < of_a.size(); ++i) {
    if (!a.points()[i].allFinite()) continue;
    b.Near(m * a.points()[i].homogeneous(), band, near);
    dots.resize(near.size());
    DotProducts(a.descriptors()[i], b.descriptors(), near, dots);
    for (size_t k = 0; k < near.size(); ++k) {
      Put(of_a[i], near[k], dots[k]);
      Put(of_b[static_cast<size_t>(near[k])], static_cast<int>(i), dots[k]);
    }
  }
  FeatureMatches matches;
  for (size_t i = 0; i < of_a.size(); ++i) {
    if (!Passes(of_a[i])) continue;
    const auto j = static_cast<size_t>(of_a[i].index);
    if (of_b[j].index != static_cast<int>(i) || !Passes(of_b[j])) continue;
    matches.emplace_back(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j));
  }
  return matches;
}

}  // namespace dtr::sfm::matching
