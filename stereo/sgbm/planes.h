// stereo/sgbm/planes.h -- the large slanted planes of a scene, found in a coarse depth map.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "dtr/types/depth_image.h"

namespace dtr::stereo {

struct PlaneOptions {
  int max_planes = 3;
  double min_share = 0.04;  ///< a plane must hold this share of the pixels with depth
  std::uint64_t seed = 0;
};

/// Planes n . p = 1 (p in the camera frame), the largest first, by repeated RANSAC on 1/z = n . ray
/// (linear in the pixel) with a least-squares fit to the inliers (Fischler and Bolles, CACM 1981).
/// A pixel is on a plane when its 1/z is within `steps.dot(ray)` of it: one pixel of disparity.
std::vector<Eigen::Vector3d> DominantPlanes(const DepthImage& depth, const PinholeCamera& camera,
                                            const Eigen::Vector3d& steps,
                                            const PlaneOptions& options);

}  // namespace dtr::stereo
