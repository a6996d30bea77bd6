// calib/models/lens_formula.h -- the one formula behind the lens models, for double and for jets.
#pragma once
#include <array>
#include <cmath>

#include "calib/lens_camera.h"

namespace dtr::calib {

/// What the radial factor of a camera model is made of.
enum class RadialLaw { kPolynomial, kFov, kDivision, kEucm, kInverseRadial };

/// A ray is first drawn as a point q of a plane:
///   perspective models  q = (x, y) / z                             |q| = tan(angle)
///   fisheye models      q = (x, y) / |(x, y)| * atan2(|(x, y)|, z)  |q| = angle
/// then distorted, with s = |q|^2 (Brown 1966; Kannala & Brandt 2006; Weng et al. 1992):
///   d = q * (1 + k1 s + ... + k6 s^6) / (1 + d1 s + d2 s^2 + d3 s^3)
///     + (2 p1 qx qy + p2 (s + 2 qx^2), 2 p2 qx qy + p1 (s + 2 qy^2)) (1 + p3 s + p4 s^2)
///     + (sx s + sx2 s^2, sy s + sy2 s^2)
/// and pixel = (fx dx + skew dy + cx, fy dy + cy). Of RAD_TAN_THIN_PRISM_FISHEYE the last two lines
/// take the radially scaled point for q. Models of another law have d = q * OwnFactor(s):
///   FOV       atan(2 |q| tan(omega / 2)) / (omega |q|) (Devernay & Faugeras 2001)
///   division  2 / (1 + sqrt(1 - 4 k s)), the inverse of q = d / (1 + k |d|^2) (Fitzgibbon 2001)
///   inverse   |d| / |q| of the real root of r |d|^3 + |d| = |q| that begins at 0
///   EUCM      1 / (alpha sqrt(1 + beta s) + 1 - alpha) (Khomutenko, Garcia & Martinet 2016)
/// T is double, or a type that carries derivatives (ceres::Jet). No guard: LensMap knows where the
/// formula stops being a lens.
template <typename T>
struct LensFormula {
  T fx_px, fy_px, cx_px, cy_px;
  bool fisheye = false;
  RadialLaw law = RadialLaw::kPolynomial;
  T law_a{0}, law_b{0};  // omega; k; r; alpha and beta
  /// Whether any of k5, k6, p3, p4, sx2, sy2 and skew is in use, which most models do without.
  bool extended = false;
  bool scaled_first = false;  // tangential and prism terms of the radially scaled point
  std::array<T, 6> numerator{T(0), T(0), T(0), T(0), T(0), T(0)};  // k1..k6
  std::array<T, 3> denominator{T(0), T(0), T(0)};                  // d1..d3
  T p1{0}, p2{0}, sx{0}, sy{0};
  T p3{0}, p4{0}, sx2{0}, sy2{0}, skew{0};

  T RadialNumerator(const T& s) const {
    const auto& k = numerator;
    if (!extended) return 1.0 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3])));
    return 1.0 + s * (k[0] + s * (k[1] + s * (k[2] + s * (k[3] + s * (k[4] + s * k[5])))));
  }
  T RadialDenominator(const T& s) const {
    const auto& d = denominator;
    return 1.0 + s * (d[0] + s * (d[1] + s * d[2]));
  }

  /// The radial factor of a law that is no polynomial.
  T OwnFactor(const T& s) const {
    using std::atan;
    using std::sqrt;
    using std::tan;
    if (law == RadialLaw::kDivision) return 2.0 / (1.0 + sqrt(1.0 - 4.0 * law_a * s));
    if (law == RadialLaw::kEucm) {
      return 1.0 / (law_a * sqrt(1.0 + law_b * s) + 1.0 - law_a);
    }
    if (law_a == T(0)) return T(1);  // the limit of the others is the pinhole camera
    if (law == RadialLaw::kInverseRadial) return InverseRadialFactor(s);
    const T scale = 2.0 * tan(law_a / 2.0);
    if (s == T(0)) return scale / law_a;
    const T radius = sqrt(s);
    return atan(radius * scale) / (law_a * radius);
  }

  /// By the trigonometric solution of the cubic.
  T InverseRadialFactor(const T& s) const {
    using std::asin;
    using std::log;
    using std::sin;
    using std::sinh;
    using std::sqrt;
    if (s == T(0)) return T(1);
    const bool grows = law_a > T(0);
    const T scale = sqrt(3.0 * (grows ? law_a : -law_a));
    const T radius = sqrt(s), x = 1.5 * radius * scale;
    const T third = grows ? sinh(log(x + sqrt(x * x + 1.0)) / 3.0) : sin(asin(x) / 3.0);
    return 2.0 * third / (scale * radius);
  }

  /// Distorts the point q of the plane.
  void Distort(const T q[2], T distorted[2]) const {
    const T &x = q[0], &y = q[1];
    const T s = x * x + y * y;
    if (law != RadialLaw::kPolynomial) {
      const T factor = OwnFactor(s);
      distorted[0] = x * factor;
      distorted[1] = y * factor;
      return;
    }
    const T factor = RadialNumerator(s) / RadialDenominator(s);
    if (extended) {
      const T u[2] = {x * factor, y * factor};
      distorted[0] = u[0];
      distorted[1] = u[1];
      AddDecentring(scaled_first ? u : q, distorted);
      return;
    }
    distorted[0] = x * factor + 2.0 * p1 * x * y + p2 * (s + 2.0 * x * x) + sx * s;
    distorted[1] = y * factor + 2.0 * p2 * x * y + p1 * (s + 2.0 * y * y) + sy * s;
  }

  /// Tangential and prism terms at q, of the extended formula.
  void AddDecentring(const T q[2], T distorted[2]) const {
    const T &x = q[0], &y = q[1];
    const T s = x * x + y * y;
    const T growth = 1.0 + s * (p3 + s * p4);
    distorted[0] += (2.0 * p1 * x * y + p2 * (s + 2.0 * x * x)) * growth + s * (sx + s * sx2);
    distorted[1] += (2.0 * p2 * x * y + p1 * (s + 2.0 * y * y)) * growth + s * (sy + s * sy2);
  }

  /// The point q of a point in the camera frame. False where there is none: behind a perspective
  /// lens, straight behind a fisheye.
  bool Plane(const T p_in_cam[3], T q[2]) const {
    using std::atan2;
    using std::hypot;
    const T &x = p_in_cam[0], &y = p_in_cam[1], &z = p_in_cam[2];
    if (!fisheye || (x == T(0) && y == T(0))) {  // on the axis both are (x, y) / z
      if (!(z > T(0))) return false;
      q[0] = x / z;
      q[1] = y / z;
      return true;
    }
    const T radius = hypot(x, y);
    const T angle = atan2(radius, z);
    q[0] = x / radius * angle;
    q[1] = y / radius * angle;
    return true;
  }

  /// Pixel of a point in the camera frame; false where Plane is.
  bool Project(const T p_in_cam[3], T pixel[2]) const {
    T q[2], distorted[2];
    if (!Plane(p_in_cam, q)) return false;
    Distort(q, distorted);
    pixel[0] = fx_px * distorted[0] + cx_px;
    if (extended) pixel[0] += skew * distorted[1];
    pixel[1] = fy_px * distorted[1] + cy_px;
    return true;
  }
};

