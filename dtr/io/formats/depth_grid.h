// dtr/io/formats/depth_grid.h -- depth maps of other programs on the grids that a set can hold.
#pragma once
#include <Eigen/Core>
#include <functional>
#include <optional>

#include "dtr/types/depth_image.h"

namespace dtr::io {

/// The s of the grid, 1/s of the photo per axis, that a set stores a map of this size on: the ratio
/// itself where it is a whole number of both sides, else the largest s that divides both sides of
/// the photo and gives the map no fewer pixels (1 where the map is larger than the photo). Empty
/// where the map has another shape than the photo, by a pixel of the map or more, so that both
/// cannot cover the same field of view.
std::optional<int> DepthScaleFor(int map_width, int map_height, int width_px, int height_px);

/// Where pixel coordinates of the new grid lie in the old one (pixel centres at + 0.5); empty: no
/// depth there.
using SourceOfPixel = std::function<std::optional<Eigen::Vector2d>(const Eigen::Vector2d&)>;

/// A plane-z map on another grid. Every depth is that of the surface that the nearest pixel shows:
/// inverse depth, which is linear over a plane's image, is interpolated to neighbours of the same
/// surface alone, never across a depth edge or a hole. Throws std::invalid_argument for ray
/// distances.
DepthImage Resampled(const DepthImage& depth_z, int width_px, int height_px,
                     const SourceOfPixel& source_of);

}  // namespace dtr::io
