// Captures of phones, whose poses and intrinsics are ARKit's.
#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <map>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/formats/json_fields.h"
#include "dtr/io/formats/pose_from_matrix.h"
#include "dtr/io/formats/rgbd_parts.h"
#include "dtr/io/formats/text_numbers.h"

namespace dtr::io::internal {
namespace {

Eigen::Matrix4d PolycamPose(const Json& json, const std::string& where) {
  Eigen::Matrix4d pose = Eigen::Matrix4d::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      pose(row, column) = NumberField(json, fmt::format("t_{}{}", row, column).c_str(), where);
    }
  }
  return pose;
}

}  // namespace

// Polycam, "raw data": https://github.com/PolyCam/polyform. Poses are ARKit's, world_from_cam.
RgbdCapture ReadPolycam(const fs::path& folder, const fs::path& images) {
  const fs::path keyframes = folder / "keyframes";
  std::error_code ignored;
  // Cameras that Polycam has adjusted come with photos of their own.
  const bool corrected = fs::is_directory(keyframes / "corrected_cameras", ignored) &&
                         fs::is_directory(keyframes / "corrected_images", ignored);
  RgbdCapture capture;
  capture.images =
      !images.empty() ? images : keyframes / (corrected ? "corrected_images" : "images");
  capture.depth = keyframes / "depth";
  capture.depth_unit_m = kMillimetre;
  const fs::path cameras = FolderOf(keyframes, {corrected ? "corrected_cameras" : "cameras"});
  if (!corrected) {
    capture.notes.push_back(folder.string() +
                            ": no corrected_cameras: poses are those of the phone while it moved, "
                            "which Polycam had not adjusted when this was exported");
  }
  for (const std::string& name : NamesIn(cameras)) {
    const fs::path file = cameras / name;
    if (file.extension() != ".json") continue;
    const std::string stem = file.stem().string();
    const std::string photo_name = PhotoCalled(capture.images, stem);
    if (photo_name.empty()) {
      capture.skipped.emplace_back(stem, "no photo in " + capture.images.string());
      continue;
    }
    const Json json = ParseJson(ReadFile(file, kMaxTextBytes), file.string());
    const SizedImage photo = SizedPhoto(capture.images, photo_name);
    Eigen::Matrix3d k = Eigen::Matrix3d::Identity();
    k(0, 0) = NumberField(json, "fx", file.string()),
         k(1, 1) = NumberField(json, "fy", file.string());
    k(0, 2) = NumberField(json, "cx", file.string()),
         k(1, 2) = NumberField(json, "cy", file.string());
    const PinholeCamera full =
        CameraFromK(k, IntField(json, "width", 1, kMaxImageSidePx, file.string()),
                    IntField(json, "height", 1, kMaxImageSidePx, file.string()),
                    PixelOrigin::kCorner, file.string());
    AddFrame(photo, ScaledToImage(full, photo, file.string()),
             PoseFromGl(PolycamPose(json, file.string()), file.string()),
             DepthCalled(capture.depth, stem, ".png"), capture);
  }
  TakeConfidence(keyframes / "confidence", ".png", capture);
  return capture;
}

namespace {

/// odometry.csv: a header with names of columns, then a line of numbers a frame.
class Odometry {
 public:
  explicit Odometry(const fs::path& file) : source_(file.string()), text_(PlainText(file)) {
    const size_t end = text_.find('\n');
    TextNumbers header(text_.substr(0, end), source_);
    for (size_t i = 0; !header.AtEnd(); ++i) columns_[header.Word("a column")] = i;
    for (const char* column : {"frame", "x", "y", "z", "qx", "qy", "qz", "qw"}) {
      if (columns_.contains(column)) continue;
      throw Error(
          fmt::format("{}: expected a column {}, found none in its first line", source_, column));
    }
    text_ = end == std::string::npos ? "" : text_.substr(end + 1);
  }

  template <typename OnFrame>
  void ForEach(OnFrame on_frame) const {
    TextNumbers numbers(text_, source_);
    std::vector<double> row(columns_.size());
    while (!numbers.AtEnd()) {
      for (double& number : row) number = numbers.Number("a number for each column");
      on_frame([&](const char* column) { return row[columns_.at(column)]; });
    }
  }

 private:
  std::string source_, text_;
  std::map<std::string, size_t> columns_;
};

}  // namespace

