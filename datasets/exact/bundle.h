// datasets/exact/bundle.h -- bundles whose truth is known.
#pragma once
#include <Eigen/Geometry>
#include <cmath>
#include <functional>

#include "calib/bundle/adjust.h"
#include "calib/similarity.h"
#include "dtr/base/random.h"

namespace dtr::testing::bundle {

/// What is seen, from where.
struct SceneSpec {
  int images = 8, points = 200;
  calib::LensCamera lens{calib::CameraModel::kRadial, 1000, 800, {900, 504, 397, -0.05, 0.01}};
  double noise_px = 0;
  std::uint64_t seed = 1;
  /// Camera `i` of `n`, and a point of the scene; the default is an arc around a box of side 2.
  std::function<Pose(int, int)> pose = {};
  std::function<Eigen::Vector3d(Random&)> point = {};
  int max_observations = 1000;  ///< of a point
};

/// A camera at `centre` that looks at `target`, its y axis down (world z is up: not as in
/// analytic_scene.h, whence the namespace of its own).
inline Pose LookAt(const Eigen::Vector3d& centre, const Eigen::Vector3d& target) {
  const Eigen::Vector3d z = (target - centre).normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d rotation;
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  Pose pose;
  pose.rotation = Eigen::Quaterniond(rotation);
  pose.translation = -(pose.rotation * centre);
  return pose;
}

inline Pose ArcPose(int i, int n) {
  const double angle = -0.7 + 1.4 * i / (n - 1);
  return LookAt({6 * std::sin(angle), -6 * std::cos(angle), 1.0 + 0.8 * (i % 3)},
                Eigen::Vector3d::Zero());
}

inline Eigen::Vector3d BoxPoint(Random& random) {
  const double x = random.Uniform(-2, 2), y = random.Uniform(-2, 2);
  return {x, y, random.Uniform(-1.5, 1.5)};
}

/// The true bundle with noisy observations.
inline calib::Bundle MakeBundle(const SceneSpec& spec) {
  Random random(spec.seed);
  calib::Bundle bundle;
  bundle.lenses = {spec.lens};
  for (int i = 0; i < spec.images; ++i) {
    bundle.images.push_back({"image" + std::to_string(100 + i), 0,
                             spec.pose ? spec.pose(i, spec.images) : ArcPose(i, spec.images)});
  }
  for (int p = 0; p < spec.points; ++p) {
    const Eigen::Vector3d point = spec.point ? spec.point(random) : BoxPoint(random);
    std::vector<calib::BundleObservation> observations;
    const int first = random.Index(spec.images);
    for (int k = 0; k < spec.images; ++k) {
      const int i = (first + k) % spec.images;
      const auto pixel =
          spec.lens.PixelFromCam(bundle.images[static_cast<size_t>(i)].cam_from_world * point);
      const Eigen::Vector2d noise(random.Normal(), random.Normal());
      if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() > spec.lens.width_px ||
          pixel->y() > spec.lens.height_px ||
          static_cast<int>(observations.size()) >= spec.max_observations) {
        continue;
      }
      observations.push_back(
          {i, static_cast<int>(bundle.points.size()), *pixel + spec.noise_px * noise});
    }
    if (observations.size() < 2) continue;
    std::sort(observations.begin(), observations.end(),
              [](const auto& a, const auto& b) { return a.image < b.image; });
    bundle.point_ids.push_back(bundle.points.size() + 1);
    bundle.points.push_back(point.homogeneous());
    bundle.observations.insert(bundle.observations.end(), observations.begin(), observations.end());
  }
  return bundle;
}

/// The bundle with poses, points and lens off by `share` of what they are.
inline calib::Bundle Perturbed(calib::Bundle bundle, double share, std::uint64_t seed = 7) {
  Random random(seed);
  const auto noise = [&] {
    const double x = random.Normal(), y = random.Normal();
    return Eigen::Vector3d(x, y, random.Normal());
  };
  for (calib::BundleImage& image : bundle.images) {
    const Eigen::Vector3d turn = 0.1 * share * noise();
    const Eigen::Quaterniond q(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
    image.cam_from_world.rotation = (q * image.cam_from_world.rotation).normalized();
    image.cam_from_world.translation += share * noise();
  }
  for (Eigen::Vector4d& point : bundle.points) point.head<3>() += share * noise();
  for (calib::LensCamera& lens : bundle.lenses) lens.params[0] *= 1 + share;
  return bundle;
}

/// The bundle in another world.
inline calib::Bundle Moved(calib::Bundle bundle, const calib::Similarity& b_from_a) {
  for (calib::BundleImage& image : bundle.images) {
    image.cam_from_world = b_from_a.CamFromB(image.cam_from_world);
  }
  for (Eigen::Vector4d& point : bundle.points) {
    if (point[3] > 0) point.head<3>() = b_from_a * Eigen::Vector3d(point.head<3>() / point[3]);
  }
  return bundle;
}

/// Predicted pixels of all observations.
inline std::vector<Eigen::Vector2d> Projections(const calib::Bundle& bundle) {
  auto residuals = calib::Residuals(bundle);
  for (size_t i = 0; i < residuals.size(); ++i) residuals[i] += bundle.observations[i].pixel;
  return residuals;
}

/// Largest distance between two lists of pixels; infinity where one is not a number.
inline double LargestDifference(const std::vector<Eigen::Vector2d>& a,
                                const std::vector<Eigen::Vector2d>& b) {
  double largest = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    const double d = (a[i] - b[i]).norm();
    largest = d <= largest ? largest : std::isfinite(d) ? d : 1e300;
  }
  return largest;
}

}  // namespace dtr::testing::bundle
