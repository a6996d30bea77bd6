#include "calib/colmap/model_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>

#include "calib/colmap/raw_model.h"
#include "dtr/base/durable.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/work_folder.h"

namespace dtr::colmap {
namespace fs = std::filesystem;
namespace {

using Tracks = std::map<std::uint64_t, std::vector<RawTrackElement>>;

std::vector<const calib::SfmImage*> ImagesById(const calib::SfmModel& model) {
  std::vector<const calib::SfmImage*> images;
  for (const calib::SfmImage& image : model.images) images.push_back(&image);
  std::sort(images.begin(), images.end(), [](auto* a, auto* b) { return a->id < b->id; });
  return images;
}

// Tracks as the features imply them, in the order of image ids.
Tracks TracksOf(const calib::SfmModel& model) {
  Tracks tracks;
  for (const auto& [id, point] : model.points) tracks[id];
  for (const calib::SfmImage* image : ImagesById(model)) {
    for (size_t i = 0; i < image->features.size(); ++i) {
      const auto id = image->features[i].point_id;
      if (id != calib::SfmFeature::kNoPoint) {
        tracks[id].push_back({image->id, static_cast<std::uint32_t>(i)});
      }
    }
  }
  return tracks;
}

// What ReadModel would reject must not be written.
void CheckModel(const fs::path& folder, const calib::SfmModel& model) {
  RawModel raw;
  raw.cameras_file = folder / "cameras";
  raw.images_file = folder / "images";
  raw.points_file = folder / "points3D";
  for (const auto& [id, camera] : model.cameras) {
    const auto where = fmt::format("{}: camera {}", raw.cameras_file.string(), id);
    raw.cameras.push_back(
        {id, CheckedCamera(where, static_cast<int>(camera.model),
                           static_cast<std::uint64_t>(camera.width_px),
                           static_cast<std::uint64_t>(camera.height_px), camera.params)});
  }
  for (const calib::SfmImage& image : model.images) {
    const auto where = fmt::format("{}: image {}", raw.images_file.string(), image.id);
    const auto& q = image.cam_from_world.rotation;
    const double wxyz[4] = {q.w(), q.x(), q.y(), q.z()};
    CheckedPose(where, wxyz, image.cam_from_world.translation.data());
    if (image.name.find_first_of(std::string_view("\0\r\n", 3)) != std::string::npos ||
        image.name.starts_with(' ') || image.name.ends_with(' ')) {
      throw Error(where +
                  ": the name has a line end, a NUL or an outer space, which the format "
                  "cannot hold; rename the photo");
    }
    for (const auto& feature : image.features) CheckedFinite(where, feature.pixel.sum());
  }
  raw.images = model.images;
  const Tracks tracks = TracksOf(model);
  for (const auto& [id, point] : model.points) {
    CheckedFinite(fmt::format("{}: point {}", raw.points_file.string(), id),
                  point.p_in_world.sum() + point.error_px);
    raw.points.push_back({id, point, tracks.at(id)});
  }
  Assembled(std::move(raw));
}

template <typename T>
void Put(std::string& out, T value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

constexpr char kUnfinished[] = "model.partial";

// A full disk is met before any file bears its name. The cameras come last: where they are, a model
// is, also after a kill.
void WriteFiles(const fs::path& folder, const std::string& extension, const std::string& cameras,
                const std::string& images, const std::string& points) {
  const WorkFolder work(folder / kUnfinished, "model");
  const std::pair<std::string, const std::string*> files[] = {
      {"images", &images}, {"points3D", &points}, {"cameras", &cameras}};
  for (const auto& [stem, content] : files) {
    WriteFileAtomically(work.path() / (stem + extension), *content);
  }
  for (const auto& [stem, content] : files) {
    Rename(work.path() / (stem + extension), folder / (stem + extension));
  }
}

void WriteBinary(const fs::path& folder, const calib::SfmModel& model) {
  std::string cameras, images, points;
  Put<std::uint64_t>(cameras, model.cameras.size());
  for (const auto& [id, camera] : model.cameras) {
    Put<std::uint32_t>(cameras, id);
    Put<std::int32_t>(cameras, static_cast<int>(camera.model));
    Put<std::uint64_t>(cameras, static_cast<std::uint64_t>(camera.width_px));
    Put<std::uint64_t>(cameras, static_cast<std::uint64_t>(camera.height_px));
    for (const double value : camera.params) Put(cameras, value);
  }
  Put<std::uint64_t>(images, model.images.size());
  for (const calib::SfmImage* image : ImagesById(model)) {
    const auto& q = image->cam_from_world.rotation;
    Put<std::uint32_t>(images, image->id);
    for (const double value : {q.w(), q.x(), q.y(), q.z()}) Put(images, value);
    for (const double value : image->cam_from_world.translation) Put(images, value);
    Put<std::uint32_t>(images, image->camera_id);
    images.append(image->name).push_back('\0');
    Put<std::uint64_t>(images, image->features.size());
    for (const calib::SfmFeature& feature : image->features) {
      Put(images, feature.pixel.x());
      Put(images, feature.pixel.y());
      Put<std::uint64_t>(images, feature.point_id);
    }
  }
  const Tracks tracks = TracksOf(model);
  Put<std::uint64_t>(points, model.points.size());
  for (const auto& [id, point] : model.points) {
    Put<std::uint64_t>(points, id);
    for (const double value : point.p_in_world) Put(points, value);
    for (const std::uint8_t value : point.rgb) Put(points, value);
    Put(points, point.error_px);
    Put<std::uint64_t>(points, tracks.at(id).size());
    for (const RawTrackElement& element : tracks.at(id)) {
      Put<std::uint32_t>(points, element.image_id);
      Put<std::uint32_t>(points, element.feature);
    }
  }
  WriteFiles(folder, ".bin", cameras, images, points);
}

// fmt's "{}" of a double is the shortest text that reads back to the same bits.
std::string CamerasText(const std::map<std::uint32_t, calib::LensCamera>& all) {
  std::string cameras;
  const auto add_camera = std::back_inserter(cameras);
  fmt::format_to(add_camera,
                 "# One camera per line: CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n"
                 "# Number of cameras: {}\n",
                 all.size());
  for (const auto& [id, camera] : all) {
    fmt::format_to(add_camera, "{} {} {} {}", id, calib::NameOf(camera.model), camera.width_px,
                   camera.height_px);
    for (const double value : camera.params) fmt::format_to(add_camera, " {}", value);
    cameras.push_back('\n');
  }
  return cameras;
}

void WriteText(const fs::path& folder, const calib::SfmModel& model) {
  std::string images, points;
  const auto add_image = std::back_inserter(images);
  fmt::format_to(add_image,
                 "# Two lines per image: IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME,\n"
                 "# then its features: X Y POINT3D_ID ... (-1: none)\n"
                 "# Number of images: {}\n",
                 model.images.size());
  for (const calib::SfmImage* image : ImagesById(model)) {
    const auto& q = image->cam_from_world.rotation;
    const auto& t = image->cam_from_world.translation;
    fmt::format_to(add_image, "{} {} {} {} {} {} {} {} {} {}\n", image->id, q.w(), q.x(), q.y(),
                   q.z(), t.x(), t.y(), t.z(), image->camera_id, image->name);
    const char* separator = "";
    for (const calib::SfmFeature& feature : image->features) {
      fmt::format_to(add_image, "{}{} {} ", separator, feature.pixel.x(), feature.pixel.y());
      separator = " ";
      if (feature.point_id == calib::SfmFeature::kNoPoint) {
        images.append("-1");
      } else {
        fmt::format_to(add_image, "{}", feature.point_id);
      }
    }
    images.push_back('\n');
  }
  const Tracks tracks = TracksOf(model);
  const auto add_point = std::back_inserter(points);
  fmt::format_to(add_point,
                 "# One point per line: POINT3D_ID X Y Z R G B ERROR (IMAGE_ID FEATURE_INDEX)*\n"
                 "# Number of points: {}\n",
                 model.points.size());
  for (const auto& [id, point] : model.points) {
    const auto& p = point.p_in_world;
    fmt::format_to(add_point, "{} {} {} {} {} {} {} {}", id, p.x(), p.y(), p.z(), point.rgb[0],
                   point.rgb[1], point.rgb[2], point.error_px);
    for (const RawTrackElement& element : tracks.at(id)) {
      fmt::format_to(add_point, " {} {}", element.image_id, element.feature);
    }
    points.push_back('\n');
  }
  WriteFiles(folder, ".txt", CamerasText(model.cameras), images, points);
}

bool HasFiles(const fs::path& folder, const char* extension) {
  for (const char* stem : {"cameras", "images", "points3D"}) {
    if (!fs::is_regular_file(folder / (std::string(stem) + extension))) return false;
  }
  return true;
}

// A model of the other format, or the rigs of another model, would be read in place of, or along
// with, what is written now.
void RejectOtherFiles(const fs::path& folder, const char* extension) {
  for (const char* name : {"cameras", "images", "points3D", "rigs", "frames"}) {
    for (const char* other : {".bin", ".txt"}) {
      const fs::path file = folder / (std::string(name) + other);
      const bool replaced =
          std::string_view(other) == extension && name[0] != 'r' && name[0] != 'f';
      if (!replaced && fs::exists(file)) {
        throw Error(
            fmt::format("{}: expected no file of another model beside the {} files to be "
                        "written; choose another folder",
                        file.string(), extension));
      }
    }
  }
}

}  // namespace

calib::SfmModel ReadModel(const fs::path& folder, std::vector<std::string>* notes) {
  const bool binary = HasFiles(folder, ".bin");
  if (!binary && !HasFiles(folder, ".txt")) {
    throw Error(folder.string() +
                ": expected a COLMAP model (cameras, images and points3D, all .bin or all .txt), "
                "found none; name the folder that holds these files");
  }
  RawModel raw = binary ? ReadBinaryModel(folder) : ReadTextModel(folder);
  const std::string line = TakePosesOfFrames(raw);
  if (notes != nullptr && !line.empty()) notes->push_back(line);
  return Assembled(std::move(raw));
}

fs::path ModelFolderIn(const fs::path& folder) {
  const auto is_model = [](const fs::path& at) {
    std::error_code ignored;
    return fs::is_regular_file(at / "cameras.bin", ignored) ||
           fs::is_regular_file(at / "cameras.txt", ignored);
  };
  std::error_code ignored;
  const bool several =
      fs::exists(folder / "sparse" / "1", ignored) || fs::exists(folder / "1", ignored);
  if (is_model(folder) || several) return folder;
  for (const fs::path& below : {fs::path("sparse") / "0", fs::path("sparse"), fs::path("0")}) {
    if (is_model(folder / below)) return folder / below;
  }
  return folder;
}

void WriteModel(const fs::path& folder, const calib::SfmModel& model, Format format) {
  CheckModel(folder, model);
  std::error_code failure;
  fs::create_directories(folder, failure);
  if (failure) throw Error(folder.string() + ": cannot be made: " + failure.message());
  RejectOtherFiles(folder, format == Format::kBinary ? ".bin" : ".txt");
  format == Format::kBinary ? WriteBinary(folder, model) : WriteText(folder, model);
}

std::map<std::uint32_t, calib::LensCamera> ReadCamerasText(const fs::path& file) {
  std::map<std::uint32_t, calib::LensCamera> cameras;
  for (const RawModel::Camera& camera : ReadTextCameras(file)) {
    if (!cameras.emplace(camera.id, camera.camera).second) {
      throw Error(
          fmt::format("{}: camera {}: expected one, found it twice", file.string(), camera.id));
    }
  }
  return cameras;
}

void WriteCamerasText(const fs::path& file,
                      const std::map<std::uint32_t, calib::LensCamera>& cameras) {
  WriteFileAtomically(file, CamerasText(cameras));
}

void RequireNoModel(const fs::path& folder) {
  for (const char* name : {"cameras.bin", "images.bin", "points3D.bin"}) {
    const bool is_whole = std::string(name) == "cameras.bin";
    if (!fs::exists(folder / name) || (!is_whole && fs::exists(folder / kUnfinished))) continue;
    throw UsageError(folder.string() +
                     ": expected no model yet, found one; remove it or choose another folder");
  }
}

}  // namespace dtr::colmap
