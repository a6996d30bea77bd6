// dtr/io/formats/text_cameras.h -- cameras in the small text files of research data sets.
#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "dtr/types/camera.h"
#include "dtr/types/pose.h"

namespace dtr::io {

/// Where a foreign format puts the origin of its pixel coordinates.
enum class PixelOrigin {
  kCorner,  ///< outer corner of the top-left pixel, whose centre is (0.5, 0.5): ours, COLMAP's
  kCentre,  ///< centre of the top-left pixel: OpenCV, Middlebury, Open3D; 0.5 is added to cx, cy
};

/// Our camera for a foreign 3x3 calibration matrix of an image of this size. Throws Error starting
/// with `what` unless k is [fx s cx; 0 fy cy; 0 0 1] up to a factor, finite, fx, fy > 0 and the
/// skew |s| below 0.01 px, which a camera without skew can stand for.
PinholeCamera CameraFromK(const Eigen::Matrix3d& k, int width_px, int height_px, PixelOrigin origin,
                          const std::string& what);

/// One line of a Middlebury multi-view "par" file (Seitz et al., CVPR 2006; DTU copies use it too):
/// name, K, R, t with x ~ K [R | t] X, so cam_from_world.
struct ParCamera {
  std::string name;
  Eigen::Matrix3d k;  ///< as written: pixel origin and image size are the data set's
  Pose cam_from_world;
};
/// Reads "N" and N lines. Throws Error where the text is cut short, a name unsafe or used twice, a
/// number not finite or R no rotation (to kPrintedRotationTolerance).
std::vector<ParCamera> ReadMiddleburyPar(const std::filesystem::path& file);

/// A Strecha ".camera" file (CVPR 2008): K, a row of 3 distortion zeros, R, C, width height, with
/// X_cam = R^T (X_world - C); K belongs to the size written there.
struct StrechaCamera {
  Eigen::Matrix3d k;
  int width_px = 0, height_px = 0;
  Pose cam_from_world;
};
/// Throws Error like ReadMiddleburyPar, and for distortion that is not zero.
StrechaCamera ReadStrechaCamera(const std::filesystem::path& file);

/// One record of an Open3D ".log" trajectory: three integers, then the camera's 4x4 pose in the
/// world (world_from_cam), inverted on reading.
struct LogPose {
  int id = 0;  ///< the first of the three integers
  Pose cam_from_world;
};
/// Throws Error like ReadMiddleburyPar, and when an id comes twice.
std::vector<LogPose> ReadOpen3dLog(const std::filesystem::path& file);

/// A 7-Scenes "pose.txt" or TSDF-fusion pose: 16 numbers, world_from_cam, row-major; inverted on
/// reading.
Pose ReadWorldFromCamText(const std::filesystem::path& file);

/// 9 numbers, row-major, such as TSDF-fusion's camera-intrinsics.txt.
Eigen::Matrix3d ReadMatrix3Text(const std::filesystem::path& file);

}  // namespace dtr::io
