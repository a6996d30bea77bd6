// calib/bundle/plain/problem.h -- internal to calib/bundle: the plain problem of bundle adjustment
// in the solver's coordinates (observation_cost.h), its unknowns and its cost.
#pragma once
#include <Eigen/Core>
#include <array>
#include <vector>

#include "calib/bundle/normalised.h"
#include "calib/bundle/plain/projection.h"

namespace dtr::calib::plain {

/// What is known of one number of a lens: weight * (value - known) is a residual in px. The value
/// is a parameter, or, of an aspect, log(fy / fx), where `params` is 0 and 1.
struct LensPrior {
  size_t lens = 0;
  bool aspect = false;
  int param = 0;
  double known = 0, weight = 0;
};

/// What moves, and what it is fitted to.
struct Settings {
  std::vector<std::vector<int>> free_params;  ///< per lens, rising indices into its parameters
  bool free_poses = true;
  std::vector<bool> fixed_images;  ///< poses that stay though others are free; empty: none
  std::vector<LensPrior> lens_priors;
  /// Per image, where n.shift is not empty: weight (of one px) that draws its shift to 0.
  std::vector<double> shift_weights;
  double cauchy_px = 0;  ///< scale of Cauchy's loss; 0: least squares
};

/// The unknowns, as Normalised names them.
struct Unknowns {
  std::vector<std::array<double, kMaxParams>> theta;
  std::vector<std::array<double, 6>> motion;
  std::vector<std::array<double, 3>> place;
  std::vector<std::array<double, 2>> shift;
};

/// An image at given unknowns.
struct Camera {
  Eigen::Matrix<double, 3, 3, Eigen::RowMajor> rotation;
  Eigen::Vector3d centre;
  Eigen::Vector2d shift_px = Eigen::Vector2d::Zero();  ///< of the unknown, beyond the start's
  size_t lens = 0;
};

/// An observation that counts; `pixel` less the image's shift at the start.
struct Seen {
  int image = 0;
  Eigen::Vector2d pixel;
};

/// Cauchy's loss, or none. All on squared lengths in px^2.
struct Loss {
  double scale2 = 0;
  double Of(double squared) const;
  /// The loss's slope by the squared length: the weight of iteratively reweighted least squares,
  /// whose model of the cost lies above it everywhere (Triggs et al. 2000, sec. 4.3).
  double Slope(double squared) const { return scale2 > 0 ? scale2 / (scale2 + squared) : 1; }
  /// The curvature along the residual over that across it; far residuals have a negative one, which
  /// is kept above a tenth.
  double Bend(double squared) const;
};

/// The observations that count, by points; frames are borrowed from `n`.
class Problem {
 public:
  Problem(const Bundle& bundle, const Normalised& n, const std::vector<bool>& used,
          const Settings& settings);

  const Normalised& n() const { return n_; }
  const Settings& settings() const { return settings_; }
  const Loss& loss() const { return loss_; }
  size_t images() const { return n_.poses.size(); }
  size_t points() const { return first_.size() - 1; }
  /// Observations of point p: seen()[first(p)] to seen()[first(p + 1) - 1], images rising.
  size_t first(size_t point) const { return first_[point]; }
  const std::vector<Seen>& seen() const { return seen_; }
  double largest_px() const { return largest_px_; }
  double ShiftScale(size_t image) const { return shift_scale_[image]; }
  Eigen::Vector2d ShiftAtStart(size_t image) const { return shift_at_start_[image]; }
  bool PoseMoves(size_t image) const {
    return settings_.free_poses &&
           (settings_.fixed_images.empty() || !settings_.fixed_images[image]);
  }
  size_t LensOf(size_t image) const { return lens_of_image_[image]; }

  std::vector<Camera> CamerasAt(const Unknowns& x) const;
  std::vector<Intrinsics> IntrinsicsAt(const Unknowns& x) const;
  /// Half the sum of losses and squared priors; infinite where an observation has no pixel. Chunks
  /// of fixed size are summed in their order, for any number of threads.
  double CostAt(const Unknowns& x) const;
  /// Of one point; infinite likewise.
  double PointCost(size_t point, const std::array<double, 3>& place,
                   const std::vector<Camera>& cameras, const std::vector<Intrinsics>& lenses) const;
  /// A lens prior's residual and its derivatives by theta.
  double PriorAt(const LensPrior& prior, const Unknowns& x, double by_theta[kMaxParams]) const;

 private:
  const Normalised& n_;
  Settings settings_;
  Loss loss_;
  std::vector<size_t> first_;
  std::vector<Seen> seen_;
  std::vector<double> shift_scale_;
  std::vector<Eigen::Vector2d> shift_at_start_;
  std::vector<size_t> lens_of_image_;
  double largest_px_ = 0;
};

/// Points that one item of a parallel loop takes.
inline constexpr size_t kChunkPoints = 256;

/// Ray to a point (homogeneous, up to a factor) from a camera: direction + rho (anchor - centre).
struct PointAt {
  Eigen::Vector3d direction;
  double rho;
  PointAt(const PointFrame& frame, const std::array<double, 3>& place)
      : direction(frame.direction + place[0] * frame.e1 + place[1] * frame.e2),
        rho(frame.rho + place[2]) {}
};

}  // namespace dtr::calib::plain
