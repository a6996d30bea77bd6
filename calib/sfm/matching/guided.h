// calib/sfm/matching/guided.h -- matches of all features along epipolar lines.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "calib/sfm/matching/epipolar.h"
#include "calib/sfm/view_graph.h"

namespace dtr::sfm::matching {

/// All features of a photo whose ray is known, sorted into square cells of the plane z = 1, cells
/// by columns: those along a line lie next to each other, descriptors too.
class FeatureGrid {
 public:
  FeatureGrid() = default;
  /// `points`: on z = 1, NaN where a feature has no ray (it is left out). `cell`: side of a cell,
  /// in the points' unit; cells grow where they would be too many.
  FeatureGrid(std::span<const Eigen::Vector2d> points, std::span<const Descriptor> descriptors,
              double cell);

  size_t size() const { return points_.size(); }
  const std::vector<Eigen::Vector2d>& points() const { return points_; }
  const std::vector<Descriptor>& descriptors() const { return descriptors_; }
  std::uint32_t FeatureOf(size_t i) const { return feature_[i]; }

  /// Indices (into the lists above) of the features within `band` of the line
  /// l0 x + l1 y + l2 = 0, in rising order.
  void Near(const Eigen::Vector3d& line, double band, std::vector<int>& found) const;

 private:
  void AddRun(int column, int first_row, int last_row, const Eigen::Vector3d& line, double band,
              std::vector<int>& found) const;

  std::vector<Eigen::Vector2d> points_;
  std::vector<Descriptor> descriptors_;
  std::vector<std::uint32_t> feature_;
  std::vector<int> begin_;  // of each cell, and the end
  Eigen::Vector2d corner_ = Eigen::Vector2d::Zero();
  double cell_ = 1;
  int columns_ = 0, rows_ = 0;
};

/// Matches (features of a, of b, sorted) that are each other's nearest among those within `band` of
/// the epipolar lines of m in b, distinct within it and near enough.
FeatureMatches GuidedMatches(const FeatureGrid& a, const FeatureGrid& b, const Eigen::Matrix3d& m,
                             double band);

}  // namespace dtr::sfm::matching
