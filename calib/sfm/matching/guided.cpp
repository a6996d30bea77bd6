#include "calib/sfm/matching/guided.h"

#include <algorithm>
#include <cmath>

#include "calib/sfm/matching/nearest.h"

namespace dtr::sfm::matching {
namespace {

constexpr double kMostCellsASide = 1024;
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

FeatureGrid::FeatureGrid(std::span<const Eigen::Vector2d> points,
                         std::span<const Descriptor> descriptors, double cell) {
  std::vector<size_t> known;
  for (size_t i = 0; i < points.size(); ++i) {
    if (points[i].allFinite()) known.push_back(i);
  }
  if (known.empty()) return;
  Eigen::Vector2d low = points[known.front()], high = low;
  for (const size_t i : known) {
    low = low.cwiseMin(points[i]);
    high = high.cwiseMax(points[i]);
  }
  corner_ = low;
  cell_ = std::max({cell, (high - low).maxCoeff() / kMostCellsASide, 1e-12});
  columns_ = static_cast<int>((high.x() - low.x()) / cell_) + 1;
  rows_ = static_cast<int>((high.y() - low.y()) / cell_) + 1;
  const auto cell_of = [&](size_t i) {
    const Eigen::Vector2d at = (points[i] - corner_) / cell_;
    return static_cast<size_t>(static_cast<int>(at.x()) * rows_ + static_cast<int>(at.y()));
  };
  std::stable_sort(known.begin(), known.end(),
                   [&](size_t i, size_t j) { return cell_of(i) < cell_of(j); });
  begin_.assign(static_cast<size_t>(columns_) * static_cast<size_t>(rows_) + 1, 0);
  for (const size_t i : known) {
    ++begin_[cell_of(i) + 1];
    points_.push_back(points[i]);
    descriptors_.push_back(descriptors[i]);
    feature_.push_back(static_cast<std::uint32_t>(i));
  }
  for (size_t c = 1; c < begin_.size(); ++c) begin_[c] += begin_[c - 1];
}

void FeatureGrid::AddRun(int column, int first_row, int last_row, const Eigen::Vector3d& line,
                         double band, std::vector<int>& found) const {
  first_row = std::max(first_row, 0);
  last_row = std::min(last_row, rows_ - 1);
  if (first_row > last_row) return;
  const auto row0 = static_cast<size_t>(column * rows_ + first_row);
  const auto row1 = static_cast<size_t>(column * rows_ + last_row);
  for (int i = begin_[row0]; i < begin_[row1 + 1]; ++i) {
    const Eigen::Vector2d& p = points_[static_cast<size_t>(i)];
    if (std::abs(line.x() * p.x() + line.y() * p.y() + line.z()) <= band) found.push_back(i);
  }
}

void FeatureGrid::Near(const Eigen::Vector3d& line, double band, std::vector<int>& found) const {
  found.clear();
  const double norm = line.head<2>().norm();
  if (!(norm > 0) || !line.allFinite()) return;
  const Eigen::Vector3d unit = line / norm;
  // In cells, from the corner.
  const double c = (unit.head<2>().dot(corner_) + unit.z()) / cell_, reach = band / cell_;
  const auto row_of = [&](double y) {
    return static_cast<int>(std::floor(std::clamp(y, -1.0, rows_ + 1.0)));
  };
  if (std::abs(unit.y()) >= 1e-3) {
    // In a column the line and its band span an interval of rows.
    const double slope = -unit.x() / unit.y(), half = reach / std::abs(unit.y());
    for (int x = 0; x < columns_; ++x) {
      const double y0 = slope * x - c / unit.y(), y1 = y0 + slope;
      AddRun(x, row_of(std::min(y0, y1) - half), row_of(std::max(y0, y1) + half), unit, band,
             found);
    }
    return;
  }
  // An upright line: its few columns in full.
  const double slack = reach + std::abs(unit.y()) * rows_ + 1;
  const double middle = -c / unit.x();
  const int x0 = static_cast<int>(std::floor(std::clamp(middle - slack, 0.0, columns_ + 1.0)));
  const int x1 = static_cast<int>(std::floor(std::clamp(middle + slack, -1.0, columns_ - 1.0)));
  for (int x = x0; x <= x1; ++x) AddRun(x, 0, rows_ - 1, unit, band, found);
}

FeatureMatches GuidedMatches(const FeatureGrid& a, const FeatureGrid& b, const Eigen::Matrix3d& m,
                             double band) {
  std::vector<Nearest> of_b(b.size());
  std::vector<Nearest> of_a(a.size());
  std::vector<int> near, dots;
  for (size_t i = 0; i < a.size(); ++i) {
    b.Near(m * a.points()[i].homogeneous(), band, near);
    dots.resize(near.size());
    // Runs of features next to each other in one call.
    for (size_t k = 0; k < near.size();) {
      size_t end = k + 1;
      while (end < near.size() && near[end] == near[end - 1] + 1) ++end;
      DotProducts(a.descriptors()[i],
                  std::span(b.descriptors()).subspan(static_cast<size_t>(near[k]), end - k),
                  std::span(dots).subspan(k, end - k));
      k = end;
    }
    for (size_t k = 0; k < near.size(); ++k) {
      Put(of_a[i], near[k], dots[k]);
      Put(of_b[static_cast<size_t>(near[k])], static_cast<int>(i), dots[k]);
    }
  }
  FeatureMatches matches;
  for (size_t i = 0; i < a.size(); ++i) {
    if (!Passes(of_a[i])) continue;
    const auto j = static_cast<size_t>(of_a[i].index);
    if (of_b[j].index != static_cast<int>(i) || !Passes(of_b[j])) continue;
    matches.emplace_back(a.FeatureOf(i), b.FeatureOf(j));
  }
  std::sort(matches.begin(), matches.end());
  return matches;
}

}  // namespace dtr::sfm::matching
