#include "dtr/render/nearest_by_angle.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>

#include "dtr/render/geometry.h"

namespace dtr {
namespace {

// Cameras nearer to the scene centre: squares of their offsets would leave the range of doubles.
constexpr double kNoDirection = 1e-100;
// On the unit sphere; far beyond the rounding of directions and angles, so that none is missed.
constexpr double kSlack = 1e-12;

}  // namespace

struct NearestByAngle::Search {
  Eigen::Vector3d offset, direction;  ///< of the camera, from the scene centre
  std::optional<size_t> self;
  std::vector<std::pair<double, size_t>> nearest;  ///< angle and index, sorted

  /// On the unit sphere, how far those may lie that are nearer than the last one found.
  double Reach() const {
    if (nearest.size() < kNeighbours || direction.isZero()) {
      return std::numeric_limits<double>::infinity();
    }
    return 2 * std::sin(nearest.back().first / 2) + kSlack;
  }
  void Add(size_t index, const Eigen::Vector3d& offset_of_index) {
    if (index == self) return;
    const std::pair<double, size_t> found{AngleBetween(offset, offset_of_index), index};
    nearest.insert(std::upper_bound(nearest.begin(), nearest.end(), found), found);
    if (nearest.size() > kNeighbours) nearest.pop_back();
  }
};

NearestByAngle::NearestByAngle(std::span<const Pose> cam_from_world,
                               const Eigen::Vector3d& scene_center)
    : scene_center_(scene_center) {
  for (const Pose& pose : cam_from_world) centers_.push_back(pose.TargetOriginInSource());
  std::vector<size_t> order(centers_.size());
  std::iota(order.begin(), order.end(), size_t{0});
  const auto key = [&](size_t i) {
    const Eigen::Vector3d& center = centers_[i];
    return std::tuple(center.x(), center.y(), center.z(), i);
  };
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return key(a) < key(b); });
  size_t same = 0;  // position, among those with smaller indices
  for (size_t k = 0; k < order.size(); ++k) {
    same = k > 0 && centers_[order[k]] == centers_[order[k - 1]] ? same + 1 : 0;
    if (same > kNeighbours) continue;  // it is never among the nearest
    const Eigen::Vector3d offset = centers_[order[k]] - scene_center_;
    if (offset.stableNorm() < kNoDirection) {
      at_scene_center_.push_back(order[k]);
    } else {
      tree_.push_back({order[k], offset.stableNormalized(), 0});
    }
  }
  Build(0, tree_.size());
}

void NearestByAngle::Build(size_t begin, size_t end) {
  if (end - begin < 2) return;
  Eigen::Array3d low = tree_[begin].direction.array(), high = low;
  for (size_t i = begin; i < end; ++i) {
    low = low.min(tree_[i].direction.array());
    high = high.max(tree_[i].direction.array());
  }
  int axis = 0;
  (high - low).maxCoeff(&axis);
  const size_t middle = begin + (end - begin) / 2;
  const auto at = [&](size_t i) { return tree_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(begin), at(middle), at(end), [axis](const Node& a, const Node& b) {
    return a.direction[axis] < b.direction[axis];
  });
  tree_[middle].axis = axis;
  Build(begin, middle);
  Build(middle + 1, end);
}

void NearestByAngle::Visit(size_t begin, size_t end, Search& search) const {
  if (begin == end) return;
  const size_t middle = begin + (end - begin) / 2;
  const Node& node = tree_[middle];
  const double beyond = search.direction[node.axis] - node.direction[node.axis];
  const auto visit_side = [&](bool above) {
    if (above) {
      Visit(middle + 1, end, search);
    } else {
      Visit(begin, middle, search);
    }
  };
  visit_side(beyond > 0);
  search.Add(node.index, centers_[node.index] - scene_center_);
  if (std::abs(beyond) <= search.Reach()) visit_side(!(beyond > 0));
}

std::vector<Eigen::Vector3d> NearestByAngle::Of(const Eigen::Vector3d& center,
                                                std::optional<size_t> self) const {
  Search search{center - scene_center_, Eigen::Vector3d::Zero(), self, {}};
  if (!(search.offset.stableNorm() < kNoDirection)) {
    search.direction = search.offset.stableNormalized();
  }
  for (const size_t i : at_scene_center_) search.Add(i, centers_[i] - scene_center_);
  Visit(0, tree_.size(), search);
  std::vector<Eigen::Vector3d> found;
  for (const auto& [angle, index] : search.nearest) found.push_back(centers_[index]);
  return found;
}

}  // namespace dtr