// Stray Scanner: https://github.com/strayrobots/scanner, docs/format.md. Its program turns ARKit's
// axes to ours (OdometryEncoder.swift).
RgbdCapture ReadStrayScanner(const fs::path& folder, const fs::path& images) {
  RgbdCapture capture;
  capture.images = images.empty() ? folder / "rgb" : images;
  capture.depth = folder / "depth";
  capture.depth_unit_m = kMillimetre;
  std::error_code ignored;
  if (!fs::is_directory(capture.images, ignored)) {
    throw Error(fmt::format(
        "{}: its photos are the frames of rgb.mp4; extract them: cd {} && mkdir rgb && ffmpeg -i "
        "rgb.mp4 -start_number 0 -q:v 2 rgb/%06d.jpg",
        folder.string(), folder.string()));
  }
  const fs::path matrix = folder / "camera_matrix.csv";
  TextNumbers numbers(PlainText(matrix), matrix.string());
  const Eigen::Matrix3d k = numbers.Matrix3("9 numbers");
  numbers.ExpectEnd();
  const std::string where = (folder / "odometry.csv").string();
  Odometry(folder / "odometry.csv").ForEach([&](const auto& value) {
    const double frame = value("frame");
    if (!(frame >= 0) || frame > 999999 || frame != std::floor(frame)) {
      throw Error(
          fmt::format("{}: expected a frame number from 0 to 999999, found {}", where, frame));
    }
    const std::string stem = fmt::format("{:06d}", static_cast<int>(frame));
    const std::string photo_name = PhotoCalled(capture.images, stem);
    if (photo_name.empty()) {
      capture.skipped.emplace_back(stem, "no photo in " + capture.images.string());
      return;
    }
    const SizedImage photo = SizedPhoto(capture.images, photo_name);
    const Eigen::Quaterniond turn(value("qw"), value("qx"), value("qy"), value("qz"));
    AddFrame(photo, CameraFor(k, PixelOrigin::kCorner, photo, {{1920, 1440}}, matrix.string()),
             PoseFrom(turn, {value("x"), value("y"), value("z")}, where + ": frame " + stem),
             DepthCalled(capture.depth, stem, ".png"), capture);
  });
  TakeConfidence(folder / "confidence", ".png", capture);
  return capture;
}

// ARKitScenes: https://github.com/apple/ARKitScenes, DATA.md. The trajectory is cam_from_world, as
// axis and angle; photos are called VIDEO_SECONDS.png, with milliseconds.
RgbdCapture ReadArkitScenes(const fs::path& folder, const fs::path& images) {
  RgbdCapture capture;
  capture.images = images.empty() ? FolderOf(folder, {"lowres_wide"}) : images;
  capture.depth = folder / "lowres_depth";
  capture.depth_unit_m = kMillimetre;
  const fs::path intrinsics = FolderOf(folder, {"lowres_wide_intrinsics"});
  const fs::path file = folder / "lowres_wide.traj";
  TextNumbers numbers(PlainText(file), file.string());
  std::map<long, Pose> poses;  // by milliseconds
  while (!numbers.AtEnd()) {
    const double seconds = numbers.Number("a time");
    const Eigen::Vector3d turn = numbers.Vector3("a rotation (3 numbers)");
    const Eigen::Vector3d shift = numbers.Vector3("a translation (3 numbers)");
    if (!(std::abs(seconds) < 1e9)) {
      throw Error(numbers.Where() + "expected a time in seconds, found one beyond all recordings");
    }
    const double angle = turn.norm();
    const Eigen::Vector3d axis =
        angle > 0 ? Eigen::Vector3d(turn / angle) : Eigen::Vector3d::UnitX();
    poses[std::lround(1000 * seconds)] =
        PoseFromMatrix(Eigen::AngleAxisd(angle, axis).toRotationMatrix(), shift, kRotationTolerance,
                       file.string());
  }
  // Photos are taken more often than the trajectory has poses.
  const auto pose_at = [&](long ms) -> const Pose* {
    for (const long near : {ms, ms - 1, ms + 1}) {
      if (const auto found = poses.find(near); found != poses.end()) return &found->second;
    }
    return nullptr;
  };
  for (const std::string& name : NamesIn(capture.images)) {
    const std::string stem = fs::path(name).stem().string();
    const size_t split = stem.rfind('_');
    double seconds = 0;
    const char* begin = stem.data() + (split == std::string::npos ? 0 : split + 1);
    const auto [end, error] = std::from_chars(begin, stem.data() + stem.size(), seconds);
    if (error != std::errc() || end != stem.data() + stem.size() || !(std::abs(seconds) < 1e9)) {
      capture.skipped.emplace_back(name, "its name ends in no time");
      continue;
    }
    const Pose* pose = pose_at(std::lround(1000 * seconds));
    const fs::path pincam = intrinsics / (stem + ".pincam");
    std::error_code ignored;
    if (pose == nullptr || !fs::is_regular_file(pincam, ignored)) {
      capture.skipped.emplace_back(
          name, pose == nullptr ? "no pose at its time" : "no intrinsics " + pincam.string());
      continue;
    }
    TextNumbers camera(pincam);
    const int width = camera.Int("the width", 1, kMaxImageSidePx);
    const int height = camera.Int("the height", 1, kMaxImageSidePx);
    Eigen::Matrix3d k = Eigen::Matrix3d::Identity();
    k(0, 0) = camera.Number("fx"), k(1, 1) = camera.Number("fy");
    k(0, 2) = camera.Number("cx"), k(1, 2) = camera.Number("cy");
    camera.ExpectEnd();
    const SizedImage photo = SizedPhoto(capture.images, name);
    AddFrame(photo,
             ScaledToImage(CameraFromK(k, width, height, PixelOrigin::kCorner, pincam.string()),
                           photo, pincam.string()),
             *pose, DepthCalled(capture.depth, stem, ".png"), capture);
  }
  TakeConfidence(folder / "confidence", ".png", capture);
  return capture;
}

}  // namespace dtr::io::internal
