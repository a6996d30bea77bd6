#include "calib/lens_map.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace dtr::calib {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Of the polish, on the plane of q: a ten-millionth of a pixel at f = 10000 px. Newton ends near
// 1e-16; what stays above this did not converge.
constexpr double kLargestResidual = 1e-11;
constexpr int kMaxNewtonSteps = 60;      // bisection alone would need 53 to reach the last bit
constexpr double kLargestTangent = 1e9;  // of a ray's angle; 90 degrees less 2e-4 arc seconds

using Polynomial = std::vector<double>;  // coefficients, lowest power first

double Evaluate(const Polynomial& p, double x) {
  double value = 0;
  for (size_t i = p.size(); i-- > 0;) value = value * x + p[i];
  return value;
}

Polynomial Derivative(const Polynomial& p) {
  Polynomial d;
  for (size_t i = 1; i < p.size(); ++i) d.push_back(p[i] * static_cast<double>(i));
  return d;
}

Polynomial Product(const Polynomial& a, const Polynomial& b) {
  Polynomial product(a.size() + b.size() - 1, 0.0);
  for (size_t i = 0; i < a.size(); ++i) {
    for (size_t j = 0; j < b.size(); ++j) product[i + j] += a[i] * b[j];
  }
  return product;
}

// x with p(x) = 0 in [low, high], given a change of sign there.
double Bisect(const Polynomial& p, double low, double high) {
  const bool rising = Evaluate(p, low) < 0;
  for (;;) {
    const double middle = 0.5 * (low + high);
    if (!(middle > low && middle < high)) return low;
    ((Evaluate(p, middle) < 0) == rising ? low : high) = middle;
  }
}

// Places x > 0 where p changes sign, rising. Between two neighbouring extrema a polynomial is
// monotone, so the extrema (the roots of the derivative, found the same way) bracket every root.
std::vector<double> PositiveRoots(Polynomial p) {
  while (!p.empty() && p.back() == 0) p.pop_back();
  if (p.size() < 2) return {};
  double largest = 0;
  for (size_t i = 0; i + 1 < p.size(); ++i) largest = std::max(largest, std::abs(p[i] / p.back()));
  std::vector<double> corners{0.0};
  for (const double x : PositiveRoots(Derivative(p))) corners.push_back(x);
  corners.push_back(std::max(1 + largest, corners.back()));  // Cauchy's bound on every root
  std::vector<double> roots;
  for (size_t i = 0; i + 1 < corners.size(); ++i) {
    const double low = Evaluate(p, corners[i]), high = Evaluate(p, corners[i + 1]);
    if ((low < 0 && high > 0) || (low > 0 && high < 0)) {
      roots.push_back(Bisect(p, corners[i], corners[i + 1]));
    } else if (high == 0 && low != 0 && corners[i + 1] > 0) {
      roots.push_back(corners[i + 1]);
    }
  }
  return roots;
}

double FirstPositiveRoot(const Polynomial& p) {
  const std::vector<double> roots = PositiveRoots(p);
  return roots.empty() ? kInfinity : roots.front();
}

}  // namespace

LensMap::LensMap(const LensCamera& camera)
    : formula_((camera.Check(), FormulaOf(camera.model, camera.params.data()))) {
  if (formula_.law == RadialLaw::kFov) formula_.law_a = std::abs(formula_.law_a);
  for (const double term :
       {formula_.p1, formula_.p2, formula_.sx, formula_.sy, formula_.sx2, formula_.sy2}) {
    decentred_ = decentred_ || term != 0;
  }
  max_radius_ = FindMaxRadius();
}

// The derivative of r N(s) / D(s) by r, s = r^2, has the sign of (N + 2 s N') D - 2 s N D' as long
// as D stays positive.
double LensMap::FindMaxRadius() const {
  const double a = formula_.law_a;
  if (formula_.law == RadialLaw::kFov) return a < std::numbers::pi ? kInfinity : 0;
  if (formula_.law == RadialLaw::kDivision) return a > 0 ? 1 / (2 * std::sqrt(a)) : kInfinity;
  if (formula_.law == RadialLaw::kEucm) return kInfinity;
  if (formula_.law == RadialLaw::kInverseRadial) {
    return a < 0 ? 2 / (3 * std::sqrt(-3 * a)) : kInfinity;
  }
  const auto& k = formula_.numerator;
  const Polynomial n{1, k[0], k[1], k[2], k[3], k[4], k[5]};
  const Polynomial d{1, formula_.denominator[0], formula_.denominator[1], formula_.denominator[2]};
  const Polynomial two_s{0, 2};
  Polynomial slope = Product(two_s, Derivative(n));
  for (size_t i = 0; i < n.size(); ++i) slope[i] += n[i];
  slope = Product(slope, d);
  const Polynomial minus = Product(two_s, Product(n, Derivative(d)));
  for (size_t i = 0; i < minus.size(); ++i) slope[i] -= minus[i];
  const double radius = std::sqrt(std::min(FirstPositiveRoot(slope), FirstPositiveRoot(d)));
  return formula_.fisheye ? std::min(radius, std::numbers::pi) : radius;
}

