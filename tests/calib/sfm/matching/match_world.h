// tests/calib/sfm/matching/match_world.h -- photos of points whose looks are known, for matching.
#pragma once
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "calib/sfm/matching/match_photos.h"
#include "dtr/base/random.h"
#include "tests/support/on_threads.h"

namespace dtr::sfm {

inline constexpr double kFocalPx = 900;
inline constexpr double kRad = std::numbers::pi / 180;

inline calib::LensCamera Camera(double focal_px, double k1 = 0) {
  return {calib::CameraModel::kSimpleRadial, 1000, 750, {focal_px, 500, 375, k1}};
}

// A random direction of the positive orthant, of length 512 as COLMAP's descriptors.
inline Descriptor Near(const std::array<double, 128>& mean, double noise, Random& random) {
  std::array<double, 128> values;
  double sum = 0;
  for (size_t k = 0; k < values.size(); ++k) {
    values[k] = std::max(0.0, mean[k] + noise * random.Normal());
    sum += values[k] * values[k];
  }
  Descriptor d;
  for (size_t k = 0; k < values.size(); ++k) {
    d[k] = static_cast<std::uint8_t>(std::min(255.0, std::round(512 * values[k] / std::sqrt(sum))));
  }
  return d;
}

struct World {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<double, 128>> looks;
};

inline World WorldOf(int count, std::uint64_t seed, bool plane) {
  Random random(seed);
  World world;
  for (int i = 0; i < count; ++i) {
    const double x = random.Uniform(-4, 4), y = random.Uniform(-3, 3);
    world.points.emplace_back(x, y, plane ? 8 + 0.3 * x : random.Uniform(5, 12));
    std::array<double, 128> look;
    for (double& v : look) v = std::max(0.0, random.Normal());
    world.looks.push_back(look);
  }
  return world;
}

struct Where {
  Eigen::Matrix3d r = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::Zero();
};

// A camera at `centre`, turned about y and x.
inline Where At(const Eigen::Vector3d& centre, double yaw_deg, double pitch_deg = 0) {
  Where where;
  where.r = (Eigen::AngleAxisd(pitch_deg * kRad, Eigen::Vector3d::UnitX()) *
             Eigen::AngleAxisd(yaw_deg * kRad, Eigen::Vector3d::UnitY()))
                .toRotationMatrix();
  where.t = -(where.r * centre);
  return where;
}

inline MatchPhoto Photo(const World& world, const Where& where, const calib::LensCamera& camera,
                        std::uint64_t seed) {
  constexpr double kNoisePx = 0.3, kDescriptorNoise = 0.15;
  Random random(seed);
  MatchPhoto photo{"photo", camera.width_px, camera.height_px, 0, {}};
  const auto add = [&](const Eigen::Vector2d& pixel, const Descriptor& descriptor) {
    photo.features.keypoints.push_back(
        {static_cast<float>(pixel.x()), static_cast<float>(pixel.y()), 2, 0});
    photo.features.descriptors.push_back(descriptor);
  };
  for (size_t i = 0; i < world.points.size(); ++i) {
    const auto pixel = camera.PixelFromCam(where.r * world.points[i] + where.t);
    if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() >= camera.width_px ||
        pixel->y() >= camera.height_px) {
      continue;
    }
    const Eigen::Vector2d noise(random.Normal(), random.Normal());
    add(*pixel + kNoisePx * noise, Near(world.looks[i], kDescriptorNoise, random));
    // Every fifth point's look is also somewhere else: a wrong match.
    if (i % 5 == 0) {
      photo.features.keypoints.back().x_px = static_cast<float>(random.Uniform(0, 1000));
      photo.features.keypoints.back().y_px = static_cast<float>(random.Uniform(0, 750));
    }
  }
  return photo;
}

inline MatchResult Match(const std::vector<MatchPhoto>& photos, const calib::LensCamera& camera,
                         bool known, int threads = 2) {
  MatchOptions options;
  const ThreadLimit limit(threads);
  if (known) options.lens_is_known.assign(1, true);
  return MatchPhotos(photos, std::vector{camera}, {known}, options);
}

inline const std::vector<Where>& Places() {
  static const std::vector<Where> places = {At({-1.5, 0, 0}, -12, 3), At({-0.3, 0.5, 0.4}, -2, -4),
                                            At({0.6, -0.4, -0.3}, 5, 6),
                                            At({1.6, 0.2, 0.5}, 14, -2), At({0.2, -1, 1}, 0, 9)};
  return places;
}

inline std::vector<MatchPhoto> Photos(const World& world, const calib::LensCamera& camera) {
  std::vector<MatchPhoto> photos;
  for (const Where& where : Places()) {
    photos.push_back(Photo(world, where, camera, photos.size() + 10));
  }
  return photos;
}

}  // namespace dtr::sfm
