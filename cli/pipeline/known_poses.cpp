#include "cli/pipeline/known_poses.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "calib/colmap/export.h"
#include "calib/colmap/held_out.h"
#include "calib/colmap/known_poses.h"
#include "calib/colmap/model_io.h"
#include "capture/sfm_images.h"
#include "dtr/base/error.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/formats/llff.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

// Adds a photo under ids of its own, keeping the order of names. Cameras are not shared: the
// model's own stay what they were.
void AddImage(calib::SfmImage image, const calib::LensCamera& camera, calib::SfmModel& model) {
  image.camera_id = model.cameras.empty() ? 1 : model.cameras.rbegin()->first + 1;
  image.id = 1;
  for (const calib::SfmImage& other : model.images) image.id = std::max(image.id, other.id + 1);
  model.cameras[image.camera_id] = camera;
  const auto place = std::lower_bound(
      model.images.begin(), model.images.end(), image.name,
      [](const calib::SfmImage& other, const std::string& name) { return other.name < name; });
  model.images.insert(place, std::move(image));
}

void RequireSharedNames(size_t found, const fs::path& poses, const std::string& first_of_file,
                        const capture::Capture& capture) {
  if (found >= 2) return;
  throw Error(
      fmt::format("{}: expected cameras for at least 2 of the photos by name, found {}; its first "
                  "is '{}', the first photo is '{}': name the photos as it does, or give theirs",
                  poses.string(), found, first_of_file, capture.photos.front().name));
}

// Poses act on p_world - origin afterwards; returns that origin.
Eigen::Vector3d RecentreModel(calib::SfmModel& model) {
  io::CameraList list;
  for (const calib::SfmImage& image : model.images) {
    io::NamedCamera named;
    named.name = image.name;
    named.cam_from_world = image.cam_from_world;
    list.cameras.push_back(named);
  }
  list = io::RecentreWorld(std::move(list));
  for (size_t i = 0; i < model.images.size(); ++i) {
    model.images[i].cam_from_world = list.cameras[i].cam_from_world;
  }
  for (auto& [id, point] : model.points) point.p_in_world -= list.world_origin;
  return list.world_origin;
}

bool IsHeldOut(const std::string& name, const capture::Capture& capture,
               const CalibrateOptions& options) {
  const auto photo = std::find_if(capture.photos.begin(), capture.photos.end(),
                                  [&](const auto& p) { return p.name == name; });
  return options.held_out[static_cast<size_t>(photo - capture.photos.begin())];
}

// Cameras as they were given; poses act on p_world - the recentred origin.
struct Given {
  std::map<std::string, colmap::PosedImage> by_name;
  std::string first;  // of the file
  LengthUnit unit = LengthUnit::kUnknown;
  Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();
};

// Points for cameras that came without any: COLMAP finds them with everything else held.
CalibratedPhotos Triangulated(const Given& given, const capture::Capture& capture,
                              const CalibrateOptions& options, const fs::path& workspace,
                              Progress& progress) {
  std::vector<colmap::PosedImage> sources, held_out;
  capture::Capture source_photos;
  for (size_t i = 0; i < capture.photos.size(); ++i) {
    const capture::Photo& photo = capture.photos[i];
    const auto found = given.by_name.find(photo.name);
    if (found == given.by_name.end()) continue;
    colmap::PosedImage posed = found->second;
    posed.mask_file = capture::SfmMaskFile(workspace / "photos", photo);
    (options.held_out[i] ? held_out : sources).push_back(std::move(posed));
    if (!options.held_out[i]) source_photos.photos.push_back(photo);
  }
  RequireSharedNames(sources.size(), options.poses, given.first, capture);
  capture::PrepareSfmImages(source_photos, workspace / "photos", 0, options.threads,
                            options.memory_gb, progress);
  CalibratedPhotos calibrated;
  calibrated.unit = given.unit;
  calibrated.world_origin = given.world_origin;
  calibrated.model = colmap::TriangulateWithPoses(workspace / "photos", sources, workspace / "sfm",
                                                  SfmOptionsFor(options), progress)
                         .model;
  for (const colmap::PosedImage& posed : held_out) {
    AddImage({0, posed.name, 0, posed.cam_from_world, {}}, posed.camera, calibrated.model);
  }
  return calibrated;
}

