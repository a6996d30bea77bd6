// Captures of phones, whose poses and intrinsics are ARKit's.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>

#include "dtr/base/error.h"
#include "dtr/base/text_file.h"
#include "dtr/base/text_rows.h"
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
    const Json json = ParseJson(ReadTextFile(file, kMaxTextBytes), file.string());
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

/// Intrinsics that a row of odometry.csv has of its own frame: the phone focuses while it records.
/// Older versions of the program have no such columns; cells may be empty.
std::optional<Eigen::Matrix3d> OwnIntrinsics(const TextTable& odometry) {
  Eigen::Matrix3d k = Eigen::Matrix3d::Identity();
  const std::pair<const char*, double*> values[] = {
      {"fx", &k(0, 0)}, {"fy", &k(1, 1)}, {"cx", &k(0, 2)}, {"cy", &k(1, 2)}};
  for (const auto& [name, value] : values) {
    const auto column = odometry.Find({name});
    if (!column || odometry.Cell(*column).empty()) return std::nullopt;
    *value = odometry.Number(*column);
  }
  return k;
}

std::string StrayFrameName(const TextTable& odometry) {
  constexpr double kMaxFrame = 999999;
  const double frame = odometry.Number(odometry.Column({"frame"}));
  if (frame >= 0 && frame <= kMaxFrame && frame == std::floor(frame)) {
    return fmt::format("{:06d}", static_cast<int>(frame));
  }
  throw Error(
      fmt::format("{}expected a frame number from 0 to 999999, found {}", odometry.Where(), frame));
}

Pose StrayPose(const TextTable& odometry) {
  const auto value = [&](const char* name) { return odometry.Number(odometry.Column({name})); };
  const Eigen::Quaterniond world_from_cam(value("qw"), value("qx"), value("qy"), value("qz"));
  return PoseFrom(world_from_cam, {value("x"), value("y"), value("z")},
                  fmt::format("{}frame {}", odometry.Where(), StrayFrameName(odometry)));
}

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
  const fs::path matrix = folder / "camera_matrix.csv", file = folder / "odometry.csv";
  const Eigen::Matrix3d k_of_all = ReadMatrix3Text(matrix);
  TextTable odometry(ReadTextFile(file, kMaxTextBytes), file.string());
  for (const char* name : {"frame", "x", "y", "z", "qx", "qy", "qz", "qw"}) odometry.Column({name});
  while (odometry.Next()) {
    const std::string stem = StrayFrameName(odometry);
    const Pose cam_from_world = StrayPose(odometry);
    const std::string photo_name = PhotoCalled(capture.images, stem);
    if (photo_name.empty()) {
      capture.skipped.emplace_back(stem, "no photo in " + capture.images.string());
      continue;
    }
    const SizedImage photo = SizedPhoto(capture.images, photo_name);
    const auto own = OwnIntrinsics(odometry);
    const std::string where = own ? odometry.Where() + "intrinsics" : matrix.string();
    AddFrame(photo,
             CameraFor(own.value_or(k_of_all), PixelOrigin::kCorner, photo, {{1920, 1440}}, where),
             cam_from_world, DepthCalled(capture.depth, stem, ".png"), capture);
  }
  TakeConfidence(folder / "confidence", ".png", capture);
  return capture;
}

namespace {

constexpr std::string_view kFramePrefix = "frame_", kDepthPrefix = "depth_", kConfPrefix = "conf_";

/// What stands in "frame_N.json" for N; empty: the name is another one.
std::string ScannerFrame(const std::string& name) {
  const fs::path file = name;
  const std::string stem = file.stem().string();
  if (file.extension() != ".json" || !stem.starts_with(kFramePrefix)) return "";
  return stem.substr(kFramePrefix.size());
}

/// A matrix as the list of its numbers, row by row.
template <int kSide>
Eigen::Matrix<double, kSide, kSide> ListedMatrix(const Json& json, const char* key,
                                                 const std::string& where) {
  const Json& list = Field(json, key, where);
  if (!list.is_array() || list.size() != size_t{kSide * kSide}) {
    throw Error(fmt::format("{}.{}: expected a list of {} numbers, found another", where, key,
                            kSide * kSide));
  }
  Eigen::Matrix<double, kSide, kSide> matrix;
  for (int i = 0; i < kSide * kSide; ++i) {
    matrix(i / kSide, i % kSide) =
        NumberFrom(list[static_cast<size_t>(i)], fmt::format("{}.{}[{}]", where, key, i));
  }
  return matrix;
}

}  // namespace

bool Is3dScannerApp(const fs::path& folder) {
  const std::vector<std::string> names = NamesIn(folder);
  return std::any_of(names.begin(), names.end(), [&](const std::string& name) {
    const std::string frame = ScannerFrame(name);
    return !frame.empty() &&
           !DepthCalled(folder, std::string(kDepthPrefix) + frame, ".png").empty();
  });
}

// 3D Scanner App, "All data": https://github.com/laanlabs/3dScannerApp_samples. Every frame has its
// depth and pose, some have photos. Poses are ARKit's, world_from_cam; intrinsics are of photos of
// 1920x1440, whatever size was exported.
RgbdCapture Read3dScannerApp(const fs::path& folder, const fs::path& images) {
  RgbdCapture capture;
  capture.images = images.empty() ? folder : images;
  capture.depth = folder;
  capture.depth_unit_m = kMillimetre;
  for (const std::string& name : NamesIn(folder)) {
    const std::string frame = ScannerFrame(name);
    if (frame.empty()) continue;
    const std::string stem = std::string(kFramePrefix) + frame;
    const std::string photo_name = PhotoCalled(capture.images, stem);
    if (photo_name.empty()) {
      capture.skipped.emplace_back(stem, "no photo in " + capture.images.string());
      continue;
    }
    const std::string where = (folder / name).string();
    const Json json = ParseJson(ReadTextFile(folder / name, kMaxTextBytes), where);
    const SizedImage photo = SizedPhoto(capture.images, photo_name);
    AddFrame(photo,
             CameraFor(ListedMatrix<3>(json, "intrinsics", where), PixelOrigin::kCorner, photo,
                       {{1920, 1440}}, where + ".intrinsics"),
             PoseFromGl(ListedMatrix<4>(json, "cameraPoseARFrame", where), where),
             DepthCalled(capture.depth, std::string(kDepthPrefix) + frame, ".png"), capture);
  }
  TakeConfidence(folder, ".png", capture);
  capture.confidence.prefix = {std::string(kDepthPrefix), std::string(kConfPrefix)};
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
  TextRows rows(ReadTextFile(file, kMaxTextBytes), file.string());
  std::map<long, Pose> poses;  // by milliseconds
  while (rows.Next()) {
    rows.ExpectCells(7, "time, rotation and translation");
    const double seconds = rows.Number(0, "a time");
    Eigen::Vector3d turn, shift;
    for (size_t i = 0; i < 3; ++i) {
      turn[static_cast<int>(i)] = rows.Number(1 + i, "a rotation");
      shift[static_cast<int>(i)] = rows.Number(4 + i, "a translation");
    }
    if (!(std::abs(seconds) < 1e9)) {
      throw Error(rows.Where() + "expected a time in seconds, found one beyond all recordings");
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
