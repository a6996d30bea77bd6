// calib/models/lens_formula.h -- the one formula behind the lens models, for double and for jets.
#pragma once
#include <array>
#include <cmath>

#include "calib/lens_camera.h"

namespace dtr::calib {

/// A ray is first drawn as a point q of a plane:
///   perspective models  q = (x, y) / z                             |q| = tan(angle)
///   fisheye models      q = (x, y) / |(x, y)| * atan2(|(x, y)|, z)  |q| = angle
/// then distorted, with s = |q|^2 (Brown 1966; Kannala & Brandt 2006; Weng et al. 1992):
///   d = q * (1 + k1 s + k2 s^2 + k3 s^3 + k4 s^4) / (1 + d1 s + d2 s^2 + d3 s^3)
///     + (2 p1 qx qy + p2 (s + 2 qx^2) + sx s,  2 p2 qx qy + p1 (s + 2 qy^2) + sy s)
/// and pixel = f * d + c. CameraModel::kFov has a radial factor of its own (lens_map.h).
/// T is double, or a type that carries derivatives (ceres::Jet). No guard: LensMap knows where the
/// formula stops being a lens.
template <typename T>
struct LensFormula {
  T fx_px, fy_px, cx_px, cy_px;
  bool fisheye = false;
  std::array<T, 4> numerator{T(0), T(0), T(0), T(0)};  // k1..k4
  std::array<T, 3> denominator{T(0), T(0), T(0)};      // d1..d3
  T p1{0}, p2{0}, sx{0}, sy{0};

  T RadialNumerator(const T& s) const {
    const auto& k = numerator;
    return 1.0 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3])));
  }
  T RadialDenominator(const T& s) const {
    const auto& d = denominator;
    return 1.0 + s * (d[0] + s * (d[1] + s * d[2]));
  }

  /// Distorts the point q of the plane.
  void Distort(const T q[2], T distorted[2]) const {
    const T &x = q[0], &y = q[1];
    const T s = x * x + y * y;
    const T factor = RadialNumerator(s) / RadialDenominator(s);
    distorted[0] = x * factor + 2.0 * p1 * x * y + p2 * (s + 2.0 * x * x) + sx * s;
    distorted[1] = y * factor + 2.0 * p2 * x * y + p1 * (s + 2.0 * y * y) + sy * s;
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
    pixel[1] = fy_px * distorted[1] + cy_px;
    return true;
  }
};

/// The formula's coefficients out of a model's parameters (ParameterCount(model) values in the
/// order of CameraModel). Of kFov only focal lengths and principal point are taken.
template <typename T>
LensFormula<T> FormulaOf(CameraModel model, const T* params) {
  const bool one_focal = model == CameraModel::kSimplePinhole ||
                         model == CameraModel::kSimpleRadial || model == CameraModel::kRadial ||
                         model == CameraModel::kSimpleRadialFisheye ||
                         model == CameraModel::kRadialFisheye;
  LensFormula<T> formula{params[0], params[one_focal ? 0 : 1], params[one_focal ? 1 : 2],
                         params[one_focal ? 2 : 3]};
  const T* k = params + (one_focal ? 3 : 4);
  switch (model) {
    case CameraModel::kSimplePinhole:
    case CameraModel::kPinhole:
    case CameraModel::kFov:
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
      formula.numerator = {k[0], k[1], k[2], k[3]};
      break;
    case CameraModel::kThinPrismFisheye:
      formula.fisheye = true;
      formula.numerator = {k[0], k[1], k[4], k[5]};
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
