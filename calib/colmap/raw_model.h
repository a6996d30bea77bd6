// calib/colmap/raw_model.h -- what the readers of both formats hand to the common checks.
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/sfm_model.h"

namespace dtr::colmap {

constexpr std::uintmax_t kLargestFile = std::uintmax_t{64} << 30;

/// A track element as stored: feature `feature` of image `image_id`.
struct RawTrackElement {
  std::uint32_t image_id = 0;
  std::uint32_t feature = 0;
};

/// A rig of COLMAP 3.12 and later: cameras (and other sensors) that are fixed to each other.
struct RawRig {
  struct Sensor {
    bool is_camera = true;
    std::uint32_t id = 0;                 ///< of a camera: its camera id
    std::optional<Pose> sensor_from_rig;  ///< empty where COLMAP does not know it
  };
  std::uint32_t id = 0;
  std::vector<Sensor> sensors;  ///< the first is the rig's frame of reference
};

/// One time at which a rig took images: its pose holds for all of them.
struct RawFrame {
  struct Data {
    bool is_image = true;
    std::uint32_t sensor_id = 0;
    std::uint64_t id = 0;  ///< of an image: its image id
  };
  std::uint32_t id = 0, rig_id = 0;
  Pose rig_from_world;
  std::vector<Data> data;
};

/// The records of a model in the order of the files, not yet checked against each other.
struct RawModel {
  struct Camera {
    std::uint32_t id = 0;
    calib::LensCamera camera;
  };
  struct Point {
    std::uint64_t id = 0;
    calib::SfmPoint point;
    std::vector<RawTrackElement> track;
  };
  std::filesystem::path cameras_file, images_file, points_file;
  std::filesystem::path rigs_file, frames_file;  ///< which older versions do not write
  std::vector<RawRig> rigs;
  std::vector<RawFrame> frames;
  std::vector<Camera> cameras;
  std::vector<calib::SfmImage> images;
  std::vector<Point> points;
};

/// Parsers of the two formats. They throw Error on malformed records and on values that cannot be.
RawModel ReadBinaryModel(const std::filesystem::path& folder);
RawModel ReadTextModel(const std::filesystem::path& folder);
std::vector<RawModel::Camera> ReadTextCameras(const std::filesystem::path& file);

/// Checks of a single record, shared by both formats. `where` starts the message ("file: camera
/// 3").
calib::LensCamera CheckedCamera(const std::string& where, int model_id, std::uint64_t width_px,
                                std::uint64_t height_px, std::vector<double> params);
calib::CameraModel CheckedCameraModel(const std::string& where, int model_id);
[[noreturn]] void RejectEquirectangular(const std::string& where);
Pose CheckedPose(const std::string& where, const double wxyz[4], const double translation[3]);
double CheckedFinite(const std::string& where, double value);

/// Gives the images the poses of their frames, which COLMAP reads instead of those in the images'
/// file. Nothing where the model has neither rigs nor frames. Returns one line where the poses
/// differ, and where rigs stand there without frames; else "". Throws Error where rigs, frames and
/// images do not belong together, and for an image whose camera has no pose in its rig.
std::string TakePosesOfFrames(RawModel& raw);

/// Checks the records against each other and assembles the model.
calib::SfmModel Assembled(RawModel raw);

}  // namespace dtr::colmap
