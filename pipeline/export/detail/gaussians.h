// pipeline/export/detail/gaussians.h -- the fused samples of a view as 3D Gaussians.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "pipeline/export/detail/fuse.h"

namespace dtr::pipeline {

/// One Gaussian of a splat file.
struct Gaussian {
  Eigen::Vector3f position;            ///< in the stored world
  Eigen::Vector3f deviation;           ///< standard deviations along its axes, scene units
  Eigen::Quaternionf world_from_axes;  ///< unit length
  std::array<float, 3> rgb{};          ///< sRGB, 0...1
  float opacity = 1;
};

/// The samples of a view in squares of 1, 2, 4, ... pixels, each of which may become one Gaussian.
class SplatTree {
 public:
  /// `surface` with its colours.
  SplatTree(const SurfaceView& surface, const std::vector<FusedSample>& samples);

  /// A square that becomes one Gaussian.
  struct Square {
    /// What is lost by that: 1 is about what the eye begins to see, and below what a square with
    /// pixels that have no sample costs; infinite where it has none at all.
    float cost = 0;
    int fewer = 0;  ///< Gaussians than its four quarters have, each as one
  };

  size_t samples() const { return samples_.size(); }
  /// Every square that saves Gaussians. None costs less than one within it.
  std::vector<Square> Merges() const;
  /// One Gaussian for each of the largest squares that cost at most `bound`.
  void AddGaussians(float bound, std::vector<Gaussian>& gaussians) const;

 private:
  struct Sample {
    Eigen::Vector3f p, normal;
    float sigma = 0;
    std::array<std::uint8_t, 3> rgb{};
    std::uint8_t views = 1;
  };
  struct Level {
    int columns = 0, rows = 0;
    std::vector<Square> squares;
    const Square& At(int x, int y) const {
      return squares[static_cast<size_t>(y) * static_cast<size_t>(columns) +
                     static_cast<size_t>(x)];
    }
  };
  Square SquareOf(const SurfaceView& surface, int x, int y, int side) const;
  double CostOf(const SurfaceView& surface, int x, int y, int side) const;
  bool Merged(size_t level, int x, int y, float bound) const;
  Gaussian GaussianOf(int x, int y, int side) const;
  bool IsFirst(int x, int y, int left, int top, int side) const;
  bool Has(int x, int y) const { return index_(x, y) >= 0; }
  const Sample& At(int x, int y) const { return samples_[static_cast<size_t>(index_(x, y))]; }

  PinholeCamera camera_;
  Eigen::Matrix3d rotation_;
  Eigen::Vector3d centre_;
  Grid<std::int32_t> index_;  // into samples_; -1: none
  std::vector<Sample> samples_;
  std::vector<Level> levels_;  // of 2, 4, ... pixels
};

}  // namespace dtr::pipeline
