// calib/lens_groups.h -- which cameras of a model are one lens.
#pragma once
#include <cstdint>
#include <map>
#include <vector>

#include "calib/lens_camera.h"

namespace dtr::calib {

/// How far image stabilisers move the principal point, of the image's long side: about a degree.
inline constexpr double kStabiliserShare = 0.01;

/// Cameras of one lens, with what they have in common.
struct LensGroup {
  LensCamera lens;  ///< the cameras', with the mean of their principal points
  std::vector<std::uint32_t> cameras;
};

/// Whether all but the principal points is equal, to the bit.
bool SameButForPrincipalPoint(const LensCamera& a, const LensCamera& b);

/// Cameras that differ by their principal points alone, by at most five times kStabiliserShare of
/// the image's long side from the median, are one lens whose image stabiliser moved between the
/// photos. Others, equal ones too, are groups of one. Each camera is in one group; groups are in
/// the order of their first cameras.
std::vector<LensGroup> LensGroups(const std::map<std::uint32_t, LensCamera>& cameras);

}  // namespace dtr::calib
