// Five and seven matches: the minimal solvers of epipolar.h.
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <array>
#include <cmath>
#include <numbers>

#include "calib/sfm/matching/epipolar.h"

namespace dtr::sfm::matching {
namespace {

// Exponents of x, y, z of the monomials, cubic ones first. The last ten are those of degree 2 or
// less, the last four those of degree 1 or less.
constexpr std::array<std::array<int, 3>, 20> kMonomials = {{
    {3, 0, 0}, {2, 1, 0}, {2, 0, 1}, {1, 2, 0}, {1, 1, 1}, {1, 0, 2}, {0, 3, 0},
    {0, 2, 1}, {0, 1, 2}, {0, 0, 3}, {2, 0, 0}, {1, 1, 0}, {1, 0, 1}, {0, 2, 0},
    {0, 1, 1}, {0, 0, 2}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0},
}};

constexpr int IndexOfProduct(int i, int j) {
  for (int k = 0; k < 20; ++k) {
    bool same = true;
    for (int v = 0; v < 3; ++v) {
      same = same && kMonomials[static_cast<size_t>(k)][static_cast<size_t>(v)] ==
                         kMonomials[static_cast<size_t>(i)][static_cast<size_t>(v)] +
                             kMonomials[static_cast<size_t>(j)][static_cast<size_t>(v)];
    }
    if (same) return k;
  }
  return -1;
}

// kProduct[i][j]: monomial 10 + i (degree 2 or less) times monomial 16 + j (degree 1 or less).
constexpr auto kProduct = [] {
  std::array<std::array<int, 4>, 10> table{};
  for (int i = 0; i < 10; ++i) {
    for (int j = 0; j < 4; ++j) {
      table[static_cast<size_t>(i)][static_cast<size_t>(j)] = IndexOfProduct(10 + i, 16 + j);
    }
  }
  return table;
}();

using Linear = Eigen::Vector4d;
using Quadratic = Eigen::Matrix<double, 10, 1>;
using Cubic = Eigen::Matrix<double, 20, 1>;

Quadratic Times(const Linear& p, const Linear& q) {
  Quadratic product = Quadratic::Zero();
  for (size_t i = 0; i < 4; ++i) {
    for (size_t j = 0; j < 4; ++j) {
      product[kProduct[6 + i][j] - 10] +=
          p[static_cast<Eigen::Index>(i)] * q[static_cast<Eigen::Index>(j)];
    }
  }
  return product;
}

Cubic Times(const Quadratic& p, const Linear& q) {
  Cubic product = Cubic::Zero();
  for (size_t i = 0; i < 10; ++i) {
    for (size_t j = 0; j < 4; ++j) {
      product[kProduct[i][j]] += p[static_cast<Eigen::Index>(i)] * q[static_cast<Eigen::Index>(j)];
    }
  }
  return product;
}

// Row i: the coefficients of the nine elements (by rows) of the matrix in match i's equation.
template <int kCount>
Eigen::Matrix<double, 9, kCount> Equations(const PointPairs& points, std::span<const int> chosen) {
  Eigen::Matrix<double, 9, kCount> m;
  for (int i = 0; i < kCount; ++i) {
    const auto at = static_cast<size_t>(chosen[static_cast<size_t>(i)]);
    const Eigen::Vector3d p = points.a[at].homogeneous(), q = points.b[at].homogeneous();
    m.col(i) << q.x() * p, q.y() * p, p;
  }
  return m;
}

// Decompositions of matrices whose size the compiler knows are unrolled and take it a minute; these
// have their size at run time and their place on the stack all the same.
template <int kMaxRows, int kMaxCols>
using Sized =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxRows, kMaxCols>;

// The 9 - kCount matrices that satisfy all equations, one per column.
template <int kCount>
Eigen::Matrix<double, 9, 9 - kCount> NullSpace(const Eigen::Matrix<double, 9, kCount>& equations) {
  const Eigen::HouseholderQR<Sized<9, 7>> qr(equations);
  const Sized<9, 9> q = qr.householderQ() * Sized<9, 9>::Identity(9, 9);
  return q.rightCols(9 - kCount);
}

Eigen::Matrix3d FromRows(const Eigen::Matrix<double, 9, 1>& v) {
  Eigen::Matrix3d m;
  m << v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8];
  return m;
}

