// dtr/render/texture.h -- SPEC 4.4: the colour a view shows at a point.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "dtr/types/view.h"

namespace dtr {

/// The view's image as renderers sample it, RGBA, row by row: the photo times the view's gain (in
/// linear light, cut at white, rounded to 8 bits of sRGB) with alpha 255. A masked pixel has alpha
/// 0 and the mean of the usable ones among its 8 neighbours, black where there is none.
std::vector<std::uint8_t> SampledImage(const View& view);

/// The colour at image position `pixel` (pixels, centre of the first at 0.5): bilinear between the
/// four nearest pixel centres of SampledImage, clamped at the border, in sRGB values or, when
/// `linear_light`, in linear light, both in [0, 1]. Empty where all four are masked.
std::optional<Eigen::Vector3d> ColourAt(const View& view, const Eigen::Vector2d& pixel,
                                        bool linear_light);

}  // namespace dtr
