// pipeline/export/detail/surface_views.h -- the surfaces that views show, a bounded number of them
// in memory.
#pragma once
#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "dtr/types/dtr_set.h"

namespace dtr::pipeline {

/// Four samples whose 1/z differ by more pixels of disparity than this are not one surface.
inline constexpr double kOneSurfacePx = 2;

/// Depth of a view as inverse depth, on the grid of its depth map.
struct SurfaceView {
  int index = 0;                                           ///< of the view in frames[0].views
  const View* view = nullptr;                              ///< without pixels
  PinholeCamera camera{1, 1, 1, 1, 0, 0};                  ///< of the depth grid
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< cam_from_world
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();        ///< in the world
  Grid<float> inverse_depth;     ///< 1/z, 1 / scene units; 0: no surface, or masked
  Grid<float> sigma;             ///< standard deviation of it; 0: not known; may be empty
  Grid<std::uint8_t> completed;  ///< 1 where depth was completed; empty: nowhere
  Grid<std::uint8_t> far;        ///< 1 where a view shows the sky; empty: not known
  ImageRgb8 colours;             ///< in the set's mean exposure; empty: not asked for
  /// A difference of 1/z that is one pixel of disparity to the view's neighbours.
  double inverse_depth_per_px = 0;

  bool IsCompleted(int x, int y) const { return !completed.empty() && completed(x, y) != 0; }
  Eigen::Vector3d InCam(const Eigen::Vector3d& p_in_world) const {
    return rotation * (p_in_world - centre);
  }
  /// Point of the surface at a pixel of the depth grid.
  Eigen::Vector3d PointAt(const Eigen::Vector2d& pixel, double w) const {
    return centre + rotation.transpose() * (camera.RayFromPixel(pixel) / w);
  }
  /// 1/z at a pixel position: bilinear within one surface, else the nearest sample's; empty where
  /// that has none.
  std::optional<double> InverseDepthAt(const Eigen::Vector2d& pixel) const;
  /// Colour there, bilinear, 0...255. Requires colours.
  std::array<double, 3> ColourAt(const Eigen::Vector2d& pixel) const;
  /// Sigma of the sample that holds the pixel position; 0 where it is not known.
  double SigmaAt(const Eigen::Vector2d& pixel) const;
};

/// 1/z around a sample as a plane of the image, by least squares: w + x_slope dx + y_slope dy.
struct LocalPlane {
  double w = 0, x_slope = 0, y_slope = 0;  ///< per pixel
  double rms = 0;                          ///< of what it was fitted to, in 1/z
  int samples = 0;                         ///< 0: there were too few
};
/// From the samples within `radius` that lie on the surface of (x, y), which exists: whose 1/z
/// differs by at most a pixel of disparity per pixel of distance.
LocalPlane PlaneAt(const SurfaceView& surface, int x, int y, int radius);
inline constexpr int kNormalRadius = 2;  ///< of the plane that gives an exported point its normal

/// Unit normal in the world of a plane of 1/z at a pixel, turned to the camera.
Eigen::Vector3d NormalOf(const SurfaceView& surface, const Eigen::Vector2d& pixel,
                         const LocalPlane& plane);

/// Loads views with depth when they are asked for, and drops those not used for longest when they
/// take more than the bound; what a caller holds stays.
class SurfaceViews {
 public:
  struct Options {
    bool completed = false;  ///< with what was completed, but for what is infinitely far
    bool colours = false;
    double memory_gb = 4;
  };
  /// `set` must outlive it.
  SurfaceViews(std::filesystem::path folder, const DtrSet& set, const Options& options)
      : folder_(std::move(folder)), set_(set), options_(options) {}

  /// Requires that the view has depth. Throws Error for a damaged file.
  std::shared_ptr<const SurfaceView> Get(int view) { return GetAll({view}).front(); }
  /// The same for several, read by several threads.
  std::vector<std::shared_ptr<const SurfaceView>> GetAll(const std::vector<int>& views);
  /// Views with depth, in the set's order.
  std::vector<int> WithDepth() const;
  const DtrSet& set() const { return set_; }

 private:
  SurfaceView Load(int view) const;
  void Touch(int view);

  std::filesystem::path folder_;
  const DtrSet& set_;
  Options options_;
  std::map<int, std::shared_ptr<const SurfaceView>> held_;
  std::list<int> order_;  // most recently used first
};

}  // namespace dtr::pipeline
