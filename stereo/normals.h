// stereo/normals.h -- which way surfaces face.
#pragma once
#include "dtr/types/camera.h"
#include "dtr/types/depth_image.h"
#include "dtr/types/grid.h"
#include "stereo/plane_map.h"

namespace dtr::stereo {

/// Unit normals of the surfaces a view sees, shape (height, width, 3), in its camera's frame (x
/// right, y down, z forward), turned to the camera. From the slopes of the planes the depth was
/// found with; (0, 0, 0) where there is no depth, or one whose 1/z lies off its plane by more than
/// two of its standard deviations `sigma`: where the surroundings' plane took the place of a
/// pixel's own, the own slope says nothing. `planes`, `depth` (plane z), `sigma` (of 1/z) and
/// `camera` have one size; empty planes give no normals. Throws std::invalid_argument when sizes
/// differ.
Grid<float> NormalsOf(const PlaneMap& planes, const DepthImage& depth, const Grid<float>& sigma,
                      const PinholeCamera& camera);

}  // namespace dtr::stereo
