// stereo/depth_prior.h -- depth of a view that another instrument measured: a start and a hint.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "dtr/types/depth_image.h"
#include "dtr/types/grid.h"

namespace dtr::stereo {

/// Standard deviation of z divided by z, by distance: linear between the distances given, constant
/// beyond them. Both lists have one length, `z` rises, nothing is empty.
struct RelativeNoise {
  std::vector<double> z, sigma;
  double At(double z) const;
};

/// What a view is expected to look like, and how well that is known.
struct DepthPrior {
  /// Plane z in scene units over the whole field of view of the view, on any grid; holes where
  /// nothing was measured. Called from the threads that call the engine.
  std::function<DepthImage()> load;
  RelativeNoise noise;
};

/// Planes of a depth map on its own grid: inverse depths of a low resolution and with noise become
/// a surface that can be continued to finer pixels. At each pixel a plane is fitted by least
/// squares to those of its 5x5 neighbourhood that belong to the same surface: whose inverse depths
/// differ from its own, continued by its slope, by less than the map's noise explains, which second
/// differences along rows estimate (Immerkaer, CVIU 64, 1996, in one dimension, with a median).
class PriorPlanes {
 public:
  /// `depth`: plane z. Throws std::invalid_argument for ray distances.
  explicit PriorPlanes(const DepthImage& depth);

  struct Plane {
    double inverse_depth = 0;
    /// Change of the inverse depth over the whole width and height of the image.
    double slope_x = 0, slope_y = 0;
    bool at_edge = false;  ///< a depth edge or a hole is a pixel away: what lies there is unsure
  };
  /// The plane at a position of the image, in shares of its width and height; empty at holes and
  /// outside.
  std::optional<Plane> At(const Eigen::Vector2d& share) const;

  /// Relative difference of inverse depths from which on two pixels are not one surface.
  double edge_ratio() const { return edge_ratio_; }

 private:
  void Fit(const Grid<float>& inverse, int x, int y);
  bool IsHole(int x, int y) const { return !(inverse_depth_(x, y) > 0); }

  double edge_ratio_ = 0;
  Grid<float> inverse_depth_, slope_x_, slope_y_;  ///< slopes per pixel of the map
  Grid<std::uint8_t> at_edge_;
};

}  // namespace dtr::stereo
