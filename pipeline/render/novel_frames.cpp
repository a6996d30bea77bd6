#include "pipeline/render/novel_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>

#include "dtr/base/error.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/formats/llff.h"
#include "dtr/io/formats/npy.h"
#include "dtr/io/formats/rgbd_capture.h"
#include "dtr/io/formats/transforms_json.h"
#include "dtr/io/set_io.h"
#include "dtr/render/camera_path.h"
#include "dtr/render/view_stream.h"
#include "pipeline/core/cameras/camera_distortion.h"
#include "pipeline/core/cameras/camera_formats.h"
#include "pipeline/core/cameras/foreign_cameras.h"
#include "pipeline/core/photos/named_files.h"
#include "pipeline/core/view_names.h"

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
  return io::ReadTransformsJson(file, paths).list;
}

// Poses and sizes of LLFF's file, whose rows have no names: they are counted.
io::CameraList FromLlff(const std::filesystem::path& file) {
  constexpr size_t kRow = 17, kHeight = 4, kWidth = 9;
  const io::NpyArray rows = io::ReadNpy(file);
  std::vector<io::SizedImage> images;
  const bool is_table = rows.shape.size() == 2 && rows.shape[1] == kRow;
  for (size_t i = 0; is_table && i < rows.shape[0]; ++i) {
    const auto side = [&](size_t at) {
      const double px = rows.values[i * kRow + at];
      return px >= 1 && px <= io::kMaxImageSidePx ? static_cast<int>(px) : 1;
    };
    images.push_back({fmt::format("{:06}", i), side(kWidth), side(kHeight)});
  }
  return io::ReadLlff(file, std::move(images)).list;  // whatever is wrong is said there
}

// Cameras of any program, with the size that their file says. A COLMAP model's are as they are.
io::CameraList ReadCameras(const std::filesystem::path& file, std::vector<std::string>* notes) {
  const CameraFormat format = FormatOf(file, "", "cameras");
  const std::string kind = format.name;
  if (kind == "cameras-json") return io::ReadCamerasJson(file);
  if (kind == "nerf") return FromTransforms(file);
  if (io::IsRgbdFormat(kind)) return io::ReadRgbdCapture(file, kind).list;
  if (kind == "llff") return FromLlff(file);
  io::CameraList list;
  if (format.read != nullptr) {
    list = CamerasWithoutPhotos(format.read(file), file.string());
  } else {
    const calib::SfmModel model = ReadGivenModel(file, notes);
    for (const calib::SfmImage& image : model.images) {
      io::NamedCamera named;
      named.name = image.name;
      SetCameraModel(named, model.cameras.at(image.camera_id));
      named.cam_from_world = image.cam_from_world;
      list.cameras.push_back(named);
    }
  }
  return list;
}

// A file's poses act on p_world - its origin, the set's on p_world - the set's.
std::vector<NovelFrame> FromFile(const DtrSet& set, const std::filesystem::path& file,
                                 std::vector<std::string>* notes) {
  const io::CameraList list = ReadCameras(file, notes);
  const Eigen::Vector3d shift = set.world_origin - list.world_origin;
  std::vector<NovelFrame> cameras;
  const auto distorted = std::count_if(list.cameras.begin(), list.cameras.end(),
                                       [](const auto& named) { return named.distortion; });
  if (distorted > 0 && notes != nullptr) {
    notes->push_back(fmt::format(
        "{}: {} of its cameras have distortion; frames are rendered without, as if undistorted",
        file.string(), distorted));
  }
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

DepthLoader DepthLoaderOf(const std::filesystem::path& set_folder) {
  return [set_folder](View& view) {
    try {
      io::LoadPixels(set_folder, view, {.images = false, .completed = true});
    } catch (const Error&) {
      DropPixels(view);
    }
  };
}

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

std::vector<NovelFrame> NovelFrames(const DtrSet& set, const NovelCameraRequest& request,
                                    std::vector<std::string>* notes) {
  std::vector<NovelFrame> cameras;
  if (!request.like.empty()) {
    const View& view = FindView(set, request.like);
    cameras.push_back({view.id, view.camera, view.cam_from_world});
  } else if (!request.camera_file.empty()) {
    cameras = FromFile(set, request.camera_file, notes);
    if (cameras.size() > 1) {
      throw UsageError(
          fmt::format("`camera` {}: expected one camera, found {}; give `path` for several",
                      request.camera_file.string(), cameras.size()));
    }
  } else if (!request.path_file.empty()) {
    cameras = FromFile(set, request.path_file, notes);
  } else if (request.fly_through_frames > 0) {
    int index = 0;
    for (const NovelCamera& step :
         FlyThrough(set, request.fly_through_frames, request.load_depth)) {
      cameras.push_back({fmt::format("{:06}", index++), step.camera, step.cam_from_world});
    }
  } else {
    throw UsageError("expected one of `like`, `camera`, `path` and `fly_through`");
  }
  for (NovelFrame& camera : cameras) camera.camera = WithSize(camera.camera, request.size);
  return cameras;
}

}  // namespace dtr::pipeline
