#include "pipeline/novel_frames.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <set>

#include "dtr/base/error.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/formats/transforms_json.h"
#include "dtr/render/camera_path.h"
#include "pipeline/detail/photos/named_files.h"
#include "pipeline/view_names.h"

namespace dtr::pipeline {
namespace {

constexpr int kLargestSidePx = 1 << 14;

int ParseSide(const std::string& size, const std::string& digits) {
  int side = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), side);
  if (error != std::errc() || end != digits.data() + digits.size() || side < 0 ||
      side > kLargestSidePx) {
    throw UsageError(fmt::format("`size` {}: expected WxH in pixels, each 0 to {}, found '{}'",
                                 size, kLargestSidePx, digits));
  }
  return side;
}

// Cameras of a transforms.json without their images, where it says their size.
io::CameraList FromTransforms(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.parent_path();
  io::TransformsPaths paths;
  paths.image_of = [&](const std::string& path) {
    const auto image = FindImage(folder, path);
    return image ? *image : io::SizedImage{path};
  };
  io::CameraList list = io::ReadTransformsJson(file, paths).list;
  for (const io::NamedCamera& named : list.cameras) {
    if (!named.distortion) continue;
    throw Error(
        fmt::format("{}: camera of {} has distortion, and views are rendered without; take "
                    "its k1 and the like out of the file for a view as if undistorted",
                    file.string(), named.name));
  }
  return list;
}

// A file's poses act on p_world - its origin, the set's on p_world - the set's.
std::vector<NovelFrame> FromFile(const DtrSet& set, const std::filesystem::path& file) {
  const io::CameraList list =
      io::IsTransformsJson(file) ? FromTransforms(file) : io::ReadCamerasJson(file);
  const Eigen::Vector3d shift = set.world_origin - list.world_origin;
  std::vector<NovelFrame> cameras;
  for (const io::NamedCamera& named : list.cameras) {
    Pose cam_from_world = named.cam_from_world;
    cam_from_world.translation += cam_from_world.rotation * shift;
    cameras.push_back(
        {std::filesystem::path(named.name).stem().string(), named.camera, cam_from_world});
  }
  if (cameras.empty()) throw Error(file.string() + ": expected at least one camera, found none");
  // Two cameras of one stem (left/0.jpg, right/0.jpg) must not overwrite each other's images.
  std::set<std::string> stems;
  for (const NovelFrame& frame : cameras) stems.insert(frame.name);
  if (stems.size() < cameras.size()) {
    for (size_t i = 0; i < cameras.size(); ++i) {
      cameras[i].name = fmt::format("{:06}_{}", i, cameras[i].name);
    }
  }
  return cameras;
}

}  // namespace

PinholeCamera WithSize(const PinholeCamera& camera, const std::string& size) {
  if (size.empty()) return camera;
  const size_t x = size.find('x');
  if (x == std::string::npos) {
    throw UsageError(fmt::format("`size` {}: expected WxH, such as 1280x720", size));
  }
  int width = ParseSide(size, size.substr(0, x));
  int height = ParseSide(size, size.substr(x + 1));
  if (width == 0 && height == 0) {
    throw UsageError(fmt::format("`size` {}: expected at least one side above 0", size));
  }
  const double aspect = static_cast<double>(camera.width_px()) / camera.height_px();
  if (width == 0) width = std::max(1, static_cast<int>(std::lround(height * aspect)));
  if (height == 0) height = std::max(1, static_cast<int>(std::lround(width / aspect)));
  return camera.Resized(width, height);
}

std::vector<NovelFrame> NovelFrames(const DtrSet& set, const NovelCameraRequest& request) {
  std::vector<NovelFrame> cameras;
  if (!request.like.empty()) {
    const View& view = FindView(set, request.like);
    cameras.push_back({view.id, view.camera, view.cam_from_world});
  } else if (!request.camera_file.empty()) {
    cameras = FromFile(set, request.camera_file);
    if (cameras.size() > 1) {
      throw UsageError(
          fmt::format("`camera` {}: expected one camera, found {}; give `path` for several",
                      request.camera_file.string(), cameras.size()));
    }
  } else if (!request.path_file.empty()) {
    cameras = FromFile(set, request.path_file);
  } else if (request.fly_through_frames > 0) {
    int index = 0;
    for (const NovelCamera& step : FlyThrough(set, request.fly_through_frames)) {
      cameras.push_back({fmt::format("{:06}", index++), step.camera, step.cam_from_world});
    }
  } else {
    throw UsageError("expected one of `like`, `camera`, `path` and `fly_through`");
  }
  for (NovelFrame& camera : cameras) camera.camera = WithSize(camera.camera, request.size);
  return cameras;
}

}  // namespace dtr::pipeline