CalibratedPhotos FromColmapModel(const capture::Capture& capture, const CalibrateOptions& options,
                                 const fs::path& workspace, Progress& progress) {
  calib::SfmModel model = colmap::ReadModel(options.poses);
  Given given;
  given.first = model.images.empty() ? "" : model.images.front().name;
  std::erase_if(model.images, [&](const calib::SfmImage& image) {
    return std::none_of(capture.photos.begin(), capture.photos.end(),
                        [&](const capture::Photo& photo) { return photo.name == image.name; });
  });
  RequireSharedNames(model.images.size(), options.poses, given.first, capture);
  given.world_origin = RecentreModel(model);
  CalibratedPhotos calibrated;
  // With one photo to build from there is nothing to triangulate, which is told later.
  const auto sources = std::count_if(model.images.begin(), model.images.end(), [&](const auto& i) {
    return !IsHeldOut(i.name, capture, options);
  });
  if (model.points.empty() && sources >= 2) {
    for (const calib::SfmImage& image : model.images) {
      given.by_name.emplace(
          image.name,
          colmap::PosedImage{image.name, model.cameras.at(image.camera_id), image.cam_from_world});
    }
    calibrated = Triangulated(given, capture, options, workspace, progress);
  } else {
    calibrated.model = std::move(model);
    calibrated.unit = given.unit;
    calibrated.world_origin = given.world_origin;
  }
  calibrated.engine = "COLMAP model";
  return calibrated;
}

io::CameraList ReadCameraList(const capture::Capture& capture, const fs::path& poses) {
  if (poses.extension() == ".json") return io::ReadCamerasJson(poses);
  if (poses.extension() == ".npy") {
    std::vector<io::SizedImage> images;
    for (const capture::Photo& photo : capture.photos) {
      images.push_back({photo.name, photo.width_px, photo.height_px});
    }
    return io::ReadLlff(poses, std::move(images)).list;
  }
  throw UsageError(fmt::format(
      "--poses {}: expected the folder of a COLMAP model, a cameras.json or a poses_bounds.npy",
      poses.string()));
}

CalibratedPhotos FromCameraList(const capture::Capture& capture, const CalibrateOptions& options,
                                const fs::path& workspace, Progress& progress) {
  const io::CameraList list = io::RecentreWorld(ReadCameraList(capture, options.poses));
  Given given;
  given.first = list.cameras.empty() ? "" : list.cameras.front().name;
  given.unit = list.unit;
  given.world_origin = list.world_origin;
  for (const io::NamedCamera& named : list.cameras) {
    given.by_name[named.name] = {named.name, colmap::FromPinhole(named.camera),
                                 named.cam_from_world};
  }
  CalibratedPhotos calibrated = Triangulated(given, capture, options, workspace, progress);
  calibrated.engine = options.poses.filename().string();
  return calibrated;
}

// COLMAP takes photos as they are stored, whatever their EXIF data say; we turn them upright, and
// our own models are of upright ones. Where the size tells nothing the user must know.
void TellOfTurned(const capture::Capture& capture, Progress& progress) {
  std::vector<std::string> turned;
  for (const capture::Photo& photo : capture.photos) {
    if (capture::IsTurned(photo)) turned.push_back(photo.name);
  }
  if (turned.empty()) return;
  progress.Note(fmt::format(
      "{} photos are turned upright by their EXIF data, first {}: their cameras must be of the "
      "upright pictures; COLMAP does not turn photos, so for its own models take the tag out of "
      "them first (exiftool -Orientation= FILE)",
      turned.size(), turned.front()));
}

}  // namespace

void RegisterHeldOutPhotos(const capture::Capture& held_out,
                           const std::vector<colmap::SfmImageInput>& sources,
                           const CameraGroups& groups, const fs::path& workspace,
                           const colmap::SfmOptions& options, calib::SfmModel& model,
                           Progress& progress) {
  if (held_out.photos.empty()) return;
  capture::PrepareSfmImages(held_out, workspace / "photos", 0, options.threads, options.memory_gb,
                            progress);
  const colmap::HeldOutResult placed = colmap::RegisterHeldOut(
      workspace / "photos", SfmInputs(held_out, groups, workspace / "photos"), model, sources,
      workspace / "sfm", workspace / "held_out", options, progress);
  for (const calib::SfmImage& image : placed.images) {
    // The pose alone: what the photo shows of the points would enter the set outside held_out/.
    AddImage({0, image.name, 0, image.cam_from_world, {}}, placed.cameras.at(image.camera_id),
             model);
  }
}

CalibratedPhotos FromKnownPoses(const capture::Capture& capture, const CalibrateOptions& options,
                                const fs::path& workspace, Progress& progress) {
  progress.Note("structure from motion left out: cameras are given");
  TellOfTurned(capture, progress);
  CalibratedPhotos calibrated = fs::is_directory(options.poses)
                                    ? FromColmapModel(capture, options, workspace, progress)
                                    : FromCameraList(capture, options, workspace, progress);
  calibrated.report_json =
      nlohmann::ordered_json{{"points", calibrated.model.points.size()}}.dump();
  return calibrated;
}

}  // namespace dtr::pipeline
