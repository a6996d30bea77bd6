// dtr/render/texture.h -- SPEC 4.4: the colour a view shows at a point.
#pragma once
#include <Eigen/Core>
#include <optional>

#include "dtr/types/view.h"

namespace dtr {

/// Linear RGB of the view's image at image position `pixel` (pixels, centre of the first at 0.5),
/// times the view's gain: bilinear between the four nearest pixel centres, clamped at the border;
/// masked pixels have no part, and where all four are masked there is no colour.
std::optional<Eigen::Vector3d> ColourAt(const View& view, const Eigen::Vector2d& pixel);

}  // namespace dtr
