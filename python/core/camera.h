// python/core/camera.h -- cameras as Python gives them: matrices.
#pragma once
#include <Eigen/Core>
#include <string>

#include "dtr/types/camera.h"
#include "dtr/types/pose.h"

namespace dtr::python {

/// As numpy has them.
using RowMajor3d = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
using RowMajor4d = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

/// K of a camera: [fx 0 cx; 0 fy cy; 0 0 1], pixels.
Eigen::Matrix3d MatrixOf(const PinholeCamera& camera);

/// Inverses of that and of io::MatrixFromPose. Throw UsageError, one line that begins with `what`,
/// where K is not finite, has skew or another last row, focal lengths are not positive, a size is
/// not 1...65536, the pose is farther than kMaxLength, or its rotation is none to 1e-6 (otherwise
/// the nearest one is taken).
PinholeCamera CameraFrom(const Eigen::Matrix3d& k, int width_px, int height_px,
                         const std::string& what);
Pose PoseFrom(const Eigen::Matrix4d& cam_from_world, const std::string& what);

}  // namespace dtr::python
