// tests/pipeline/source_projections.h -- where other programs put a point in a photo, by their own
// descriptions.
#pragma once
#include <cmath>
#include <numbers>

#include "tests/pipeline/source_programs.h"

namespace dtr::testing {

using Eigen::Matrix3d;
using Eigen::Matrix4d;
using Eigen::Vector2d;
using Eigen::Vector3d;

inline constexpr double kW = TrueCapture::kWidth, kH = TrueCapture::kHeight;

// What a file is made from: the numbers of one camera, in the words of the program.
struct Terms {
  double f = 500, fy = 500, cx = 324, cy = 236;  // pixels from the corner
  double k[6] = {0, 0, 0, 0, 0, 0};
  double p1 = 0, p2 = 0, p3 = 0, p4 = 0, b1 = 0, b2 = 0;
};

inline Terms Brown() {
  Terms t;
  t.k[0] = -0.11;
  t.k[1] = 0.07;
  t.k[2] = -0.02;
  t.p1 = 0.0012;
  t.p2 = -0.0031;
  return t;
}

inline Vector2d Normalised(const Vector3d& p) { return {p.x() / p.z(), p.y() / p.z()}; }

// Of OpenCV, OpenMVG, AliceVision and OpenSfM: x'' = x (1 + k1 r2 + ...) + 2 p1 x y + p2 (r2 +
// 2 x2), y'' = y (...) + p1 (r2 + 2 y2) + 2 p2 x y.
inline Vector2d OpenCvDistorted(const Vector2d& n, const Terms& t) {
  const double x = n.x(), y = n.y(), r2 = x * x + y * y;
  const double radial = 1 + t.k[0] * r2 + t.k[1] * r2 * r2 + t.k[2] * r2 * r2 * r2;
  return {x * radial + 2 * t.p1 * x * y + t.p2 * (r2 + 2 * x * x),
          y * radial + t.p1 * (r2 + 2 * y * y) + 2 * t.p2 * x * y};
}

inline Projection OpenCvProjection(const Terms& t) {
  return [t](const Vector3d& p) {
    const Vector2d d = OpenCvDistorted(Normalised(p), t);
    return Vector2d(t.f * d.x() + t.cx, t.fy * d.y() + t.cy);
  };
}

// theta (1 + k1 theta^2 + ...) in the direction of (x, y).
inline Projection FisheyeProjection(const Terms& t) {
  return [t](const Vector3d& p) {
    const double r = std::hypot(p.x(), p.y()), theta = std::atan2(r, p.z());
    const double s = theta * theta;
    const double d = theta * (1 + s * (t.k[0] + s * (t.k[1] + s * (t.k[2] + s * t.k[3]))));
    const double scale = r > 0 ? d / r : 0;
    return Vector2d(t.f * p.x() * scale + t.cx, t.fy * p.y() * scale + t.cy);
  };
}

// OpenSfM's fisheye62: (x, y) theta / r, six radial terms, tangential ones as OpenCV's.
inline Projection Fisheye62Projection(const Terms& t) {
  return [t](const Vector3d& p) {
    const double r = std::hypot(p.x(), p.y()), theta = std::atan2(r, p.z());
    const double x = p.x() * theta / r, y = p.y() * theta / r, s = theta * theta;
    double radial = 1;
    for (int i = 0; i < 6; ++i) radial += t.k[i] * std::pow(s, i + 1);
    return Vector2d(t.f * (x * radial + 2 * t.p1 * x * y + t.p2 * (s + 2 * x * x)) + t.cx,
                    t.fy * (y * radial + t.p1 * (s + 2 * y * y) + 2 * t.p2 * x * y) + t.cy);
  };
}

// AliceVision's fisheye1: r becomes atan(2 r tan(k / 2)) / k.
inline Projection Fisheye1Projection(const Terms& t) {
  return [t](const Vector3d& p) {
    const Vector2d n = Normalised(p);
    const double r = n.norm(), d = std::atan(2 * r * std::tan(t.k[0] / 2)) / t.k[0];
    return Vector2d(t.f * n.x() * d / r + t.cx, t.fy * n.y() * d / r + t.cy);
  };
}

// Metashape's manual: x' = x (1 + K1 r2 + K2 r4 + K3 r6 + K4 r8) + (P1 (r2 + 2 x2) + 2 P2 x y) (1 +
// P3 r2 + P4 r4), y' alike, u = w/2 + cx + x' f + x' B1 + y' B2, v = h/2 + cy + y' f. A fisheye
// takes x theta / r for x.
inline Projection MetashapeProjection(const Terms& t, bool fisheye) {
  return [t, fisheye](const Vector3d& p) {
    Vector2d n = Normalised(p);
    if (fisheye) n *= std::atan(n.norm()) / n.norm();
    const double x = n.x(), y = n.y(), r2 = n.squaredNorm(), r4 = r2 * r2;
    const double radial = 1 + t.k[0] * r2 + t.k[1] * r4 + t.k[2] * r4 * r2 + t.k[3] * r4 * r4;
    const double grow = 1 + t.p3 * r2 + t.p4 * r4;
    const double xd = x * radial + (t.p1 * (r2 + 2 * x * x) + 2 * t.p2 * x * y) * grow;
    const double yd = y * radial + (t.p2 * (r2 + 2 * y * y) + 2 * t.p1 * x * y) * grow;
    return Vector2d(t.cx + xd * t.f + xd * t.b1 + yd * t.b2, t.cy + yd * t.f);
  };
}

// RealityScan: as OpenCV with t2, t1 in the places of p1, p2.
inline Projection RealityScanProjection(const Terms& t) {
  return [t](const Vector3d& p) {
    const Vector2d n = Normalised(p);
    const double x = n.x(), y = n.y(), r2 = n.squaredNorm();
    const double radial = 1 + r2 * (t.k[0] + r2 * (t.k[1] + r2 * (t.k[2] + r2 * t.k[3])));
    return Vector2d(t.f * (x * radial + t.p1 * (r2 + 2 * x * x) + 2 * t.p2 * x * y) + t.cx,
                    t.f * (y * radial + t.p2 * (r2 + 2 * y * y) + 2 * t.p1 * x * y) + t.cy);
  };
}

// VisualSFM: the measured point m, relative to the middle in focal lengths, fulfils m (1 + r |m|^2)
// = (x, y); found by bisection.
inline Projection VisualSfmProjection(double f, double r) {
  return [f, r](const Vector3d& p) {
    const Vector2d n = Normalised(p);
    double low = 0, high = 2;
    for (int i = 0; i < 200; ++i) {
      const double m = (low + high) / 2;
      (m * (1 + r * m * m) < n.norm() ? low : high) = m;
    }
    return Vector2d(n * (f * low / n.norm()) + Vector2d(kW / 2, kH / 2));
  };
}

}  // namespace dtr::testing
