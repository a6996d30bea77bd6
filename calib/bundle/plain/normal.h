// calib/bundle/plain/normal.h -- internal to calib/bundle/plain: normal equations without the
// points.
#pragma once
#include <Eigen/Core>
#include <vector>

#include "calib/bundle/plain/layout.h"
#include "calib/bundle/plain/problem.h"

namespace dtr::calib::plain {

/// What elimination leaves of a point: its 3 x 3 part of the damped normal equations is L L^T.
struct EliminatedPoint {
  double inverse_pivots[3], l10, l20, l21;  ///< of L
  double white[3];                          ///< L^-1 gradient
  double gradient[3], damping[3];
};

/// Gauss-Newton's normal equations H x = -g of a Problem at some unknowns, damped by lambda times
/// their diagonal (Levenberg 1944, Marquardt 1963), the points eliminated (Schur complement; Triggs
/// et al. 2000, sec. 6.1). With L L^T a point's block and A = (derivatives by a node)^T (by the
/// point) L^-T, the reduced matrix is H_ab - sum of A_a A_b^T. Of an iterative solution blocks()
/// has H alone.
class NormalEquations {
 public:
  NormalEquations(const Problem& problem, const Layout& layout);

  /// Works them out. The same bits for any number of threads: parts of fixed size are summed in
  /// their order.
  void Build(const Unknowns& x, double lambda);

  const std::vector<double>& blocks() const { return sum_.blocks; }  ///< Layout's, damped
  const Eigen::VectorXd& right() const { return sum_.right; }        ///< of the reduced system
  const Eigen::VectorXd& gradient() const { return sum_.gradient; }  ///< of cameras and lenses
  const Eigen::VectorXd& damping() const { return damping_; }        ///< lambda times diagonal

  /// Of an observation: A of its image, `camera_size` x 3, and, of the point's first observation
  /// through a lens, A of that lens, kMaxFree x 3, else null; both column by column.
  const double* CameraCross(size_t observation) const {
    return camera_cross_.data() + observation * 3 * static_cast<size_t>(layout_.camera_size());
  }
  const double* LensCross(size_t observation) const {
    if (!layout_.lenses_move() || !lens_first_[observation]) return nullptr;
    return lens_cross_.data() + observation * 3 * kMaxFree;
  }

  /// The points' steps that go with a step of cameras and lenses; adds to `decrease` what the model
  /// of the cost promises for them.
  void StepPoints(const Eigen::VectorXd& step, std::vector<std::array<double, 3>>& points,
                  double* decrease) const;

 private:
  struct Sums {
    std::vector<double> blocks;
    Eigen::VectorXd right, gradient, diagonal;
  };
  template <int kCamera>
  struct Row;
  template <int kCamera>
  class Part;

  template <int kCamera>
  void BuildOf(const Unknowns& x, double lambda);
  template <int kCamera>
  void StepPointsOf(const Eigen::VectorXd& step, std::vector<std::array<double, 3>>& points,
                    double* decrease) const;
  void AddPriors(const Unknowns& x);
  void Damp(double lambda);

  const Problem& problem_;
  const Layout& layout_;
  Sums sum_;
  std::vector<Sums> parts_;
  Eigen::VectorXd damping_;
  std::vector<EliminatedPoint> points_;
  std::vector<double> camera_cross_;  ///< per observation: A, 3 columns of camera_size
  std::vector<double> lens_cross_;  ///< per observation: A of a lens seen here first, 3 x kMaxFree
  std::vector<unsigned char> lens_first_;
};

}  // namespace dtr::calib::plain