// det E = 0 and 2 E E^T E - trace(E E^T) E = 0 as ten cubic equations.
Eigen::Matrix<double, 10, 20> Constraints(const Eigen::Matrix<double, 9, 4>& basis) {
  std::array<std::array<Linear, 3>, 3> e;
  for (size_t i = 0; i < 9; ++i) e[i / 3][i % 3] = basis.row(static_cast<Eigen::Index>(i));
  std::array<std::array<Quadratic, 3>, 3> eet;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j <= i; ++j) {
      eet[i][j] = Times(e[i][0], e[j][0]) + Times(e[i][1], e[j][1]) + Times(e[i][2], e[j][2]);
      eet[j][i] = eet[i][j];
    }
  }
  const Quadratic half_trace = 0.5 * (eet[0][0] + eet[1][1] + eet[2][2]);
  for (size_t i = 0; i < 3; ++i) eet[i][i] -= half_trace;
  Eigen::Matrix<double, 10, 20> m;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      m.row(static_cast<Eigen::Index>(3 * i + j)) =
          Times(eet[i][0], e[0][j]) + Times(eet[i][1], e[1][j]) + Times(eet[i][2], e[2][j]);
    }
  }
  const auto minor = [&](size_t i, size_t j) -> Quadratic {
    return Times(e[1][i], e[2][j]) - Times(e[1][j], e[2][i]);
  };
  m.row(9) =
      Times(minor(1, 2), e[0][0]) + Times(minor(2, 0), e[0][1]) + Times(minor(0, 1), e[0][2]);
  return m;
}

// Real roots of c[0] + c[1] x + c[2] x^2 + c[3] x^3.
std::vector<double> RootsOfCubic(const std::array<double, 4>& c) {
  const double scale = std::abs(c[0]) + std::abs(c[1]) + std::abs(c[2]) + std::abs(c[3]);
  if (!(std::abs(c[3]) > 1e-12 * scale)) return {};
  const double a = c[2] / c[3], b = c[1] / c[3], d = c[0] / c[3];
  const double q = (a * a - 3 * b) / 9, r = (2 * a * a * a - 9 * a * b + 27 * d) / 54;
  const double q3 = q * q * q;
  if (r * r < q3) {
    const double root = -2 * std::sqrt(q);
    const double angle = std::acos(std::clamp(r / std::sqrt(q3), -1.0, 1.0));
    std::vector<double> roots;
    for (const double turn : {0.0, 2 * std::numbers::pi, -2 * std::numbers::pi}) {
      roots.push_back(root * std::cos((angle + turn) / 3) - a / 3);
    }
    return roots;
  }
  const double s = -std::copysign(std::cbrt(std::abs(r) + std::sqrt(r * r - q3)), r);
  return {s + (s != 0 ? q / s : 0) - a / 3};
}

}  // namespace

std::vector<Eigen::Matrix3d> EssentialFromFive(const PointPairs& points,
                                               std::span<const int> five) {
  const Eigen::Matrix<double, 9, 4> basis = NullSpace<5>(Equations<5>(points, five));
  const Eigen::Matrix<double, 10, 20> m = Constraints(basis);
  const Sized<10, 10> left = m.leftCols<10>(), right = m.rightCols<10>();
  const Eigen::Matrix<double, 10, 10> reduced =
      Eigen::PartialPivLU<Sized<10, 10>>(left).solve(right);
  if (!reduced.allFinite()) return {};
  // Multiplication by x in the basis of the last ten monomials (x^2 .. 1).
  Sized<10, 10> action = Sized<10, 10>::Zero(10, 10);
  action.topRows(6) = -reduced.topRows(6);
  action(6, 0) = action(7, 1) = action(8, 2) = action(9, 6) = 1;
  const Eigen::EigenSolver<Sized<10, 10>> solver(action);
  if (solver.info() != Eigen::Success) return {};
  std::vector<Eigen::Matrix3d> found;
  const auto vectors = solver.eigenvectors();
  for (Eigen::Index i = 0; i < 10; ++i) {
    if (std::abs(solver.eigenvalues()[i].imag()) > 1e-9) continue;
    const double w = vectors(9, i).real();
    if (std::abs(w) < 1e-12) continue;
    const Eigen::Vector4d xyz1(vectors(6, i).real() / w, vectors(7, i).real() / w,
                               vectors(8, i).real() / w, 1);
    const Eigen::Matrix<double, 9, 1> v = basis * xyz1;
    if (v.allFinite()) found.push_back(FromRows(v.normalized()));
  }
  return found;
}

std::vector<Eigen::Matrix3d> FundamentalFromSeven(const PointPairs& points,
                                                  std::span<const int> seven) {
  const Eigen::Matrix<double, 9, 2> basis = NullSpace<7>(Equations<7>(points, seven));
  const Eigen::Matrix3d f = FromRows(basis.col(0)), g = FromRows(basis.col(1));
  // det(f + x g) from its values at four places.
  const double at_0 = f.determinant(), at_infinity = g.determinant();
  const double at_1 = (f + g).determinant(), at_minus_1 = (f - g).determinant();
  const double even = 0.5 * (at_1 + at_minus_1) - at_0;
  const double odd = 0.5 * (at_1 - at_minus_1) - at_infinity;
  std::vector<Eigen::Matrix3d> found;
  for (const double x : RootsOfCubic({at_0, odd, even, at_infinity})) {
    const Eigen::Matrix3d m = f + x * g;
    const double norm = m.norm();
    if (norm > 0 && std::isfinite(norm)) found.push_back(m / norm);
  }
  return found;
}

}  // namespace dtr::sfm::matching
