// calib/sfm/matching/guided.h -- matches of all features along epipolar lines.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "calib/sfm/matching/epipolar.h"
#include "calib/sfm/view_graph.h"

namespace dtr::sfm::matching {

/// Where features lie, sorted into strips of the plane z = 1 and along each strip into cells: those
/// near a line that crosses the strips lie next to each other.
class StripGrid {
 public:
  StripGrid() = default;
  /// `points`: on z = 1; those that are not finite are left out. `across`: the coordinate on which
  /// strips lie side by side, 0 (x) or 1 (y).
  /// `band`: distances that Near will be asked for, about; cells grow where they would be too many.
  StripGrid(std::span<const Eigen::Vector2d> points, int across, double band);

  /// Indices of the points within `band` of the line l0 x + l1 y + l2 = 0 (l0^2 + l1^2 = 1), which
  /// must run across the strips rather than along them.
  void Near(const Eigen::Vector3d& line, double band, std::vector<int>& found) const;

 private:
  struct Entry {
    double across, along;
    int index;
  };
  std::vector<Entry> entries_;
  std::vector<int> begin_;                            // of each cell, strip by strip, and the end
  Eigen::Vector2d corner_ = Eigen::Vector2d::Zero();  // across, along
  double width_ = 1, height_ = 1;                     // of a cell
  int across_ = 0, strips_ = 0, cells_ = 0;
};

/// The features of a photo, which this borrows.
class FeatureGrid {
 public:
  FeatureGrid() = default;
  /// `points`: on z = 1, NaN where a feature has no ray (nothing finds it). `band`: as StripGrid.
  FeatureGrid(std::span<const Eigen::Vector2d> points, std::span<const Descriptor> descriptors,
              double band);

  std::span<const Eigen::Vector2d> points() const { return points_; }
  std::span<const Descriptor> descriptors() const { return descriptors_; }

  /// Indices of the features within `band` of a line.
  void Near(const Eigen::Vector3d& line, double band, std::vector<int>& found) const;

 private:
  std::span<const Eigen::Vector2d> points_;
  std::span<const Descriptor> descriptors_;
  StripGrid upright_, level_;
};

/// Matches (features of a, of b, sorted) that are each other's nearest among those within `band` of
/// the epipolar lines of m in b, distinct within it and near enough.
FeatureMatches GuidedMatches(const FeatureGrid& a, const FeatureGrid& b, const Eigen::Matrix3d& m,
                             double band);

}  // namespace dtr::sfm::matching
