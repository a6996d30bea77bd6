// calib/files/opencv_yaml.h -- cameras as OpenCV's programs write them.
#pragma once
#include <filesystem>

#include "calib/lens_camera.h"
#include "dtr/types/pose.h"

namespace dtr::calib {

/// Reads a camera from a YAML or XML file of OpenCV's FileStorage (image_width, image_height,
/// camera_matrix, distortion_coefficients, or other common names of these, where one field alone
/// has such a name; fisheye_model: 1 for fisheyes), or of ROS (the same names, distortion_model
/// plumb_bob, rational_polynomial or equidistant). OpenCV has the centre of the first pixel at (0,
/// 0), we at (0.5, 0.5): cx and cy gain half a pixel. 0, 4, 5 or 8 coefficients are taken, and up
/// to 14 when those of thin prisms and tilted sensors are zero. Throws Error naming file and field:
/// absent fields, skew, other sizes, numbers that are not finite.
LensCamera ReadOpenCvYaml(const std::filesystem::path& file);

/// Writes such a file, atomically; doubles read back exactly, but for the half pixel.
/// Throws Error for lens models that OpenCV does not have (FOV, THIN_PRISM_FISHEYE).
void WriteOpenCvYaml(const std::filesystem::path& file, const LensCamera& camera);

/// Writes two cameras as OpenCV's stereo_calib sample names them: M1, D1, M2, D2, R and T with
/// p_second = R p_first + T, and image_width, image_height and fisheye_model of both. Atomically;
/// throws as WriteOpenCvYaml does, and where sizes differ or one alone is a fisheye.
void WriteOpenCvStereoYaml(const std::filesystem::path& file, const LensCamera& first,
                           const LensCamera& second, const Pose& second_from_first);

}  // namespace dtr::calib
