#include "dtr/io/formats/text_cameras.h"

#include <cmath>
#include <set>

#include "dtr/base/error.h"
#include "dtr/base/file_names.h"
#include "dtr/base/text_file.h"
#include "dtr/base/text_rows.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/formats/pose_from_matrix.h"
#include "dtr/io/formats/text_numbers.h"

namespace dtr::io {

using internal::TextNumbers;

namespace {

// A file of numbers alone.
TextNumbers NumbersIn(const std::filesystem::path& file) {
  constexpr std::uintmax_t kMaxBytes = 1u << 20;
  return {NumbersText(ReadTextFile(file, kMaxBytes), file.string()), file.string()};
}

}  // namespace

PinholeCamera CameraFromK(const Eigen::Matrix3d& k, int width_px, int height_px, PixelOrigin origin,
                          const std::string& what) {
  constexpr double kMaxSkewPx = 0.01;  // moves no pixel of a 45 degree half field by more
  const double w = k(2, 2);
  const bool upper = k(1, 0) == 0 && k(2, 0) == 0 && k(2, 1) == 0 && w != 0;
  const Eigen::Matrix3d scaled = k / w;
  if (!k.allFinite() || !upper || !scaled.allFinite()) {
    throw Error(what + ": expected a calibration matrix [fx 0 cx; 0 fy cy; 0 0 1], found another");
  }
  if (!(scaled(0, 0) > 0) || !(scaled(1, 1) > 0)) {
    throw Error(what + ": expected positive focal lengths, found " + std::to_string(scaled(0, 0)) +
                " and " + std::to_string(scaled(1, 1)));
  }
  if (std::abs(scaled(0, 1)) > kMaxSkewPx) {
    throw Error(what + ": expected a skew below 0.01 px, found " + std::to_string(scaled(0, 1)) +
                "; resample the images without skew first");
  }
  const double shift_px = origin == PixelOrigin::kCentre ? 0.5 : 0.0;
  return {width_px,
          height_px,
          scaled(0, 0),
          scaled(1, 1),
          scaled(0, 2) + shift_px,
          scaled(1, 2) + shift_px};
}

std::vector<ParCamera> ReadMiddleburyPar(const std::filesystem::path& file) {
  constexpr int kMaxCameras = 1000000;
  TextNumbers text(file);
  const int count = text.Int("the number of images", 1, kMaxCameras);
  std::vector<ParCamera> cameras;
  std::set<std::string> names;
  for (int i = 0; i < count; ++i) {
    ParCamera camera;
    camera.name = text.Word("an image name");
    const std::string where = text.Where() + camera.name;
    RequireSafeName(camera.name, text.Where());
    if (!names.insert(camera.name).second) {
      throw Error(where + ": expected unique names, found one twice");
    }
    camera.k = text.Matrix3("K (9 numbers)");
    const Eigen::Matrix3d rotation = text.Matrix3("R (9 numbers)");
    camera.cam_from_world =
        PoseFromMatrix(rotation, text.Vector3("t (3 numbers)"), kPrintedRotationTolerance, where);
    cameras.push_back(camera);
  }
  text.ExpectEnd();
  return cameras;
}

StrechaCamera ReadStrechaCamera(const std::filesystem::path& file) {
  TextNumbers text(file);
  StrechaCamera camera;
  camera.k = text.Matrix3("K (9 numbers)");
  if (!text.Vector3("distortion (3 numbers)").isZero(0)) {
    throw Error(text.Where() + "expected distortion 0 0 0, found another; undistort the image");
  }
  const Eigen::Matrix3d world_from_cam = text.Matrix3("R (9 numbers)");
  const Eigen::Vector3d center = text.Vector3("C (3 numbers)");
  camera.cam_from_world =
      PoseFromCenter(world_from_cam, center, kPrintedRotationTolerance, file.string());
  camera.width_px = text.Int("the width", 1, kMaxImageSidePx);
  camera.height_px = text.Int("the height", 1, kMaxImageSidePx);
  text.ExpectEnd();
  return camera;
}

std::vector<LogPose> ReadOpen3dLog(const std::filesystem::path& file) {
  constexpr int kAnyInt = 1 << 30;
  TextNumbers text(file);
  std::vector<LogPose> poses;
  std::set<int> ids;
  while (!text.AtEnd()) {
    LogPose pose;
    pose.id = text.Int("a frame number", 0, kAnyInt);
    const std::string where = text.Where() + "frame " + std::to_string(pose.id);
    if (!ids.insert(pose.id).second) {
      throw Error(where + ": expected unique frame numbers, found one twice");
    }
    text.Int("a frame number", -1, kAnyInt);
    text.Int("a frame number", -1, kAnyInt);
    pose.cam_from_world =
        PoseFromWorldFromCam(text.Matrix4("a 4x4 pose"), kPrintedRotationTolerance, where);
    poses.push_back(pose);
  }
  if (poses.empty()) throw Error(file.string() + ": expected at least one pose, found none");
  return poses;
}

Pose ReadWorldFromCamText(const std::filesystem::path& file) {
  TextNumbers text = NumbersIn(file);
  const Eigen::Matrix4d world_from_cam = text.Matrix4("a 4x4 pose");
  text.ExpectEnd();
  return PoseFromWorldFromCam(world_from_cam, kPrintedRotationTolerance, file.string());
}

Eigen::Matrix3d ReadMatrix3Text(const std::filesystem::path& file) {
  TextNumbers text = NumbersIn(file);
  const Eigen::Matrix3d matrix = text.Matrix3("9 numbers");
  text.ExpectEnd();
  return matrix;
}

}  // namespace dtr::io
