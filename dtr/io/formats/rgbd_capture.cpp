#include "dtr/io/formats/rgbd_capture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "dtr/base/error.h"
#include "dtr/base/file_names.h"
#include "dtr/base/text_file.h"
#include "dtr/base/text_rows.h"
#include "dtr/io/formats/plausible_intrinsics.h"
#include "dtr/io/formats/pose_from_matrix.h"
#include "dtr/io/formats/rgbd_parts.h"
#include "dtr/io/image_io.h"

namespace dtr::io {
namespace internal {
std::vector<std::string> NamesIn(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    if (entry->is_regular_file(error)) names.push_back(entry->path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::string PhotoCalled(const fs::path& folder, const std::string& stem) {
  for (const char* extension : {".jpg", ".jpeg", ".png", ".JPG", ".JPEG", ".PNG"}) {
    std::error_code ignored;
    if (fs::is_regular_file(folder / (stem + extension), ignored)) return stem + extension;
  }
  return "";
}

std::string DepthCalled(const fs::path& folder, const std::string& stem, const char* extension) {
  std::error_code ignored;
  const std::string name = stem + extension;
  return fs::is_regular_file(folder / name, ignored) ? name : "";
}

void TakeConfidence(const fs::path& folder, const char* extension, RgbdCapture& capture) {
  std::error_code ignored;
  if (fs::is_directory(folder, ignored)) capture.confidence = {folder, extension};
}

fs::path FolderOf(const fs::path& capture, std::initializer_list<const char*> names) {
  std::string all;
  for (const char* name : names) {
    std::error_code ignored;
    if (fs::is_directory(capture / name, ignored)) return capture / name;
    all += (all.empty() ? "" : " or ") + std::string(name);
  }
  throw Error(fmt::format("{}: expected a folder {}, found none", capture.string(), all));
}

SizedImage SizedPhoto(const fs::path& folder, const std::string& name) {
  RequireSafeName(name, folder.string());
  const ImageHeader header = ReadImageHeader(folder / name);
  return {name, header.width_px, header.height_px, header.exif_orientation};
}

std::string NumbersOfFile(const fs::path& file) {
  return NumbersText(ReadTextFile(file, kMaxTextBytes), file.string());
}

bool HoldsNoNumber(std::string_view text) {
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower.find("inf") != std::string::npos || lower.find("nan") != std::string::npos;
}

Pose PoseFrom(const Eigen::Quaterniond& world_from_cam, const Eigen::Vector3d& centre,
              const std::string& where) {
  if (!(std::abs(world_from_cam.norm() - 1) <= kPrintedRotationTolerance)) {
    throw Error(fmt::format("{}: expected a quaternion of length 1, found {:.4g}", where,
                            world_from_cam.norm()));
  }
  return PoseFromCenter(world_from_cam.normalized().toRotationMatrix(), centre, kRotationTolerance,
                        where);
}

Pose PoseFromGl(const Eigen::Matrix4d& world_from_cam, const std::string& where) {
  Eigen::Matrix4d turned = world_from_cam;
  turned.middleCols<2>(1) *= -1;
  return PoseFromWorldFromCam(turned, kPrintedRotationTolerance, where);
}

PinholeCamera CameraFor(const Eigen::Matrix3d& k, PixelOrigin origin, const SizedImage& photo,
                        const std::vector<std::pair<int, int>>& sizes, const std::string& where) {
  constexpr double kNearMiddle = 0.1;  // of the side: no lens of a phone is off by more
  const auto fits = [&](int width, int height) {
    return std::abs(k(0, 2) / width - 0.5) <= kNearMiddle &&
           std::abs(k(1, 2) / height - 0.5) <= kNearMiddle;
  };
  std::vector<std::pair<int, int>> all = {{photo.width_px, photo.height_px}};
  all.insert(all.end(), sizes.begin(), sizes.end());
  for (const auto& [width, height] : all) {
    if (!fits(width, height)) continue;
    return ScaledToImage(CameraFromK(k, width, height, origin, where), photo,
                         where + ": " + photo.name);
  }
  throw Error(fmt::format(
      "{}: its principal point, {:.1f}, {:.1f} px, is not near the middle of {}, which has {}x{} "
      "pixels; give photos of the size that the intrinsics are of",
      where, k(0, 2), k(1, 2), photo.name, photo.width_px, photo.height_px));
}

void AddFrame(const SizedImage& photo, const PinholeCamera& camera, const Pose& cam_from_world,
              const std::string& depth_file, RgbdCapture& capture) {
  NamedCamera named;
  named.name = photo.name;
  RequirePlausibleFocal(camera.fx_px(), camera.fy_px(), camera.width_px(), camera.height_px(),
                        (capture.images / photo.name).string());
  named.depth_file = depth_file;
  named.camera = camera;
  named.cam_from_world = cam_from_world;
  capture.list.cameras.push_back(std::move(named));
}

namespace {

/// Reads all confidence maps and says what they leave out. Such that leave nothing over say
/// nothing, and are not used.
void CheckConfidence(const fs::path& folder, RgbdCapture& capture) {
  double low = 0;
  int maps = 0;
  for (const NamedCamera& camera : capture.list.cameras) {
    if (camera.depth_file.empty()) continue;
    const fs::path file = capture.confidence.FileOf(camera.depth_file);
    if (file.empty()) continue;
    low += LowConfidenceShare(file);
    ++maps;
  }
  if (maps == 0) {
    capture.confidence = {};
    return;
  }
  const double share = low / maps;
  if (share == 1) {
    capture.notes.push_back(folder.string() +
                            ": its confidence maps are 0 throughout, and are not used");
    capture.confidence = {};
    return;
  }
  capture.confidence_line = fmt::format(
      "{}: depth of the lowest confidence is left out, {:.1f} % of the pixels of {} maps",
      folder.string(), 100 * share, maps);
  capture.notes.push_back(capture.confidence_line);
}

/// What all layouts are checked for once they are read.
void Check(const fs::path& folder, RgbdCapture& capture) {
  capture.list.unit = LengthUnit::kMetre;
  const size_t cameras = capture.list.cameras.size();
  if (!capture.skipped.empty()) {
    const auto& [name, reason] = capture.skipped.front();
    capture.notes.push_back(fmt::format("{}: {} of {} frames are left out, first {}: {}",
                                        folder.string(), capture.skipped.size(),
                                        cameras + capture.skipped.size(), Printable(name), reason));
  }
  if (cameras == 0) {
    throw Error(capture.skipped.empty()
                    ? folder.string() + ": expected frames with a photo and a pose, found none"
                    : capture.notes.back() + "; none is left");
  }
  const auto without = std::count_if(capture.list.cameras.begin(), capture.list.cameras.end(),
                                     [](const NamedCamera& c) { return c.depth_file.empty(); });
  if (without > 0) {
    capture.notes.push_back(
        fmt::format("{}: {} of {} photos have no depth map", folder.string(), without, cameras));
  }
  CheckConfidence(folder, capture);
}

}  // namespace
}  // namespace internal

namespace {

using Reader = RgbdCapture (*)(const std::filesystem::path&, const std::filesystem::path&);

struct Layout {
  const char* name;
  std::vector<const char*> files;  ///< all there: it is this layout
  Reader read;
};

const std::vector<Layout>& Layouts() {
  static const std::vector<Layout> layouts = {
      {"polycam", {"keyframes"}, internal::ReadPolycam},
      {"record3d", {"metadata.json", "rgb"}, internal::ReadRecord3d},
      {"stray-scanner", {"camera_matrix.csv", "odometry.csv"}, internal::ReadStrayScanner},
      {"3d-scanner-app", {}, internal::Read3dScannerApp},
      {"arkitscenes", {"lowres_wide.traj"}, internal::ReadArkitScenes},
      {"scannet", {"pose", "intrinsic", "color"}, internal::ReadScanNet},
      {"tum", {"rgb.txt", "groundtruth.txt"}, internal::ReadTum},
      {"open3d", {}, internal::ReadOpen3d},
      {"7scenes", {}, internal::Read7Scenes}};
  return layouts;
}

bool EndsLike(const std::filesystem::path& folder, const char* end) {
  const std::vector<std::string> names = internal::NamesIn(folder);
  return std::any_of(names.begin(), names.end(),
                     [&](const std::string& name) { return name.ends_with(end); });
}

}  // namespace

std::vector<std::string> RgbdFormats() {
  std::vector<std::string> names;
  for (const Layout& layout : Layouts()) names.emplace_back(layout.name);
  return names;
}

bool IsRgbdFormat(const std::string& format) {
  return std::any_of(Layouts().begin(), Layouts().end(),
                     [&](const Layout& layout) { return layout.name == format; });
}

std::string RgbdFormatOf(const std::filesystem::path& capture) {
  if (capture.extension() == ".r3d") return "record3d";
  std::error_code ignored;
  if (!std::filesystem::is_directory(capture, ignored)) return "";
  for (const Layout& layout : Layouts()) {
    if (layout.files.empty()) continue;
    if (std::all_of(layout.files.begin(), layout.files.end(), [&](const char* file) {
          return std::filesystem::exists(capture / file, ignored);
        })) {
      return layout.name;
    }
  }
  if (internal::IsUnpackedRecord3d(capture)) return "record3d";
  if (internal::Is3dScannerApp(capture)) return "3d-scanner-app";
  if (EndsLike(capture, ".pose.txt")) return "7scenes";
  if (std::filesystem::is_directory(capture / "depth", ignored) && EndsLike(capture, ".log")) {
    return "open3d";
  }
  return "";
}

RgbdCapture ReadRgbdCapture(const std::filesystem::path& capture, const std::string& format,
                            const std::filesystem::path& images) {
  for (const Layout& layout : Layouts()) {
    if (layout.name != format) continue;
    RgbdCapture read = layout.read(capture, images);
    internal::Check(capture, read);
    return read;
  }
  throw UsageError("RGB-D captures: no layout is called '" + format + "'");
}

}  // namespace dtr::io
