// calib/files/rig_files.h -- cameras and rigs as other calibration programs write them.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "calib/lens_camera.h"
#include "dtr/types/pose.h"

namespace dtr::calib {

/// A camera of such a file.
struct FiledCamera {
  std::string name;  ///< as the file has it; "left" and "right" of a pair without names
  LensCamera camera;
  Pose cam_from_rig;  ///< the rig: the file's reference, of most the first camera
};

struct CameraFile {
  std::vector<FiledCamera> cameras;
  bool metric = false;  ///< the program's unit is the metre
};

/// Reads, by the content:
///   OpenCV's FileStorage and ROS's camera_info: as ReadOpenCvYaml; with M1, D1, M2, D2, R and T
///   (or
///     cameraMatrix1, K1, ... ) a stereo pair, p_second = R p_first + T
///   Kalibr's camchain: cam0, cam1, ...; pinhole with radtan, equidistant, fov or none, and eucm;
///     T_cn_cnm1 chains the cameras; metres
///   ORB-SLAM's settings: PinHole and KannalaBrandt8, Camera1 and Camera2 with Stereo.T_c1_c2
///   mrcal's .cameramodel: LENSMODEL_PINHOLE, OPENCV4, 5, 8 and 12 without prism terms
/// All count pixels from the centre of the first one: cx and cy gain 0.5. Throws Error naming file
/// and field for what is absent, not finite, or a camera model that ours do not contain, by name.
CameraFile ReadCamerasOf(const std::filesystem::path& file);

}  // namespace dtr::calib
