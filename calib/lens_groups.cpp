#include "calib/lens_groups.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace dtr::calib {
namespace {

/// Stabilisers move by some 1 % of the image's size. Farther apart lie pictures that were cropped.
constexpr double kMostShiftShare = 0.05;

bool SameButForPrincipalPoint(const LensCamera& a, const LensCamera& b) {
  if (a.model != b.model || a.width_px != b.width_px || a.height_px != b.height_px) return false;
  const auto centre = static_cast<size_t>(FocalCount(a.model));
  for (size_t i = 0; i < a.params.size(); ++i) {
    if (i != centre && i != centre + 1 && a.params[i] != b.params[i]) return false;
  }
  return true;
}

/// The group's lens with the mean principal point; false where the cameras are no such group.
bool TakeMeanPrincipalPoint(const std::map<std::uint32_t, LensCamera>& cameras, LensGroup& group) {
  const auto centre = static_cast<size_t>(FocalCount(group.lens.model));
  const double most = kMostShiftShare * std::max(group.lens.width_px, group.lens.height_px);
  bool moved = false;
  for (const size_t axis : {centre, centre + 1}) {
    double sum = 0;
    for (const std::uint32_t id : group.cameras) sum += cameras.at(id).params[axis];
    const double mean = sum / static_cast<double>(group.cameras.size());
    for (const std::uint32_t id : group.cameras) {
      const double shift = std::abs(cameras.at(id).params[axis] - mean);
      if (shift > most) return false;
      moved |= cameras.at(id).params[axis] != group.lens.params[axis];
    }
    group.lens.params[axis] = mean;
  }
  return moved;
}

}  // namespace

std::vector<LensGroup> LensGroups(const std::map<std::uint32_t, LensCamera>& cameras) {
  std::vector<LensGroup> alike, groups;
  for (const auto& [id, camera] : cameras) {
    const auto found = std::find_if(alike.begin(), alike.end(), [&](const LensGroup& group) {
      return SameButForPrincipalPoint(group.lens, camera);
    });
    if (found != alike.end()) {
      found->cameras.push_back(id);
    } else {
      alike.push_back({camera, {id}});
    }
  }
  for (LensGroup& group : alike) {
    LensGroup shared = group;
    if (TakeMeanPrincipalPoint(cameras, shared)) {
      groups.push_back(std::move(shared));
    } else {
      for (const std::uint32_t id : group.cameras) groups.push_back({cameras.at(id), {id}});
    }
  }
  std::sort(groups.begin(), groups.end(), [](const LensGroup& a, const LensGroup& b) {
    return a.cameras.front() < b.cameras.front();
  });
  return groups;
}

}  // namespace dtr::calib
