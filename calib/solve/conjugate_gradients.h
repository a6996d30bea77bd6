// calib/solve/conjugate_gradients.h -- linear systems too large to factorise.
#pragma once
#include <Eigen/Core>
#include <optional>

namespace dtr::calib {

/// Ends after `max_iterations`, or where iteration k lowers the quadratic model x A x / 2 - b x by
/// less than `gain` / k of what all iterations together have lowered it (Nash and Sofer 1990, sec.
/// 3): the rule of inexact Newton methods, to which a residual says little.
struct ConjugateGradientsOptions {
  double gain = 0.1;
  int max_iterations = 500;
};

/// Conjugate gradients for A x = b, A symmetric and positive definite, from x = 0 (Hestenes and
/// Stiefel 1952). `multiply(x)` returns A x, `precondition(r)` an approximation of A^-1 r that is
/// symmetric and positive definite, too. However early it ends, x is orthogonal to its residual, so
/// that x A x = b x. Empty where A turns out not to be positive definite along the first direction;
/// later, where rounding alone makes it so, the x reached by then.
template <typename Multiply, typename Precondition>
std::optional<Eigen::VectorXd> ConjugateGradients(const Eigen::VectorXd& b,
                                                  const ConjugateGradientsOptions& options,
                                                  const Multiply& multiply,
                                                  const Precondition& precondition) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(b.size()), residual = b, direction;
  double model = 0, before = 0;  // before: residual times the preconditioned residual
  for (int k = 1; k <= options.max_iterations; ++k) {
    const Eigen::VectorXd z = precondition(residual);
    const double now = residual.dot(z);
    if (now == 0) break;
    direction = k == 1 ? z : Eigen::VectorXd(z + now / before * direction);
    before = now;
    const Eigen::VectorXd product = multiply(direction);
    const double curvature = direction.dot(product);
    if (!(curvature > 0)) {
      if (k == 1) return {};
      break;
    }
    const double length = now / curvature;
    x += length * direction;
    residual -= length * product;
    const double lowered = 0.5 * length * now;
    model += lowered;
    if (k * lowered < options.gain * model) break;
  }
  return x;
}

}  // namespace dtr::calib
