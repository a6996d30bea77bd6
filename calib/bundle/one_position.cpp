#include "calib/bundle/one_position.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "dtr/base/order_statistics.h"

namespace dtr::calib {
namespace {

constexpr double kSamePosition = 0.005;  // of the median distance of what both see
constexpr double kNeighbour = 0.02;      // likewise: nearer ones have no position of their own
constexpr size_t kMinShared = 10;        // points
constexpr size_t kGroupsNamed = 3, kNamesOfGroup = 4;

using Distances = std::map<std::pair<int, int>, std::vector<double>>;

// Median distance of each image's points; 0: it sees none.
std::vector<double> MedianDistances(const SfmModel& model) {
  std::vector<double> medians;
  for (const SfmImage& image : model.images) {
    std::vector<double> distances;
    for (const SfmFeature& feature : image.features) {
      if (feature.point_id == SfmFeature::kNoPoint) continue;
      distances.push_back(
          (image.cam_from_world * model.points.at(feature.point_id).p_in_world).norm());
    }
    medians.push_back(distances.empty() ? 0 : UpperMedian(distances));
  }
  return medians;
}

// Pairs of images that stand nearer to each other than `near` times the first one's distances.
std::set<std::pair<int, int>> NearPairs(const SfmModel& model, double near) {
  const std::vector<double> medians = MedianDistances(model);
  std::vector<Eigen::Vector3d> centres;
  for (const SfmImage& image : model.images) {
    centres.push_back(image.cam_from_world.TargetOriginInSource());
  }
  std::set<std::pair<int, int>> pairs;
  for (size_t a = 0; a < centres.size(); ++a) {
    for (size_t b = a + 1; b < centres.size(); ++b) {
      if ((centres[a] - centres[b]).norm() < near * medians[a]) {
        pairs.emplace(static_cast<int>(a), static_cast<int>(b));
      }
    }
  }
  return pairs;
}

// Distances of the points that near pairs of images share, from the first of the two.
Distances SharedDistances(const SfmModel& model) {
  constexpr double kMuchFarther = 10;  // may be what two images share than what the first sees
  Distances distances;
  for (const auto& pair : NearPairs(model, kMuchFarther * kSamePosition)) {
    const SfmImage& a = model.images[static_cast<size_t>(pair.first)];
    std::set<std::uint64_t> seen;
    for (const SfmFeature& feature : a.features) seen.insert(feature.point_id);
    seen.erase(SfmFeature::kNoPoint);
    for (const SfmFeature& feature : model.images[static_cast<size_t>(pair.second)].features) {
      if (!seen.contains(feature.point_id)) continue;
      distances[pair].push_back(
          (a.cam_from_world * model.points.at(feature.point_id).p_in_world).norm());
    }
  }
  return distances;
}

}  // namespace

std::vector<std::vector<int>> ImagesOfOnePosition(const SfmModel& model) {
  const auto centre = [&](int image) {
    return model.images[static_cast<size_t>(image)].cam_from_world.TargetOriginInSource();
  };
  std::set<std::pair<int, int>> same, neighbours;
  for (auto& [pair, distances] : SharedDistances(model)) {
    if (distances.size() < kMinShared) continue;
    const double share = (centre(pair.first) - centre(pair.second)).norm() / UpperMedian(distances);
    if (share < kSamePosition) {
      same.insert(pair);
    } else if (share < kNeighbour) {
      neighbours.insert(pair);
    }
  }
  std::vector<std::vector<int>> groups;
  for (int image = 0; image < static_cast<int>(model.images.size()); ++image) {
    const auto group = std::find_if(groups.begin(), groups.end(), [&](const auto& others) {
      return std::all_of(others.begin(), others.end(), [&](int other) {
        return same.contains({other, image});
      });
    });
    if (group == groups.end()) {
      groups.push_back({image});
    } else {
      group->push_back(image);
    }
  }
  // The frames of a slow video follow each other, and share no position.
  const auto in_a_row = [&](int image) {
    return std::any_of(neighbours.begin(), neighbours.end(), [image](const auto& pair) {
      return pair.first == image || pair.second == image;
    });
  };
  std::erase_if(groups, [&](const std::vector<int>& group) {
    return group.size() < 2 || std::any_of(group.begin(), group.end(), in_a_row);
  });
  return groups;
}

std::string OnePositionLine(const SfmModel& model) {
  const auto groups = ImagesOfOnePosition(model);
  if (groups.empty()) return "";
  std::vector<std::string> named;
  size_t photos = 0;
  for (const std::vector<int>& group : groups) {
    photos += group.size();
    if (named.size() == kGroupsNamed) continue;
    std::vector<std::string> names;
    for (const int image : group) names.push_back(model.images[static_cast<size_t>(image)].name);
    const size_t count = names.size();
    names.resize(std::min(count, kNamesOfGroup));
    named.push_back(fmt::format(
        "{}{}", fmt::join(names, " + "),
        count > kNamesOfGroup ? fmt::format(" and {} more", count - kNamesOfGroup) : ""));
  }
  return fmt::format("{} photos share {} position{} (exposure brackets, bursts): {}{}", photos,
                     groups.size(), groups.size() == 1 ? "" : "s", fmt::join(named, "; "),
                     groups.size() > kGroupsNamed ? "; ..." : "");
}

}  // namespace dtr::calib
