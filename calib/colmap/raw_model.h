// calib/colmap/raw_model.h -- what the readers of both formats hand to the common checks.
#pragma once
#include <cstdint>
#include <filesystem>
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

/// Checks the records against each other and assembles the model.
calib::SfmModel Assembled(RawModel raw);

}  // namespace dtr::colmap
