// dtr/advise/places.h -- from where people will look at a scene.
#pragma once
#include <span>
#include <vector>

#include "dtr/advise/advise.h"

namespace dtr::advise {

/// So many views, the nearest, are asked what they know of a point: the others hardly know more.
inline constexpr size_t kViewsAsked = 16;

/// The `count` views nearest to a place whose axes turn less than 60 degrees from its own, nearest
/// first; of equally near ones the first.
std::vector<size_t> NearestViews(std::span<const CoarseView> views, const Pose& cam_from_world,
                                 size_t count);

/// Half-way between each view and its 3 nearest, each pair once, and half a step from each view
/// away from its nearest. `names`: what each view is called in Place::where.
std::vector<Place> PlacesAmong(std::span<const CoarseView> views,
                               const std::vector<std::string>& names);

}  // namespace dtr::advise
