// dtr/render/hole_planes.h -- SPEC 7.3: the planes that surfaces of an image lie on.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "dtr/types/grid.h"

namespace dtr {

/// A plane as inverse depth over an image: 1/z at position (x, y) is plane . (x, y, 1).
using ImagePlane = Eigen::Vector3d;

/// The planes on which most of an image lies, largest first, at most 8: one after the other by
/// random triples of positions (RANSAC, Fischler and Bolles 1981), each fitted to what lies within
/// `tolerance` of it. `inverse_depth`: 0 where nothing is known; its cells' centres are at
/// (i + 0.5, j + 0.5). Equal inputs give equal planes.
std::vector<ImagePlane> FindPlanes(const Grid<double>& inverse_depth, double tolerance);

}  // namespace dtr
