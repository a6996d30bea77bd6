// dtr/render/opening_view.h -- where viewers begin, and how wide their scene was photographed.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <span>

#include "dtr/types/view.h"

namespace dtr {

/// The view to begin with, an index into `views` (one at least): in the middle of the cameras and
/// towards the middle of the scene. Images from the ends of an arc show what few photos have.
/// Minimises the distance from the median camera, over the median of these distances, plus
/// the angle, rad, from the direction to the centre; the first of equal ones.
size_t OpeningView(std::span<const View* const> views, const Eigen::Vector3d& scene_center);

/// Angle, rad, that the views' cameras span at the scene centre: twice the 90th percentile of their
/// angles from the mean direction. From 80 degrees on it is pi: such cameras stand around the scene
/// (those of a ring at 45 degrees are 45 degrees from its axis). 0 without two of them.
double CameraSpan(std::span<const View* const> views, const Eigen::Vector3d& scene_center);

}  // namespace dtr