/// FocalCount(model) == 1, without a look-up: bundle adjustment asks for every observation.
constexpr bool HasOneFocalLength(CameraModel model) {
  return model == CameraModel::kSimplePinhole || model == CameraModel::kSimpleRadial ||
         model == CameraModel::kRadial || model == CameraModel::kSimpleRadialFisheye ||
         model == CameraModel::kRadialFisheye || model == CameraModel::kSimpleDivision ||
         model == CameraModel::kSimpleFisheye;
}

/// The formula's coefficients out of a model's parameters (ParameterCount(model) values in the
/// order of CameraModel).
template <typename T>
LensFormula<T> FormulaOf(CameraModel model, const T* params) {
  const bool one_focal = HasOneFocalLength(model);
  LensFormula<T> formula{params[0], params[one_focal ? 0 : 1], params[one_focal ? 1 : 2],
                         params[one_focal ? 2 : 3]};
  const T* k = params + (one_focal ? 3 : 4);
  switch (model) {
    case CameraModel::kSimplePinhole:
    case CameraModel::kPinhole:
      break;
    case CameraModel::kFov:
      formula.law = RadialLaw::kFov;
      formula.law_a = k[0];
      break;
    case CameraModel::kSimpleDivision:
    case CameraModel::kDivision:
      formula.law = RadialLaw::kDivision;
      formula.law_a = k[0];
      break;
    case CameraModel::kInverseRadial:
      formula.law = RadialLaw::kInverseRadial;
      formula.law_a = k[0];
      break;
    case CameraModel::kEucm:
      formula.law = RadialLaw::kEucm;
      formula.law_a = k[0];
      formula.law_b = k[1];
      break;
    case CameraModel::kSimpleFisheye:
    case CameraModel::kFisheye:
      formula.fisheye = true;
      break;
    case CameraModel::kRadTanThinPrismFisheye:
      formula.fisheye = formula.extended = formula.scaled_first = true;
      formula.numerator = {k[0], k[1], k[2], k[3], k[4], k[5]};
      formula.p1 = k[7];  // COLMAP's p0 is what multiplies s + 2 x^2
      formula.p2 = k[6];
      formula.sx = k[8];
      formula.sx2 = k[9];
      formula.sy = k[10];
      formula.sy2 = k[11];
      break;
    case CameraModel::kFisheyeAffine:
      formula.fisheye = true;
      [[fallthrough]];
    case CameraModel::kBrownAffine:
      formula.extended = true;
      formula.numerator = {k[0], k[1], k[2], k[3], k[4], k[5]};
      formula.p1 = k[6];
      formula.p2 = k[7];
      formula.p3 = k[8];
      formula.p4 = k[9];
      formula.skew = k[10];
      break;
    case CameraModel::kSimpleRadialFisheye:
      formula.fisheye = true;
      [[fallthrough]];
    case CameraModel::kSimpleRadial:
      formula.numerator[0] = k[0];
      break;
    case CameraModel::kRadialFisheye:
      formula.fisheye = true;
      [[fallthrough]];
    case CameraModel::kRadial:
      formula.numerator[0] = k[0];
      formula.numerator[1] = k[1];
      break;
    case CameraModel::kOpenCvFisheye:
      formula.fisheye = true;
      formula.numerator = {k[0], k[1], k[2], k[3], T(0), T(0)};
      break;
    case CameraModel::kThinPrismFisheye:
      formula.fisheye = true;
      formula.numerator = {k[0], k[1], k[4], k[5], T(0), T(0)};
      formula.p1 = k[2];
      formula.p2 = k[3];
      formula.sx = k[6];
      formula.sy = k[7];
      break;
    case CameraModel::kFullOpenCv:
      formula.numerator[2] = k[4];
      formula.denominator = {k[5], k[6], k[7]};
      [[fallthrough]];
    case CameraModel::kOpenCv:
      formula.numerator[0] = k[0];
      formula.numerator[1] = k[1];
      formula.p1 = k[2];
      formula.p2 = k[3];
      break;
  }
  return formula;
}

}  // namespace dtr::calib
