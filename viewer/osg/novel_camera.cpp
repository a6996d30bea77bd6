#include "viewer/osg/novel_camera.h"

#include <Eigen/LU>
#include <cmath>
#include <string>

#include "dtr/base/error.h"

namespace osgDTR {
namespace {

using dtr::Error;

// Matrices come through products of doubles; what is uneven by design is uneven by more.
constexpr double kUneven = 1e-6;

/// gl_from_cam = diag(1, -1, -1): x right, y up, z back.
const Eigen::Vector3d kGlFromCam(1, -1, -1);

[[noreturn]] void Reject(const std::string& expected, const std::string& found) {
  throw Error("DepthTR: expected " + expected + ", found " + found +
              "; it is not drawn for this camera");
}

/// Similarity eye_from_local: scale * rotation, and translation.
struct Similarity {
  double scale = 1;
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;
};

Similarity SimilarityOf(const osg::Matrixd& modelview) {
  Similarity result;
  Eigen::Matrix3d linear;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) linear(row, column) = modelview(column, row);
    result.translation[row] = modelview(3, row);
    if (modelview(row, 3) != 0) Reject("an affine modelview matrix", "a projective one");
  }
  if (!linear.allFinite() || !result.translation.allFinite() || modelview(3, 3) != 1) {
    Reject("a finite affine modelview matrix", "another");
  }
  const double determinant = linear.determinant();
  if (!(determinant > 0)) Reject("a node that is not mirrored", "a mirrored or flat one");
  result.scale = std::cbrt(determinant);
  result.rotation = linear / result.scale;
  const Eigen::Matrix3d error =
      result.rotation * result.rotation.transpose() - Eigen::Matrix3d::Identity();
  if (!(error.cwiseAbs().maxCoeff() < kUneven)) {
    Reject("a node scaled alike along all axes", "uneven scales");
  }
  return result;
}

}  // namespace

NovelCamera NovelCameraOf(const osg::Matrixd& modelview, const osg::Matrixd& projection,
                          int width_px, int height_px) {
  const osg::Matrixd& p = projection;
  if (p(2, 3) != -1 || p(3, 3) != 0) {
    Reject("a perspective projection", "an orthographic or projective one");
  }
  const double others[] = {p(0, 1), p(0, 2), p(0, 3), p(1, 0), p(1, 2), p(1, 3), p(3, 0), p(3, 1)};
  for (const double other : others) {
    if (other != 0) Reject("a projection without skew", "a skewed one");
  }
  if (!(p(0, 0) > 0) || !(p(1, 1) > 0)) {
    Reject("a projection that keeps left and right, up and down", "a mirrored one");
  }
  const Similarity eye_from_local = SimilarityOf(modelview);
  const double half_width = 0.5 * width_px, half_height = 0.5 * height_px;
  NovelCamera novel;
  // Device x = P00 X / -Z - P20, device y = P11 Y / -Z - P21, with X = x, Y = -y, Z = -z.
  novel.camera = {width_px,
                  height_px,
                  half_width * p(0, 0),
                  half_height * p(1, 1),
                  half_width * (1 - p(2, 0)),
                  half_height * (1 + p(2, 1))};
  novel.cam_from_local.rotation =
      Eigen::Quaterniond(kGlFromCam.asDiagonal() * eye_from_local.rotation).normalized();
  novel.cam_from_local.translation =
      kGlFromCam.asDiagonal() * eye_from_local.translation / eye_from_local.scale;
  novel.projection = {-p(2, 2), p(3, 2) / eye_from_local.scale};
  return novel;
}

osg::Matrixd ViewMatrixOf(const dtr::Pose& cam_from_world) {
  const Eigen::Matrix3d rotation =
      kGlFromCam.asDiagonal() * cam_from_world.rotation.toRotationMatrix();
  const Eigen::Vector3d translation = kGlFromCam.asDiagonal() * cam_from_world.translation;
  osg::Matrixd view;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) view(column, row) = rotation(row, column);
    view(3, row) = translation[row];
  }
  return view;
}

osg::Matrixd ProjectionMatrixOf(const dtr::PinholeCamera& camera, double near_z, double far_z) {
  const double left = -camera.cx_px() / camera.fx_px(), top = camera.cy_px() / camera.fy_px();
  const double right = (camera.width_px() - camera.cx_px()) / camera.fx_px();
  const double bottom = -(camera.height_px() - camera.cy_px()) / camera.fy_px();
  return osg::Matrixd::frustum(left * near_z, right * near_z, bottom * near_z, top * near_z, near_z,
                               far_z);
}

}  // namespace osgDTR
