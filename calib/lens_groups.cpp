#include "calib/lens_groups.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace dtr::calib {
namespace {

/// Farther apart lie images that were cropped.
constexpr double kMaxShiftShare = 5 * kStabiliserShare;

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return 0.5 * (values[(values.size() - 1) / 2] + values[values.size() / 2]);
}

using Cameras = std::map<std::uint32_t, LensCamera>;

/// Those of `ids` that lie near the median principal point.
std::vector<std::uint32_t> NearTheMedian(const Cameras& cameras,
                                         const std::vector<std::uint32_t>& ids) {
  const LensCamera& any = cameras.at(ids.front());
  const auto centre = static_cast<size_t>(FocalCount(any.model));
  const double most = kMaxShiftShare * std::max(any.width_px, any.height_px);
  std::vector<std::uint32_t> near = ids;
  for (const size_t axis : {centre, centre + 1}) {
    std::vector<double> places;
    for (const std::uint32_t id : ids) places.push_back(cameras.at(id).params[axis]);
    const double median = Median(places);
    std::erase_if(near, [&](std::uint32_t id) {
      return std::abs(cameras.at(id).params[axis] - median) > most;
    });
  }
  return near;
}

/// One lens of the given cameras; one each where they are equal.
void AddGroups(const Cameras& cameras, const std::vector<std::uint32_t>& ids,
               std::vector<LensGroup>& groups) {
  const bool moved = std::any_of(ids.begin(), ids.end(), [&](std::uint32_t id) {
    return cameras.at(id).params != cameras.at(ids.front()).params;
  });
  if (!moved) {
    for (const std::uint32_t id : ids) groups.push_back({cameras.at(id), {id}});
    return;
  }
  LensGroup group{cameras.at(ids.front()), ids};
  const auto centre = static_cast<size_t>(FocalCount(group.lens.model));
  for (const size_t axis : {centre, centre + 1}) {
    double sum = 0;
    for (const std::uint32_t id : ids) sum += cameras.at(id).params[axis];
    group.lens.params[axis] = sum / static_cast<double>(ids.size());
  }
  groups.push_back(std::move(group));
}

}  // namespace

bool SameButForPrincipalPoint(const LensCamera& a, const LensCamera& b) {
  if (a.model != b.model || a.width_px != b.width_px || a.height_px != b.height_px) return false;
  const auto centre = static_cast<size_t>(FocalCount(a.model));
  for (size_t i = 0; i < a.params.size(); ++i) {
    if (i != centre && i != centre + 1 && a.params[i] != b.params[i]) return false;
  }
  return true;
}

std::vector<LensGroup> LensGroups(const std::map<std::uint32_t, LensCamera>& cameras) {
  std::vector<std::vector<std::uint32_t>> alike;
  for (const auto& entry : cameras) {
    const LensCamera& camera = entry.second;  // a structured binding cannot be captured by Clang 14
    const auto found = std::find_if(alike.begin(), alike.end(), [&](const auto& ids) {
      return SameButForPrincipalPoint(cameras.at(ids.front()), camera);
    });
    if (found != alike.end()) {
      found->push_back(entry.first);
    } else {
      alike.push_back({entry.first});
    }
  }
  std::vector<LensGroup> groups;
  for (const auto& ids : alike) {
    const std::vector<std::uint32_t> near = NearTheMedian(cameras, ids);
    if (!near.empty()) AddGroups(cameras, near, groups);
    for (const std::uint32_t id : ids) {
      if (std::binary_search(near.begin(), near.end(), id)) continue;
      groups.push_back({cameras.at(id), {id}});
    }
  }
  std::sort(groups.begin(), groups.end(), [](const LensGroup& a, const LensGroup& b) {
    return a.cameras.front() < b.cameras.front();
  });
  return groups;
}

}  // namespace dtr::calib
