// viewer/probe.h -- what is known of the point that a pixel shows.
#pragma once
#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "dtr/render/camera_path.h"
#include "dtr/render/options.h"
#include "dtr/render/scene.h"

namespace dtr::viewer {

/// Standard deviations of inverse depth of a view, on its depth grid; null where it has none.
using SigmaOf = std::function<const Grid<float>*(const View&)>;

/// What one view says of the point.
struct ProbeView {
  std::string name;
  double share = 0;      ///< of the pixel's colour
  double depth_z = 0;    ///< of its own fragment, in its own camera; scene units
  double behind_px = 0;  ///< how far its fragment lies behind the front one, px of disparity
  std::optional<double> sigma_z;  ///< standard deviation of depth_z, scene units
};

/// A point under the cursor.
struct Probe {
  Eigen::Vector3d p_in_world = Eigen::Vector3d::Zero();  ///< the set's stored world
  double depth_z = 0;                                    ///< in the novel camera, scene units
  std::optional<double> sigma_z;  ///< mean of the views' sigmas by their shares
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of p_in_world; see CovarianceOf
  bool has_covariance = false;   ///< false where no view that counts has a sigma
  std::vector<ProbeView> views;  ///< those with a share, largest first
};

/// Of the pixel (x, y) of an image that shows a surface at plane z `depth_z` > 0 there. The views
/// must be loaded.
Probe ProbePixel(const RenderScene& scene, const NovelCamera& novel, const RenderOptions& options,
                 int x, int y, double depth_z, const SigmaOf& sigma_of);

/// Standard deviation of z, scene units, of the view's depth where it sees the point; none where it
/// does not or has no sigma there.
std::optional<double> SigmaZ(const View& view, const Eigen::Vector3d& p_in_world,
                             const SigmaOf& sigma_of);

/// Covariance (world, scene units squared) of a point that a camera sees: `sigma_z` along its ray,
/// and across it what a pixel leaves open, 1/sqrt(12) pixels per axis.
Eigen::Matrix3d CovarianceOf(const Eigen::Vector3d& p_in_world, const NovelCamera& seen_by,
                             double sigma_z);

/// Distance between two points and its standard deviation by their covariances, which are taken to
/// be independent (points from the same views share errors of calibration: these are not in it).
struct Distance {
  double length = 0;
  std::optional<double> sigma;
};
Distance DistanceBetween(const Probe& a, const Probe& b);

}  // namespace dtr::viewer
