// stereo/normals.h -- which way surfaces face.
#pragma once
#include "dtr/types/camera.h"
#include "dtr/types/depth_image.h"
#include "stereo/plane_map.h"

namespace dtr::stereo {

/// Unit normals of the surfaces a view sees, shape (height, width, 3), in its camera's frame (x
/// right, y down, z forward), turned to the camera. From the slopes of the planes the depth was
/// found with; (0, 0, 0) where there is no depth, or one that lies off its plane by more than 2 %:
/// what surroundings completed says nothing about its own slope. `planes`, `depth` (plane z) and
/// `camera` have one size; empty planes give no normals. Throws std::invalid_argument when sizes
/// differ.
Grid<float> NormalsOf(const PlaneMap& planes, const DepthImage& depth, const PinholeCamera& camera);

}  // namespace dtr::stereo
