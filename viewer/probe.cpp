#include "viewer/probe.h"

#include <algorithm>
#include <cmath>

#include "dtr/cpu/contributions.h"
#include "viewer/navigation.h"

namespace dtr::viewer {
namespace {

constexpr double kPixelVariance = 1.0 / 12;  // of a position anywhere in a pixel

/// The camera of a single pixel of an image.
PinholeCamera PixelCamera(const PinholeCamera& camera, int x, int y) {
  return {1, 1, camera.fx_px(), camera.fy_px(), camera.cx_px() - x, camera.cy_px() - y};
}

}  // namespace

std::optional<double> SigmaZ(const View& view, const Eigen::Vector3d& p_in_world,
                             const SigmaOf& sigma_of) {
  const Grid<float>* sigma = sigma_of(view);
  if (sigma == nullptr || sigma->empty()) return std::nullopt;
  const Eigen::Vector3d p_in_cam = view.cam_from_world * p_in_world;
  const auto pixel = view.DepthCamera().PixelFromCam(p_in_cam);
  if (!pixel) return std::nullopt;
  const int x = static_cast<int>(std::floor(pixel->x())),
            y = static_cast<int>(std::floor(pixel->y()));
  if (!sigma->Contains(x, y)) return std::nullopt;
  const double of_inverse_depth = (*sigma)(x, y);
  if (!(of_inverse_depth > 0) || !std::isfinite(of_inverse_depth)) return std::nullopt;
  return of_inverse_depth * p_in_cam.z() * p_in_cam.z();
}

Eigen::Matrix3d CovarianceOf(const Eigen::Vector3d& p_in_world, const NovelCamera& seen_by,
                             double sigma_z) {
  const Eigen::Vector3d p = seen_by.cam_from_world * p_in_world;
  // p = z (ray_x, ray_y, 1): its derivatives by z and by the two pixel coordinates.
  Eigen::Matrix3d by;
  by.col(0) = p / p.z();
  by.col(1) = Eigen::Vector3d(p.z() / seen_by.camera.fx_px(), 0, 0);
  by.col(2) = Eigen::Vector3d(0, p.z() / seen_by.camera.fy_px(), 0);
  const Eigen::Vector3d variances(sigma_z * sigma_z, kPixelVariance, kPixelVariance);
  const Eigen::Matrix3d world_from_cam =
      seen_by.cam_from_world.rotation.conjugate().toRotationMatrix();
  const Eigen::Matrix3d factor = world_from_cam * by;
  return factor * variances.asDiagonal() * factor.transpose();
}

Probe ProbePixel(const RenderScene& scene, const NovelCamera& novel, const RenderOptions& options,
                 int x, int y, double depth_z, const SigmaOf& sigma_of) {
  Probe probe;
  probe.depth_z = depth_z;
  probe.p_in_world = WorldPoint(novel, {x + 0.5, y + 0.5}, depth_z);
  DepthImage depth(1, 1);
  depth(0, 0) = static_cast<float>(depth_z);
  const PinholeCamera camera = PixelCamera(novel.camera, x, y);
  const cpu::Contributions found =
      cpu::ContributionsTo(depth, scene, camera, novel.cam_from_world, options);
  double with_sigma = 0, sigma_sum = 0;
  for (size_t i = 0; i < found.views.size(); ++i) {
    const double share = found.shares[i](0, 0), inverse_depth = found.inverse_depth[i](0, 0);
    if (!(share > 0) || !(inverse_depth > 0)) continue;
    const View& view = *scene.views[static_cast<size_t>(found.views[i])];
    const Eigen::Vector3d own_point = WorldPoint(novel, {x + 0.5, y + 0.5}, 1 / inverse_depth);
    ProbeView said;
    said.name = view.name;
    said.share = share;
    said.depth_z = (view.cam_from_world * own_point).z();
    said.behind_px = (1 / depth_z - inverse_depth) / ThresholdsOf(view, options).pixel;
    said.sigma_z = SigmaZ(view, own_point, sigma_of);
    if (said.sigma_z) {
      with_sigma += share;
      sigma_sum += share * *said.sigma_z;
      probe.covariance +=
          share * CovarianceOf(own_point, {view.camera, view.cam_from_world}, *said.sigma_z);
    }
    probe.views.push_back(std::move(said));
  }
  std::stable_sort(probe.views.begin(), probe.views.end(),
                   [](const ProbeView& a, const ProbeView& b) { return a.share > b.share; });
  if (with_sigma > 0) {
    probe.sigma_z = sigma_sum / with_sigma;
    probe.covariance /= with_sigma;
    probe.has_covariance = true;
  }
  return probe;
}

Distance DistanceBetween(const Probe& a, const Probe& b) {
  const Eigen::Vector3d way = b.p_in_world - a.p_in_world;
  Distance distance{way.norm(), std::nullopt};
  if (!a.has_covariance || !b.has_covariance) return distance;
  const Eigen::Matrix3d both = a.covariance + b.covariance;
  if (distance.length > 0) {
    const Eigen::Vector3d u = way / distance.length;
    distance.sigma = std::sqrt(u.dot(both * u));
  } else {
    distance.sigma = std::sqrt(both.trace());
  }
  return distance;
}

}  // namespace dtr::viewer
