// dtr/render/texture.h -- SPEC 4.4: the colour a view shows at a point.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "dtr/types/view.h"

namespace dtr {

/// SPEC 4.8: what a view keeps of its weight at each pixel of its image, of 255. All but near the
/// photo's rim and masked pixels; never 0 but at masked pixels.
Grid<std::uint8_t> RimFactors(const View& view);

/// The same at image position `pixel`, at most 1: bilinear, clamped at the border.
double RimFactorAt(const Grid<std::uint8_t>& factors, const Eigen::Vector2d& pixel);

/// The view's image as renderers sample it, RGBA, row by row: the photo times the view's gain (in
/// linear light, cut at white, rounded to 8 bits of sRGB) with RimFactors as alpha. A masked pixel
/// has the mean of the usable ones among its 8 neighbours, black where there is none.
std::vector<std::uint8_t> SampledImage(const View& view);

/// The colour at image position `pixel` (pixels, centre of the first at 0.5): bilinear between the
/// four nearest pixel centres of SampledImage, clamped at the border, in sRGB values or, when
/// `linear_light`, in linear light, both in [0, 1]. Empty where all four are masked.
std::optional<Eigen::Vector3d> ColourAt(const View& view, const Eigen::Vector2d& pixel,
                                        bool linear_light);

}  // namespace dtr
