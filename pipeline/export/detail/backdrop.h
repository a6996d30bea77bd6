// pipeline/export/detail/backdrop.h -- what stands behind all surfaces: the sky, and something in
// its colours where no view shows anything.
#pragma once
#include <Eigen/Core>
#include <array>
#include <limits>
#include <vector>

#include "pipeline/export/detail/gaussians.h"

namespace dtr::pipeline {

/// Colours on a cube around the cameras, in cells as wide as a few pixels. A cell has the mean
/// colour of the views that see no surface there but what is infinitely far. All others that views
/// could see are filled: smoothly, from the sky beside them and from the surfaces in that
/// direction, where far ones weigh more.
class Backdrop {
 public:
  /// `set` must outlive it. `threads` as ParallelFor.
  Backdrop(const DtrSet& set);

  /// `surface` with its colours. Views in the set's order, once each.
  void AddView(const SurfaceView& surface);

  /// Whether a point lies so far that it is behind: it counts as sky.
  bool Hides(const Eigen::Vector3d& p_in_world) const {
    return !((p_in_world - centre_).norm() < kNearer * radius_);
  }

  /// One Gaussian for each cell, or square of cells of nearly one colour, that some view could see
  /// behind what it does see. Empty where no view was added. With `max_count` the colours of a
  /// square may differ by more until there are no more than that, or all squares are as large as
  /// they can be.
  std::vector<Gaussian> Gaussians(size_t max_count = std::numeric_limits<size_t>::max()) const;

 private:
  static constexpr double kNearer = 0.9;  // share of the distance at which surfaces end
  struct Sum {
    float weight = 0;
    std::array<float, 3> rgb{};
    void Add(const Sum& other, float factor);
  };
  struct Place {
    int face = 0;
    double x = 0, y = 0;
  };
  Place PlaceOf(const Eigen::Vector3d& direction) const;
  Eigen::Vector3d DirectionOf(int face, double x, double y) const;
  void AddSky(const SurfaceView& surface);
  void AddSurface(const SurfaceView& surface);
  std::vector<Sum> Filled() const;
  std::vector<Gaussian> GaussiansOf(const std::vector<Sum>& cells, float one_colour) const;
  bool CouldBeSeen(const Eigen::Vector3d& p_in_world) const;
  size_t At(int face, int x, int y) const {
    return (static_cast<size_t>(face) * static_cast<size_t>(side_) + static_cast<size_t>(y)) *
               static_cast<size_t>(side_) +
           static_cast<size_t>(x);
  }

  const DtrSet& set_;
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
  double radius_ = 0;
  int side_ = 1;                    // cells along an edge of the cube, a power of two
  std::vector<Sum> sky_, surface_;  // six faces, row by row
};

}  // namespace dtr::pipeline
