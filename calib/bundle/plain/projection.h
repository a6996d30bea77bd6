// calib/bundle/plain/projection.h -- internal to calib/bundle/plain: pixel of a point with its
// derivatives, for the perspective camera models up to OPENCV and the radial fisheyes.
#pragma once
#include <cmath>

#include "calib/lens_camera.h"

namespace dtr::calib::plain {

/// The parameters of all these models; those that a model lacks are 0, one focal length is both.
/// k3 and k4 are a fisheye's, p1 and p2 a perspective camera's.
struct Intrinsics {
  double fx_px = 1, fy_px = 1, cx_px = 0, cy_px = 0, k1 = 0, k2 = 0, p1 = 0, p2 = 0;
  double k3 = 0, k4 = 0;
  bool fisheye = false;
};

/// Columns of the derivatives by the intrinsics; kFocal moves both focal lengths.
enum Column {
  kFocal,
  kFocalX,
  kFocalY,
  kCentreX,
  kCentreY,
  kK1,
  kK2,
  kP1,
  kP2,
  kK3,
  kK4,
  kColumns
};

inline constexpr int kMaxFree = 8;  ///< parameters of OPENCV and OPENCV_FISHEYE, which have most

/// Whether `model` is one of SIMPLE_RADIAL_FISHEYE, RADIAL_FISHEYE, OPENCV_FISHEYE.
inline bool IsPlainFisheye(CameraModel model) {
  return model == CameraModel::kSimpleRadialFisheye || model == CameraModel::kRadialFisheye ||
         model == CameraModel::kOpenCvFisheye;
}

/// Whether `model` is one of these, or of SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV.
inline bool HasIntrinsics(CameraModel model) {
  return model == CameraModel::kSimplePinhole || model == CameraModel::kPinhole ||
         model == CameraModel::kSimpleRadial || model == CameraModel::kRadial ||
         model == CameraModel::kOpenCv || IsPlainFisheye(model);
}

/// The column of a model's parameter `index` (CameraModel's order).
inline Column ColumnOf(CameraModel model, int index) {
  if (FocalCount(model) == 1) {
    constexpr Column kOne[] = {kFocal, kCentreX, kCentreY, kK1, kK2};
    return kOne[index];
  }
  if (model == CameraModel::kOpenCvFisheye && index >= 6) return index == 6 ? kK3 : kK4;
  return static_cast<Column>(kFocalX + index);
}

/// `params`: ParameterCount(model) values.
inline Intrinsics IntrinsicsOf(CameraModel model, const double* params) {
  Intrinsics of;
  of.fisheye = IsPlainFisheye(model);
  double* const at[] = {nullptr, &of.fx_px, &of.fy_px, &of.cx_px, &of.cy_px, &of.k1,
                        &of.k2,  &of.p1,    &of.p2,    &of.k3,    &of.k4};
  for (int i = 0; i < ParameterCount(model); ++i) {
    const Column column = ColumnOf(model, i);
    if (column == kFocal) {
      of.fx_px = of.fy_px = params[i];
    } else {
      *at[column] = params[i];
    }
  }
  return of;
}

/// Where a fisheye draws a point on its plane before distortion, q = (x, y) angle / |(x, y)|, with
/// the derivatives of `growth` = angle / |(x, y)|: by |(x, y)|, over |(x, y)|, and by z.
struct FisheyePlane {
  double x = 0, y = 0, growth = 0, by_radius_over_radius = 0, by_z = 0;
};

/// False straight behind the camera, and on the axis of one that looks away.
inline bool PlaneOf(const double p[3], FisheyePlane& plane) {
  constexpr double kOnAxis = 1e-5;  // the series below is exact to rounding
  const double radius2 = p[0] * p[0] + p[1] * p[1], z = p[2], length2 = radius2 + z * z;
  const double radius = std::sqrt(radius2);
  if (radius < kOnAxis * std::abs(z) || radius == 0) {
    if (!(z > 0)) return false;
    plane.growth = 1 / z;
    plane.by_radius_over_radius = -2 / (3 * z * z * z);
  } else {
    plane.growth = std::atan2(radius, z) / radius;
    plane.by_radius_over_radius = (z / length2 - plane.growth) / radius2;
  }
  plane.by_z = -1 / length2;
  plane.x = p[0] * plane.growth;
  plane.y = p[1] * plane.growth;
  return true;
}

inline bool ProjectFisheye(const Intrinsics& lens, const double p[3], double pixel[2]) {
  FisheyePlane q;
  if (!PlaneOf(p, q)) return false;
  const double s = q.x * q.x + q.y * q.y;
  const double g = 1 + s * (lens.k1 + s * (lens.k2 + s * (lens.k3 + s * lens.k4)));
  pixel[0] = lens.fx_px * q.x * g + lens.cx_px;
  pixel[1] = lens.fy_px * q.y * g + lens.cy_px;
  return true;
}

/// Pixel of a point in the camera frame (LensFormula of these models); false behind the camera.
inline bool Project(const Intrinsics& lens, const double p[3], double pixel[2]) {
  if (lens.fisheye) return ProjectFisheye(lens, p, pixel);
  if (!(p[2] > 0)) return false;
  const double inverse_z = 1 / p[2], x = p[0] * inverse_z, y = p[1] * inverse_z;
  const double s = x * x + y * y, g = 1 + s * (lens.k1 + s * lens.k2), xy2 = 2 * x * y;
  pixel[0] = lens.fx_px * (x * g + lens.p1 * xy2 + lens.p2 * (s + 2 * x * x)) + lens.cx_px;
  pixel[1] = lens.fy_px * (y * g + lens.p2 * xy2 + lens.p1 * (s + 2 * y * y)) + lens.cy_px;
  return true;
}

inline void DifferentiateFisheye(const Intrinsics& lens, const double p[3], double pixel[2],
                                 double by_point[6], double by_lens[2 * kColumns]) {
  FisheyePlane q;
  PlaneOf(p, q);
  const double s = q.x * q.x + q.y * q.y;
  const double g = 1 + s * (lens.k1 + s * (lens.k2 + s * (lens.k3 + s * lens.k4)));
  const double slope = lens.k1 + s * (2 * lens.k2 + s * (3 * lens.k3 + s * 4 * lens.k4));
  pixel[0] = lens.fx_px * q.x * g + lens.cx_px;
  pixel[1] = lens.fy_px * q.y * g + lens.cy_px;
  // Rows of d(distorted) / dq, and dq / dp.
  const double dx[2] = {lens.fx_px * (g + 2 * q.x * q.x * slope),
                        lens.fx_px * 2 * q.x * q.y * slope};
  const double dy[2] = {lens.fy_px * 2 * q.x * q.y * slope,
                        lens.fy_px * (g + 2 * q.y * q.y * slope)};
  const double b = q.by_radius_over_radius, xy = p[0] * p[1] * b;
  const double x_by[3] = {q.growth + p[0] * p[0] * b, xy, p[0] * q.by_z};
  const double y_by[3] = {xy, q.growth + p[1] * p[1] * b, p[1] * q.by_z};
  for (int i = 0; i < 3; ++i) {
    by_point[i] = dx[0] * x_by[i] + dx[1] * y_by[i];
    by_point[3 + i] = dy[0] * x_by[i] + dy[1] * y_by[i];
  }
  const auto put = [&](Column column, double x, double y) {
    by_lens[2 * column] = x;
    by_lens[2 * column + 1] = y;
  };
  put(kFocal, q.x * g, q.y * g);
  put(kFocalX, q.x * g, 0);
  put(kFocalY, 0, q.y * g);
  put(kCentreX, 1, 0);
  put(kCentreY, 0, 1);
  put(kP1, 0, 0);
  put(kP2, 0, 0);
  const double x = lens.fx_px * q.x, y = lens.fy_px * q.y;
  double power = s;
  for (const Column column : {kK1, kK2, kK3, kK4}) {
    put(column, x * power, y * power);
    power *= s;
  }
}

/// Likewise of a point in front of the camera, with the derivatives by the point (2 x 3, row-major)
/// and by the intrinsics: x and y of each Column.
inline void Differentiate(const Intrinsics& lens, const double p[3], double pixel[2],
                          double by_point[6], double by_lens[2 * kColumns]) {
  if (lens.fisheye) return DifferentiateFisheye(lens, p, pixel, by_point, by_lens);
  const double inverse_z = 1 / p[2], x = p[0] * inverse_z, y = p[1] * inverse_z;
  const double xx = x * x, yy = y * y, s = xx + yy, xy2 = 2 * x * y;
  const double g = 1 + s * (lens.k1 + s * lens.k2), slope = lens.k1 + 2 * lens.k2 * s;
  const double along_x = s + 2 * xx, along_y = s + 2 * yy;
  const double dx = x * g + lens.p1 * xy2 + lens.p2 * along_x;
  const double dy = y * g + lens.p2 * xy2 + lens.p1 * along_y;
  pixel[0] = lens.fx_px * dx + lens.cx_px;
  pixel[1] = lens.fy_px * dy + lens.cy_px;

  const double xx_slope = g + 2 * xx * slope + 2 * lens.p1 * y + 6 * lens.p2 * x;
  const double yy_slope = g + 2 * yy * slope + 2 * lens.p2 * x + 6 * lens.p1 * y;
  const double xy_slope = xy2 * slope + 2 * lens.p1 * x + 2 * lens.p2 * y;
  const double ax = lens.fx_px * inverse_z * xx_slope, bx = lens.fx_px * inverse_z * xy_slope;
  const double ay = lens.fy_px * inverse_z * xy_slope, by = lens.fy_px * inverse_z * yy_slope;
  by_point[0] = ax, by_point[1] = bx, by_point[2] = -(ax * x + bx * y);
  by_point[3] = ay, by_point[4] = by, by_point[5] = -(ay * x + by * y);

  const double fx = lens.fx_px, fy = lens.fy_px;
  const double columns[2 * kColumns] = {dx,
                                        dy,
                                        dx,
                                        0,
                                        0,
                                        dy,
                                        1,
                                        0,
                                        0,
                                        1,
                                        fx * x * s,
                                        fy * y * s,
                                        fx * x * s * s,
                                        fy * y * s * s,
                                        fx * xy2,
                                        fy * along_y,
                                        fx * along_x,
                                        fy * xy2,
                                        0,
                                        0,
                                        0,
                                        0};
  for (int i = 0; i < 2 * kColumns; ++i) by_lens[i] = columns[i];
}

}  // namespace dtr::calib::plain