LensMap::RadialValue LensMap::RadialFactor(double s) const {
  const auto& k = formula_.numerator;
  const auto& d = formula_.denominator;
  double n_slope = k[0] + s * (2 * k[1] + s * (3 * k[2] + s * 4 * k[3]));
  if (formula_.extended) n_slope += s * s * s * s * (5 * k[4] + s * 6 * k[5]);
  const double m = formula_.RadialDenominator(s);
  const double m_slope = d[0] + s * (2 * d[1] + s * 3 * d[2]);
  const double factor = formula_.RadialNumerator(s) / m;
  return {factor, (n_slope - factor * m_slope) / m};
}

LensMap::Distorted LensMap::Distort(const Eigen::Vector2d& q) const {
  const auto [factor, slope] = RadialFactor(q.squaredNorm());
  Distorted out;
  formula_.Distort(q.data(), out.point.data());
  const Eigen::Matrix2d radial =
      factor * Eigen::Matrix2d::Identity() + 2 * slope * q * q.transpose();
  // Tangential and prism terms: of q, or of the radially scaled point.
  const Eigen::Vector2d at = formula_.scaled_first ? Eigen::Vector2d(factor * q) : q;
  const double x = at.x(), y = at.y(), s = at.squaredNorm();
  const double p1 = formula_.p1, p2 = formula_.p2;
  Eigen::Matrix2d decentring;
  decentring << 2 * p1 * y + 6 * p2 * x, 2 * p1 * x + 2 * p2 * y, 2 * p2 * y + 2 * p1 * x,
      2 * p2 * x + 6 * p1 * y;
  const Eigen::Vector2d prism(formula_.sx + 2 * s * formula_.sx2,
                              formula_.sy + 2 * s * formula_.sy2);
  if (formula_.p3 != 0 || formula_.p4 != 0) {
    const Eigen::Vector2d tangential(2 * p1 * x * y + p2 * (s + 2 * x * x),
                                     2 * p2 * x * y + p1 * (s + 2 * y * y));
    decentring *= 1 + s * (formula_.p3 + s * formula_.p4);
    decentring += tangential * 2 * (formula_.p3 + 2 * s * formula_.p4) * at.transpose();
  }
  decentring += 2 * prism * at.transpose();
  out.jacobian = formula_.scaled_first ? Eigen::Matrix2d(radial + decentring * radial)
                                       : Eigen::Matrix2d(radial + decentring);
  return out;
}

std::optional<Eigen::Vector2d> LensMap::PlaneFromCam(const Eigen::Vector3d& p_in_cam) const {
  Eigen::Vector2d q;
  if (!p_in_cam.allFinite() || !formula_.Plane(p_in_cam.data(), q.data())) return std::nullopt;
  return q;
}

std::optional<Eigen::Vector2d> LensMap::PixelFromCam(const Eigen::Vector3d& p_in_cam) const {
  const auto q = PlaneFromCam(p_in_cam);
  if (!q) return std::nullopt;
  const double radius = q->norm();
  if (!(radius < max_radius_)) return std::nullopt;
  Eigen::Vector2d distorted;
  if (formula_.law != RadialLaw::kPolynomial) {
    distorted = *q * formula_.OwnFactor(q->squaredNorm());
  } else if (!decentred_) {
    distorted = *q * RadialFactor(q->squaredNorm()).factor;
  } else {
    const Distorted d = Distort(*q);
    if (!(d.jacobian.determinant() > 0)) return std::nullopt;
    distorted = d.point;
  }
  if (!distorted.allFinite()) return std::nullopt;
  return Eigen::Vector2d(
      formula_.fx_px * distorted.x() + formula_.skew * distorted.y() + formula_.cx_px,
      formula_.fy_px * distorted.y() + formula_.cy_px);
}

// Newton on r N / D - target inside a bracket that bisection shrinks whenever Newton leaves it.
std::optional<double> LensMap::InverseRadius(double distorted_radius) const {
  if (distorted_radius == 0) return 0;
  const auto value = [&](double r) { return r * RadialFactor(r * r).factor; };
  double low = 0;
  double high = std::min(max_radius_, std::max(distorted_radius, 1e-3));
  while (!(value(high) >= distorted_radius)) {
    if (high >= max_radius_ || high > kLargestTangent) return std::nullopt;
    low = high;
    high = std::min(2 * high, max_radius_);
  }
  double r = std::clamp(distorted_radius, low, high);
  for (int step = 0; step < kMaxNewtonSteps; ++step) {
    const auto [factor, slope] = RadialFactor(r * r);
    const double miss = r * factor - distorted_radius;
    if (miss == 0) break;
    (miss < 0 ? low : high) = r;
    double next = r - miss / (factor + 2 * r * r * slope);
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (next == r || !(next > low && next < high)) break;
    r = next;
  }
  return r < max_radius_ ? std::optional<double>(r) : std::nullopt;
}

