#include "calib/bundle/one_place.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "dtr/base/order_statistics.h"

namespace dtr::calib {
namespace {

constexpr double kSamePosition = 0.005;  // of the median distance of what both see
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

std::vector<std::vector<int>> ImagesOfOnePlace(const SfmModel& model) {
  std::vector<int> first(model.images.size());  // of an image's group
  std::iota(first.begin(), first.end(), 0);
  const auto root = [&](int image) {
    while (first[static_cast<size_t>(image)] != image) image = first[static_cast<size_t>(image)];
    return image;
  };
  const auto centre = [&](int image) {
    return model.images[static_cast<size_t>(image)].cam_from_world.TargetOriginInSource();
  };
  for (auto& [pair, distances] : SharedDistances(model)) {
    if (distances.size() < kMinShared) continue;
    const double apart = (centre(pair.first) - centre(pair.second)).norm();
    if (!(apart < kSamePosition * UpperMedian(distances))) continue;
    const int a = root(pair.first), b = root(pair.second);
    first[static_cast<size_t>(std::max(a, b))] = std::min(a, b);
  }
  std::map<int, std::vector<int>> of_root;
  for (int i = 0; i < static_cast<int>(first.size()); ++i) of_root[root(i)].push_back(i);
  std::vector<std::vector<int>> groups;
  for (auto& [image, group] : of_root) {
    if (group.size() > 1) groups.push_back(std::move(group));
  }
  return groups;
}

std::string OnePlaceLine(const SfmModel& model) {
  const auto groups = ImagesOfOnePlace(model);
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
  return fmt::format(
      "{} photos share {} position{} (exposure brackets, bursts): {}{}; points that they alone see "
      "are left out",
      photos, groups.size(), groups.size() == 1 ? "" : "s", fmt::join(named, "; "),
      groups.size() > kGroupsNamed ? "; ..." : "");
}

}  // namespace dtr::calib
