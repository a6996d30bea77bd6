// calib/sfm_model.h -- a structure-from-motion model as values.
#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "calib/lens_camera.h"
#include "dtr/types/pose.h"

namespace dtr::calib {

/// A feature of an image; `point_id` is a key of SfmModel::points, or kNoPoint.
struct SfmFeature {
  static constexpr std::uint64_t kNoPoint = ~std::uint64_t{0};
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  ///< on the distorted image
  std::uint64_t point_id = kNoPoint;
};

/// A registered image.
struct SfmImage {
  std::uint32_t id = 0;
  std::string name;
  std::uint32_t camera_id = 0;
  Pose cam_from_world;
  std::vector<SfmFeature> features;
};

/// A triangulated point. Its track is implied by the images' features.
struct SfmPoint {
  Eigen::Vector3d p_in_world = Eigen::Vector3d::Zero();
  std::array<std::uint8_t, 3> rgb{};
  double error_px = 0;  ///< mean reprojection error as the solver reported it
};

/// Cameras, images and points in one arbitrary gauge. Images are sorted by name.
struct SfmModel {
  std::map<std::uint32_t, LensCamera> cameras;
  std::vector<SfmImage> images;
  std::map<std::uint64_t, SfmPoint> points;
};

/// Of the model's images, in their order.
inline std::vector<std::string> ImageNames(const SfmModel& model) {
  std::vector<std::string> names;
  for (const SfmImage& image : model.images) names.push_back(image.name);
  return names;
}

/// True where an image has this camera.
inline bool HasImages(const SfmModel& model, std::uint32_t camera_id) {
  return std::any_of(model.images.begin(), model.images.end(),
                     [&](const SfmImage& image) { return image.camera_id == camera_id; });
}

}  // namespace dtr::calib