// |q| of a law that is no polynomial.
std::optional<double> LensMap::InverseOwnRadius(double distorted_radius) const {
  const double a = formula_.law_a, b = formula_.law_b, square = distorted_radius * distorted_radius;
  if (formula_.law == RadialLaw::kDivision) {
    const double divisor = 1 + a * square;
    // Beyond 1 / sqrt(k) lies the other branch of the square root.
    if (!(divisor > 0) || !(a * square < 1)) return std::nullopt;
    return distorted_radius / divisor;
  }
  if (formula_.law == RadialLaw::kEucm) {  // equations 9 and 10 of the paper
    const double root = 1 - (2 * a - 1) * b * square;
    if (!(root >= 0)) return std::nullopt;
    const double z = (1 - b * a * a * square) / (a * std::sqrt(root) + 1 - a);
    return z > 0 ? std::optional<double>(distorted_radius / z) : std::nullopt;
  }
  if (a == 0) return distorted_radius;
  if (formula_.law == RadialLaw::kInverseRadial) {
    // Beyond the turning point of the cubic lies another branch.
    if (!(1 + 3 * a * square > 0)) return std::nullopt;
    return distorted_radius * (1 + a * square);
  }
  const double angle = distorted_radius * a;
  if (!(angle < std::numbers::pi / 2)) return std::nullopt;
  return std::tan(angle) / (2 * std::tan(a / 2));
}

std::optional<Eigen::Vector2d> LensMap::UndistortOwn(const Eigen::Vector2d& distorted) const {
  const double radius = distorted.norm();
  if (!(max_radius_ > 0)) return std::nullopt;
  const std::optional<double> undistorted = InverseOwnRadius(radius);
  if (!undistorted || !(*undistorted < std::min(max_radius_, kLargestTangent))) return std::nullopt;
  return radius == 0 ? distorted : Eigen::Vector2d(distorted * (*undistorted / radius));
}

std::optional<Eigen::Vector2d> LensMap::Undistort(const Eigen::Vector2d& distorted) const {
  if (formula_.law != RadialLaw::kPolynomial) return UndistortOwn(distorted);
  const double radius = distorted.norm();
  const std::optional<double> start = InverseRadius(radius);
  if (!decentred_) {
    if (!start) return std::nullopt;
    return radius == 0 ? distorted : Eigen::Vector2d(distorted * (*start / radius));
  }
  // Newton in two dimensions; a step that makes things worse is halved.
  const double first = start ? *start : std::min(0.9 * max_radius_, radius);
  Eigen::Vector2d q = radius == 0 ? distorted : Eigen::Vector2d(distorted * (first / radius));
  Distorted at_q = Distort(q);
  double miss = (at_q.point - distorted).norm();
  for (int i = 0; i < kMaxNewtonSteps && miss > 0; ++i) {
    if (!(at_q.jacobian.determinant() > 0)) return std::nullopt;
    const Eigen::Vector2d full_step = at_q.jacobian.inverse() * (distorted - at_q.point);
    double share = 1;
    bool better = false;
    for (; share > 1e-4 && !better; share /= 2) {
      const Eigen::Vector2d candidate = q + share * full_step;
      const Distorted at_candidate = Distort(candidate);
      const double candidate_miss = (at_candidate.point - distorted).norm();
      if (candidate_miss < miss) {
        q = candidate;
        at_q = at_candidate;
        miss = candidate_miss;
        better = true;
      }
    }
    if (!better) break;
  }
  const bool found = miss <= kLargestResidual * std::max(1.0, radius) && q.norm() < max_radius_ &&
                     at_q.jacobian.determinant() > 0;
  return found ? std::optional<Eigen::Vector2d>(q) : std::nullopt;
}

std::optional<Eigen::Vector3d> LensMap::RayFromPixel(const Eigen::Vector2d& pixel) const {
  if (!pixel.allFinite()) return std::nullopt;
  const double y = (pixel.y() - formula_.cy_px) / formula_.fy_px;
  const double x = (pixel.x() - formula_.skew * y - formula_.cx_px) / formula_.fx_px;
  const auto q = Undistort({x, y});
  if (!q) return std::nullopt;
  if (!formula_.fisheye) return Eigen::Vector3d(q->x(), q->y(), 1).normalized();
  const double angle = q->norm();
  if (angle == 0) return Eigen::Vector3d::UnitZ();
  const double sine = std::sin(angle);
  return Eigen::Vector3d(q->x() / angle * sine, q->y() / angle * sine, std::cos(angle));
}

}  // namespace dtr::calib
