// Sequences of depth cameras, as research programs write them.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "dtr/base/error.h"
#include "dtr/base/file_names.h"
#include "dtr/base/text_file.h"
#include "dtr/base/text_rows.h"
#include "dtr/io/formats/json_fields.h"
#include "dtr/io/formats/pose_from_matrix.h"
#include "dtr/io/formats/rgbd_parts.h"
#include "dtr/io/formats/text_numbers.h"

namespace dtr::io::internal {
namespace {

std::string IfThere(const fs::path& folder, const std::string& name) {
  std::error_code ignored;
  return fs::is_regular_file(folder / name, ignored) ? name : "";
}

Eigen::Matrix3d MatrixOf(double f_x, double f_y, double c_x, double c_y) {
  Eigen::Matrix3d k = Eigen::Matrix3d::Identity();
  k(0, 0) = f_x, k(1, 1) = f_y, k(0, 2) = c_x, k(1, 2) = c_y;
  return k;
}

/// Of the depth camera against the photos': corners of the image may move by so much of its width
/// when one is taken for the other; more is not registered.
void RequireRegistered(const Eigen::Matrix3d& colour, const Eigen::Matrix3d& depth, double width,
                       double height, double depth_width, double depth_height,
                       const std::string& where) {
  constexpr double kMaxShift = 0.005;
  double worst = 0;
  for (const double x : {0.0, 1.0}) {
    for (const double y : {0.0, 1.0}) {
      const double u = (x * depth_width - depth(0, 2)) / depth(0, 0) * colour(0, 0) + colour(0, 2);
      const double v = (y * depth_height - depth(1, 2)) / depth(1, 1) * colour(1, 1) + colour(1, 2);
      worst = std::max({worst, std::abs(u / width - x), std::abs(v / height - y)});
    }
  }
  if (worst <= kMaxShift) return;
  throw Error(fmt::format(
      "{}: its depth maps are of another camera than its photos: by their intrinsics they would be "
      "off by {:.1f} % of the image; register the depth maps to the photos",
      where, 100 * worst));
}

}  // namespace

// ScanNet, as SensReader exports it: https://github.com/ScanNet/ScanNet. Poses are world_from_cam,
// of infinities where tracking was lost.
RgbdCapture ReadScanNet(const fs::path& folder, const fs::path& images) {
  RgbdCapture capture;
  capture.images = images.empty() ? folder / "color" : images;
  capture.depth = folder / "depth";
  capture.depth_unit_m = kMillimetre;
  const fs::path colour_file = folder / "intrinsic" / "intrinsic_color.txt";
  const fs::path depth_file = folder / "intrinsic" / "intrinsic_depth.txt";
  const auto matrix_in = [](const fs::path& file) {
    TextNumbers text(NumbersOfFile(file), file.string());
    const Eigen::Matrix3d k = text.Matrix4("16 numbers").topLeftCorner<3, 3>();
    text.ExpectEnd();
    return k;
  };
  const Eigen::Matrix3d colour = matrix_in(colour_file);
  // Sizes that the scanner has; exported photos may have been shrunk.
  constexpr double kWidth = 1296, kHeight = 968, kDepthWidth = 640, kDepthHeight = 480;
  std::error_code ignored;
  if (fs::exists(depth_file, ignored)) {
    RequireRegistered(colour, matrix_in(depth_file), kWidth, kHeight, kDepthWidth, kDepthHeight,
                      folder.string());
  }
  for (const std::string& name : NamesIn(folder / "pose")) {
    const fs::path file = folder / "pose" / name;
    if (file.extension() != ".txt") continue;
    const std::string stem = file.stem().string();
    const std::string photo_name = PhotoCalled(capture.images, stem);
    const std::string text = NumbersOfFile(file);
    if (photo_name.empty() || HoldsNoNumber(text)) {
      capture.skipped.emplace_back(stem, photo_name.empty()
                                             ? "no photo in " + capture.images.string()
                                             : "its pose was lost");
      continue;
    }
    TextNumbers numbers(text, file.string());
    const Pose pose = PoseFromWorldFromCam(numbers.Matrix4("a 4x4 pose"), kPrintedRotationTolerance,
                                           file.string());
    numbers.ExpectEnd();
    const SizedImage photo = SizedPhoto(capture.images, photo_name);
    AddFrame(
        photo,
        CameraFor(colour, PixelOrigin::kCentre, photo,
                  {{static_cast<int>(kWidth), static_cast<int>(kHeight)}}, colour_file.string()),
        pose, IfThere(capture.depth, stem + ".png"), capture);
  }
  return capture;
}

namespace {

/// A list of times and files ("time name" a line).
std::map<double, std::string> TimedFiles(const fs::path& file) {
  TextRows rows(ReadTextFile(file, kMaxTextBytes), file.string());
  std::map<double, std::string> files;
  while (rows.Next()) {
    rows.ExpectCells(2, "a time and the name of a file");
    RequireSafeName(rows.cells()[1], rows.Where());
    files[rows.Number(0, "a time")] = rows.cells()[1];
  }
  return files;
}

struct TimedPose {
  Eigen::Quaterniond world_from_cam;
  Eigen::Vector3d centre;
};

std::map<double, TimedPose> TimedPoses(const fs::path& file) {
  TextRows rows(ReadTextFile(file, kMaxTextBytes), file.string());
  std::map<double, TimedPose> poses;
  while (rows.Next()) {
    rows.ExpectCells(8, "time, position and quaternion");
    TimedPose pose;
    for (size_t i = 0; i < 3; ++i) pose.centre[int(i)] = rows.Number(1 + i, "a position");
    for (size_t i = 0; i < 4; ++i) {
      pose.world_from_cam.coeffs()[int(i)] = rows.Number(4 + i, "a quaternion");
    }
    if (!(std::abs(pose.world_from_cam.norm() - 1) <= kPrintedRotationTolerance)) {
      throw Error(fmt::format("{}expected a quaternion of length 1, found {:.4g}", rows.Where(),
                              pose.world_from_cam.norm()));
    }
    pose.world_from_cam.normalize();
    poses[rows.Number(0, "a time")] = pose;
  }
  return poses;
}

/// Between the two poses around a time, which may be so far apart; empty: there are none.
std::optional<TimedPose> PoseAt(const std::map<double, TimedPose>& poses, double time) {
  constexpr double kMaxGap_s = 0.1;
  const auto after = poses.lower_bound(time);
  if (after == poses.end()) return std::nullopt;
  if (after->first == time) return after->second;
  if (after == poses.begin()) return std::nullopt;
  const auto before = std::prev(after);
  if (after->first - before->first > kMaxGap_s) return std::nullopt;
  const double t = (time - before->first) / (after->first - before->first);
  return TimedPose{before->second.world_from_cam.slerp(t, after->second.world_from_cam),
                   (1 - t) * before->second.centre + t * after->second.centre};
}

/// The file whose time is nearest, within what associate.py of the benchmark allows.
std::string FileAt(const std::map<double, std::string>& files, double time) {
  constexpr double kMaxDifference_s = 0.02;
  auto best = files.end();
  const auto after = files.lower_bound(time);
  if (after != files.end()) best = after;
  if (after != files.begin()) {
    const auto before = std::prev(after);
    if (best == files.end() || time - before->first < best->first - time) best = before;
  }
  if (best == files.end() || std::abs(best->first - time) > kMaxDifference_s) return "";
  return best->second;
}

struct KnownCamera {
  const char* folder_holds;
  double fx, fy, cx, cy;
  std::vector<double> k1_k2_p1_p2_k3;
};

/// Published calibrations of the colour cameras: Sturm et al., IROS 2012, and its file formats
/// page.
const std::vector<KnownCamera>& TumCameras() {
  static const std::vector<KnownCamera> cameras = {
      {"freiburg1", 517.3, 516.5, 318.6, 255.3, {0.2624, -0.9531, -0.0054, 0.0026, 1.1633}},
      {"freiburg2", 520.9, 521.0, 325.1, 249.7, {0.2312, -0.7849, -0.0033, -0.0001, 0.9172}},
      {"freiburg3", 535.4, 539.2, 320.1, 247.6, {}}};
  return cameras;
}

/// A camera of a sequence before its photos' sizes are known.
struct SequenceCamera {
  Eigen::Matrix3d k;
  std::vector<double> distortion;
  std::string where;
};

SequenceCamera TumCameraOf(const fs::path& folder) {
  std::error_code ignored;
  const fs::path file = folder / "camera-intrinsics.txt";
  if (fs::exists(file, ignored)) return {ReadMatrix3Text(file), {}, file.string()};
  const std::string name = fs::absolute(folder).lexically_normal().string();
  for (const KnownCamera& camera : TumCameras()) {
    if (name.find(camera.folder_holds) == std::string::npos) continue;
    return {MatrixOf(camera.fx, camera.fy, camera.cx, camera.cy), camera.k1_k2_p1_p2_k3,
            folder.string()};
  }
  throw Error(folder.string() +
              ": expected intrinsics, found none: name the folder as the benchmark does "
              "(freiburg1, 2 or 3), or put the 3x3 matrix of the photos into "
              "camera-intrinsics.txt");
}

/// Of the photo as it is, COLMAP's FULL_OPENCV.
std::optional<Distortion> DistortionFor(const PinholeCamera& camera,
                                        const std::vector<double>& terms) {
  if (terms.empty()) return std::nullopt;
  return Distortion{"FULL_OPENCV",
                    {camera.fx_px(), camera.fy_px(), camera.cx_px(), camera.cy_px(), terms[0],
                     terms[1], terms[2], terms[3], terms[4], 0, 0, 0}};
}

}  // namespace

// TUM RGB-D benchmark: Sturm et al., IROS 2012. Depth is registered to the photos, 5000 to the
// metre; poses are world_from_cam.
RgbdCapture ReadTum(const fs::path& folder, const fs::path& images) {
  constexpr double kMetresPerNumber = 1.0 / 5000;
  RgbdCapture capture;
  capture.images = images.empty() ? folder : images;
  capture.depth = folder;
  capture.depth_unit_m = kMetresPerNumber;
  const SequenceCamera sequence = TumCameraOf(folder);
  const auto photos = TimedFiles(folder / "rgb.txt");
  std::error_code ignored;
  const bool has_depth = fs::exists(folder / "depth.txt", ignored);
  const auto maps = has_depth ? TimedFiles(folder / "depth.txt") : std::map<double, std::string>{};
  const auto poses = TimedPoses(folder / "groundtruth.txt");
  for (const auto& [time, name] : photos) {
    const auto pose = PoseAt(poses, time);
    if (!pose || IfThere(capture.images, name).empty()) {
      capture.skipped.emplace_back(name, pose ? "no such photo" : "no pose around its time");
      continue;
    }
    const SizedImage photo = SizedPhoto(capture.images, name);
    const PinholeCamera camera =
        CameraFor(sequence.k, PixelOrigin::kCentre, photo, {{640, 480}}, sequence.where);
    AddFrame(photo, camera, PoseFrom(pose->world_from_cam, pose->centre, name),
             IfThere(folder, FileAt(maps, time)), capture);
    capture.list.cameras.back().distortion = DistortionFor(camera, sequence.distortion);
  }
  return capture;
}

namespace {

/// Digits at the beginning of a name; empty: none.
std::optional<int> LeadingNumber(const std::string& name) {
  size_t digits = 0;
  while (digits < name.size() && digits < 9 && name[digits] >= '0' && name[digits] <= '9') ++digits;
  if (digits == 0) return std::nullopt;
  return std::stoi(name.substr(0, digits));
}

/// Open3D's PinholeCameraIntrinsic; without a file its default of the same kind of camera.
SequenceCamera Open3dCameraOf(const fs::path& folder, PinholeCamera* full, RgbdCapture& capture) {
  for (const std::string& name : NamesIn(folder)) {
    const fs::path file = folder / name;
    if (file.extension() != ".json" || name.find("intrinsic") == std::string::npos) continue;
    const std::string where = file.string();
    const Json json = ParseJson(ReadTextFile(file, kMaxTextBytes), where);
    const Json& numbers = Field(json, "intrinsic_matrix", where);
    if (!numbers.is_array() || numbers.size() != 9) {
      throw Error(where + ": intrinsic_matrix: expected 9 numbers, found another list");
    }
    Eigen::Matrix3d k;  // column by column
    for (int i = 0; i < 9; ++i) {
      k(i % 3, i / 3) = NumberFrom(numbers[static_cast<size_t>(i)], where);
    }
    *full = CameraFromK(k, IntField(json, "width", 1, kMaxImageSidePx, where),
                        IntField(json, "height", 1, kMaxImageSidePx, where), PixelOrigin::kCentre,
                        where);
    return {k, {}, where};
  }
  capture.notes.push_back(
      folder.string() +
      ": no intrinsics (camera_intrinsic.json): Open3D's default is taken, focal "
      "length 525 px at 640x480");
  const Eigen::Matrix3d k = MatrixOf(525, 525, 319.5, 239.5);
  *full = CameraFromK(k, 640, 480, PixelOrigin::kCentre, folder.string());
  return {k, {}, folder.string()};
}

/// Photos by the number they are called by, else by their order.
std::map<int, std::string> Numbered(const std::vector<std::string>& names) {
  std::map<int, std::string> by_number;
  for (const std::string& name : names) {
    const auto number = LeadingNumber(name);
    if (!number || !by_number.emplace(*number, name).second) {
      by_number.clear();
      break;
    }
  }
  if (!by_number.empty()) return by_number;
  for (size_t i = 0; i < names.size(); ++i) by_number[static_cast<int>(i)] = names[i];
  return by_number;
}

}  // namespace

// Open3D's reconstruction system: a .log trajectory, world_from_cam, depth in millimetres.
RgbdCapture ReadOpen3d(const fs::path& folder, const fs::path& images) {
  RgbdCapture capture;
  capture.images = images.empty() ? FolderOf(folder, {"color", "image", "rgb"}) : images;
  capture.depth = FolderOf(folder, {"depth"});
  capture.depth_unit_m = kMillimetre;
  std::vector<std::string> logs = NamesIn(folder);
  std::erase_if(logs, [](const std::string& name) { return !name.ends_with(".log"); });
  if (logs.size() != 1) {
    throw Error(
        fmt::format("{}: expected one trajectory .log, found {}", folder.string(), logs.size()));
  }
  PinholeCamera full(1, 1, 1, 1, 0, 0);
  const SequenceCamera sequence = Open3dCameraOf(folder, &full, capture);
  const auto photos = Numbered(NamesIn(capture.images)), maps = Numbered(NamesIn(capture.depth));
  for (const LogPose& pose : ReadOpen3dLog(folder / logs.front())) {
    const auto photo_name = photos.find(pose.id);
    if (photo_name == photos.end()) {
      capture.skipped.emplace_back(std::to_string(pose.id),
                                   "no photo in " + capture.images.string());
      continue;
    }
    const SizedImage photo = SizedPhoto(capture.images, photo_name->second);
    const auto map = maps.find(pose.id);
    AddFrame(photo, ScaledToImage(full, photo, sequence.where), pose.cam_from_world,
             map == maps.end() ? "" : map->second, capture);
  }
  return capture;
}

// 7-Scenes: Shotton et al., CVPR 2013. Poses are world_from_cam; 65535 is no depth.
RgbdCapture Read7Scenes(const fs::path& folder, const fs::path& images) {
  RgbdCapture capture;
  capture.images = images.empty() ? folder : images;
  capture.depth = folder;
  capture.depth_unit_m = kMillimetre;
  std::error_code ignored;
  const fs::path matrix = folder / "camera-intrinsics.txt";
  Eigen::Matrix3d k = MatrixOf(585, 585, 320, 240);
  if (fs::exists(matrix, ignored)) {
    k = ReadMatrix3Text(matrix);
  } else {
    capture.notes.push_back(
        folder.string() +
        ": no camera-intrinsics.txt: the data set's default is taken, focal "
        "length 585 px at 640x480; its photos and depth maps are not registered");
  }
  const std::string ending = ".pose.txt";
  for (const std::string& name : NamesIn(folder)) {
    if (!name.ends_with(ending)) continue;
    const std::string frame = name.substr(0, name.size() - ending.size());
    const std::string photo_name = PhotoCalled(capture.images, frame + ".color");
    const std::string text = ReadTextFile(folder / name, kMaxTextBytes);
    if (photo_name.empty() || HoldsNoNumber(text)) {
      capture.skipped.emplace_back(frame, photo_name.empty()
                                              ? "no photo in " + capture.images.string()
                                              : "its pose was lost");
      continue;
    }
    const SizedImage photo = SizedPhoto(capture.images, photo_name);
    AddFrame(photo, CameraFor(k, PixelOrigin::kCentre, photo, {{640, 480}}, matrix.string()),
             ReadWorldFromCamText(folder / name), IfThere(folder, frame + ".depth.png"), capture);
  }
  return capture;
}

}  // namespace dtr::io::internal
