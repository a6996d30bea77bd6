// calib/bundle/plain/projection.h -- internal to calib/bundle/plain: pixel of a point with its
// derivatives, for the perspective camera models up to OPENCV.
#pragma once
#include "calib/lens_camera.h"

namespace dtr::calib::plain {

/// The parameters of all these models; those that a model lacks are 0, one focal length is both.
struct Intrinsics {
  double fx_px = 1, fy_px = 1, cx_px = 0, cy_px = 0, k1 = 0, k2 = 0, p1 = 0, p2 = 0;
};

/// Columns of the derivatives by the intrinsics; kFocal moves both focal lengths.
enum Column { kFocal, kFocalX, kFocalY, kCentreX, kCentreY, kK1, kK2, kP1, kP2, kColumns };

inline constexpr int kMaxFree = 8;  ///< parameters of OPENCV, which has the most

/// Whether `model` is one of SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV.
inline bool HasIntrinsics(CameraModel model) {
  return model == CameraModel::kSimplePinhole || model == CameraModel::kPinhole ||
         model == CameraModel::kSimpleRadial || model == CameraModel::kRadial ||
         model == CameraModel::kOpenCv;
}

/// The column of a model's parameter `index` (CameraModel's order).
inline Column ColumnOf(CameraModel model, int index) {
  if (FocalCount(model) == 1) {
    constexpr Column kOne[] = {kFocal, kCentreX, kCentreY, kK1, kK2};
    return kOne[index];
  }
  return static_cast<Column>(kFocalX + index);
}

/// `params`: ParameterCount(model) values.
inline Intrinsics IntrinsicsOf(CameraModel model, const double* params) {
  Intrinsics of;
  double* const at[] = {nullptr, &of.fx_px, &of.fy_px, &of.cx_px, &of.cy_px,
                        &of.k1,  &of.k2,    &of.p1,    &of.p2};
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

/// Pixel of a point in the camera frame (LensFormula of these models); false behind the camera.
inline bool Project(const Intrinsics& lens, const double p[3], double pixel[2]) {
  if (!(p[2] > 0)) return false;
  const double inverse_z = 1 / p[2], x = p[0] * inverse_z, y = p[1] * inverse_z;
  const double s = x * x + y * y, g = 1 + s * (lens.k1 + s * lens.k2), xy2 = 2 * x * y;
  pixel[0] = lens.fx_px * (x * g + lens.p1 * xy2 + lens.p2 * (s + 2 * x * x)) + lens.cx_px;
  pixel[1] = lens.fy_px * (y * g + lens.p2 * xy2 + lens.p1 * (s + 2 * y * y)) + lens.cy_px;
  return true;
}

/// Likewise of a point in front of the camera, with the derivatives by the point (2 x 3, row-major)
/// and by the intrinsics: x and y of each Column.
inline void Differentiate(const Intrinsics& lens, const double p[3], double pixel[2],
                          double by_point[6], double by_lens[2 * kColumns]) {
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
                                        fy * xy2};
  for (int i = 0; i < 2 * kColumns; ++i) by_lens[i] = columns[i];
}

}  // namespace dtr::calib::plain
