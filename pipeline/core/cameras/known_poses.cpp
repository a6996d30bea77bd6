#include "pipeline/core/cameras/known_poses.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "calib/colmap/model_io.h"
#include "calib/sfm/run/held_out.h"
#include "calib/sfm/run/known_poses.h"
#include "capture/sfm_images.h"
#include "dtr/base/error.h"
#include "dtr/base/file_names.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/formats/llff.h"
#include "dtr/io/formats/rgbd_capture.h"
#include "dtr/io/formats/transforms_json.h"
#include "pipeline/core/cameras/camera_distortion.h"
#include "pipeline/core/cameras/camera_formats.h"
#include "pipeline/core/cameras/foreign_cameras.h"
#include "pipeline/core/cameras/given_cameras.h"
#include "pipeline/core/cameras/names_of_photos.h"
#include "pipeline/core/model_grid.h"
#include "pipeline/core/photos/named_files.h"

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
  std::map<std::string, sfm::PosedImage> by_name;
  /// The photos with the points of the file; empty: points are triangulated.
  std::optional<calib::SfmModel> model;
  std::string first;  // of the file
  LengthUnit unit = LengthUnit::kUnknown;
  Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();
};

Given GivenIn(const io::CameraList& list) {
  Given given;
  given.first = list.cameras.empty() ? "" : list.cameras.front().name;
  given.unit = list.unit;
  given.world_origin = list.world_origin;
  for (const io::NamedCamera& named : list.cameras) {
    given.by_name[named.name] = {named.name, CameraModelOf(named), named.cam_from_world};
  }
  return given;
}

// Adjusts the cameras where that pays. `are_independent`: of the observations (RefineGivenOptions).
void RefineWhereAsked(const CalibrateOptions& options, bool are_independent,
                      CalibratedPhotos& calibrated, Progress& progress) {
  calibrated.report.points = calibrated.model.points.size();
  if (!options.refine_poses) return;
  calibrated.report.bundle_adjustment = {
      .refined = RefineGiven(calibrated.model,
                             {.are_independent = are_independent, .seed = options.seed}, progress),
      .metres = {}};
}

// The test of cameras that bring points. Nothing where there is too little to test with.
std::optional<calib::ConventionReport> TestOfModel(const calib::SfmModel& model,
                                                   const capture::Capture& photos,
                                                   const CalibrateOptions& options,
                                                   const fs::path& workspace, Progress& progress) {
  std::map<std::string, size_t> photo_of;
  for (size_t i = 0; i < photos.photos.size(); ++i) photo_of[photos.photos[i].name] = i;
  GivenPhotos given{options.poses.filename().string(), {}, workspace, SfmOptionsFor(options)};
  std::vector<bool> may;
  for (const calib::SfmImage& image : model.images) {
    const size_t photo = photo_of.at(image.name);
    may.push_back(!options.held_out[photo]);
    given.images.push_back({image.name, model.cameras.at(image.camera_id), image.cam_from_world,
                            capture::SfmMaskFile(workspace / "photos", photos.photos[photo])});
  }
  const std::vector<size_t> some = ImagesToTest(model, may);
  capture::Capture tested;
  for (const size_t i : some) {
    tested.photos.push_back(photos.photos[photo_of.at(model.images[i].name)]);
  }
  PreparePhotos(tested, options, {}, workspace / "photos", progress);
  const calib::ConventionReport report = TestWithPoints(model, given, some, progress);
  return report.tested() ? std::optional(report) : std::nullopt;
}

// Points for cameras that came without any: COLMAP finds them with everything else held.
CalibratedPhotos Triangulated(const Given& given, const capture::Capture& capture,
                              const CalibrateOptions& options, const fs::path& workspace,
                              const std::optional<sfm::SfmPart>& part, Progress& progress) {
  std::vector<sfm::PosedImage> sources, held_out;
  capture::Capture source_photos;
  for (size_t i = 0; i < capture.photos.size(); ++i) {
    const capture::Photo& photo = capture.photos[i];
    const auto found = given.by_name.find(photo.name);
    if (found == given.by_name.end()) continue;
    sfm::PosedImage posed = found->second;
    posed.mask_file = capture::SfmMaskFile(workspace / "photos", photo);
    // As in structure from motion, cameras that are to be adjusted need their observations.
    const bool is_source = !options.held_out[i] || options.refine_poses;
    (is_source ? sources : held_out).push_back(std::move(posed));
    if (is_source) source_photos.photos.push_back(photo);
  }
  RequireSharedNames(sources.size(), options.poses, given.first, capture);
  PreparePhotos(source_photos, options, part, workspace / "photos", progress);
  const sfm::SfmOptions sfm = SfmOptionsFor(options, part);
  CalibratedPhotos calibrated;
  if (part) {
    sfm::TriangulateWithPoses(workspace / "photos", sources, workspace / "sfm", sfm, progress,
                              part);
    return calibrated;
  }
  TriangulatedCameras triangulated = TriangulateAndTest(
      {options.poses.filename().string(), std::move(sources), workspace, sfm}, progress);
  calibrated.model = std::move(triangulated.model);
  calibrated.report.given_cameras = std::move(triangulated.conventions);
  for (const sfm::PosedImage& posed : held_out) {
    AddImage({0, posed.name, 0, posed.cam_from_world, {}}, posed.camera, calibrated.model);
  }
  RefineWhereAsked(options, true, calibrated, progress);
  return calibrated;
}

// Photos with their points, or without: then these are triangulated.
Given GivenIn(calib::SfmModel model, const io::CameraList& list, const capture::Capture& capture,
              const CalibrateOptions& options, Progress& progress) {
  Given given;
  given.unit = list.unit;
  given.world_origin = list.world_origin;
  given.first = model.images.empty() ? "" : model.images.front().name;
  std::erase_if(model.images, [&](const calib::SfmImage& image) {
    return std::none_of(capture.photos.begin(), capture.photos.end(),
                        [&](const capture::Photo& photo) { return photo.name == image.name; });
  });
  RequireSharedNames(model.images.size(), options.poses, given.first, capture);
  given.world_origin += RecentreModel(model);
  // With one photo to build from there is nothing to triangulate, which is reported later.
  const auto sources = std::count_if(model.images.begin(), model.images.end(), [&](const auto& i) {
    return !IsHeldOut(i.name, capture, options);
  });
  const std::string unshared = LineOfUnsharedPoints(model, options.poses.string());
  if (!unshared.empty()) progress.Note(unshared);
  if ((!model.points.empty() && unshared.empty()) || sources < 2) {
    given.model = std::move(model);
    return given;
  }
  for (const calib::SfmImage& image : model.images) {
    given.by_name.emplace(image.name, sfm::PosedImage{image.name, model.cameras.at(image.camera_id),
                                                      image.cam_from_world});
  }
  return given;
}

// The cameras of options.poses.
Given GivenFor(const capture::Capture& capture, const CalibrateOptions& options,
               Progress& progress) {
  progress.Note("structure from motion left out: cameras are given");
  PosesFile file = ReadPoses(capture, options.poses, options.poses_format);
  for (const std::string& note : file.notes) progress.Note(note);
  return file.model ? GivenIn(std::move(*file.model), file.list, capture, options, progress)
                    : GivenIn(io::RecentreWorld(std::move(file.list)));
}

// The photo that a path of a transforms.json means; its folders are those of the photos.
const io::SizedImage* PhotoMeant(const std::vector<io::SizedImage>& images, const fs::path& folder,
                                 const std::string& path) {
  const std::vector<std::string> names = NamesMeant(folder, path);
  for (const bool with_extension : {true, false}) {
    for (const std::string& name : names) {
      const auto is_meant = [&](const io::SizedImage& image) {
        return with_extension ? image.name == name
                              : fs::path(image.name).replace_extension() == fs::path(name);
      };
      const auto found = std::find_if(images.begin(), images.end(), is_meant);
      if (found == images.end()) continue;
      // Of several images called so, none is meant (FindImage does the same).
      if (std::any_of(found + 1, images.end(), is_meant)) return nullptr;
      return &*found;
    }
  }
  return nullptr;
}

// The folder of photos: their names are what is left of their files' paths.
fs::path FolderOfPhotos(const capture::Capture& capture) {
  fs::path folder = capture.photos.empty() ? fs::path() : capture.photos.front().file.parent_path();
  for (const char c : capture.photos.empty() ? std::string() : capture.photos.front().name) {
    if (c == '/') folder = folder.parent_path();
  }
  return folder;
}

PosesFile FromTransforms(const std::vector<io::SizedImage>& images, const capture::Capture& capture,
                         const fs::path& poses) {
  const fs::path folder = FolderOfPhotos(capture);
  io::TransformsPaths paths;
  paths.image_of = [&](const std::string& path) -> std::optional<io::SizedImage> {
    const io::SizedImage* photo = PhotoMeant(images, folder, path);
    return photo == nullptr ? std::nullopt : std::optional(*photo);
  };
  io::TransformsFile read = io::ReadTransformsJson(poses, paths);
  PosesFile file{std::move(read.list), std::move(read.notes), {}};
  if (!read.missing.empty()) {
    file.notes.push_back(fmt::format(
        "{}: {} of its {} frames have no photo here, first {}", poses.string(), read.missing.size(),
        file.list.cameras.size() + read.missing.size(), Printable(read.missing.front().path)));
  }
  if (file.list.cameras.empty()) {
    throw Error(
        fmt::format("{}: none of its frames is one of the photos; its first is '{}', the "
                    "first photo is '{}': name the photos as it does, or give theirs",
                    poses.string(), Printable(read.missing.front().path),
                    capture.photos.empty() ? "" : capture.photos.front().name));
  }
  if (read.held_out && !read.held_out->empty()) {
    file.notes.push_back(
        fmt::format("{}: {} frames are for testing by its lists, which `holdout` "
                    "decides here",
                    poses.string(), read.held_out->size()));
  }
  return file;
}

PosesFile FromForeign(const std::vector<io::SizedImage>& images, const CameraFormat& format,
                      const capture::Capture& capture, const fs::path& poses) {
  std::map<std::string, const io::SizedImage*> by_name;
  std::vector<std::string> names;
  for (const io::SizedImage& image : images) {
    by_name[image.name] = &image;
    names.push_back(image.name);
  }
  const std::string source = poses.string();
  PlacedCameras placed = PlaceCameras(format.read(poses), source, PhotoNames(std::move(names)),
                                      [&](const std::string& name) { return *by_name.at(name); });
  PosesFile file{std::move(placed.list), std::move(placed.notes), std::move(placed.model)};
  const size_t cameras = file.list.cameras.size() + placed.missing.size();
  if (!placed.missing.empty()) {
    file.notes.push_back(fmt::format("{}: {} of its {} cameras have no photo here, first {} ({})",
                                     source, placed.missing.size(), cameras,
                                     placed.missing.front().first, placed.missing.front().second));
  }
  const std::string line = LeftOutLine(source, placed.left_out, cameras);
  if (!line.empty()) file.notes.push_back(line);
  if (file.list.cameras.empty()) {
    RequireSharedNames(0, poses, placed.missing.empty() ? "" : placed.missing.front().first,
                       capture);
  }
  return file;
}

}  // namespace

PosesFile ReadPoses(const capture::Capture& capture, const fs::path& poses,
                    const std::string& format) {
  std::vector<io::SizedImage> images;
  for (const capture::Photo& photo : capture.photos) {
    // Photos whose pixels are settled are as they are; of others their cameras' size will say.
    const StoredSize stored = capture::StoredSizeOf(photo);
    images.push_back({photo.name, stored.width_px, stored.height_px,
                      photo.as_stored ? 1 : photo.exif_orientation});
  }
  const CameraFormat chosen = FormatOf(poses, format, "`poses`");
  const std::string kind = chosen.name;
  if (kind == "colmap") {
    PosesFile file;
    file.model = ReadModelOf(capture, poses, &file.notes);
    file.list.photo_grid = GridOfModel(colmap::ModelFolderIn(poses));
    return file;
  }
  if (chosen.read != nullptr) return FromForeign(images, chosen, capture, poses);
  if (kind == "nerf") return FromTransforms(images, capture, poses);
  if (kind == "llff") return {io::ReadLlff(poses, std::move(images)).list, {}, {}};
  if (io::IsRgbdFormat(kind)) {
    io::RgbdCapture read = io::ReadRgbdCapture(poses, kind, FolderOfPhotos(capture));
    PosesFile file{std::move(read.list), std::move(read.notes), {}};
    NameAsPhotos(capture, file.list);
    return file;
  }
  PosesFile file{io::ReadCamerasJson(poses), {}, {}};
  NameAsPhotos(capture, file.list);
  return file;
}

CalibratedPhotos WithPointsOfPhotos(const io::CameraList& list, const capture::Capture& photos,
                                    const CalibrateOptions& options, const fs::path& workspace,
                                    Progress& progress) {
  progress.Note("points are triangulated from the photos, with their cameras fixed");
  const Given given = GivenIn(list);
  CalibratedPhotos calibrated = Triangulated(given, photos, options, workspace, {}, progress);
  calibrated.unit = given.unit;
  calibrated.world_origin = given.world_origin;
  return calibrated;
}

CalibratedPhotos WithPointsOfFile(calib::SfmModel model, const capture::Capture& photos,
                                  const CalibrateOptions& options, const fs::path& workspace,
                                  Progress& progress) {
  CalibratedPhotos calibrated;
  calibrated.model = std::move(model);
  calibrated.report.given_cameras =
      TestOfModel(calibrated.model, photos, options, workspace, progress);
  RefineWhereAsked(options, false, calibrated, progress);
  return calibrated;
}

namespace {

// Views of one panorama, found one by one, as the panorama stands. `points`: those they observe.
void StandAsPanoramas(const SetRig& panoramas, const capture::Capture& held_out,
                      const std::map<std::uint64_t, calib::SfmPoint>& points,
                      sfm::HeldOutResult& placed) {
  const auto photo_of = PhotosOfRig(panoramas, held_out);
  calib::SfmModel found;
  found.cameras = placed.cameras;
  found.images = placed.images;
  found.points = points;
  const auto poses = calib::RigPosesOf(found, panoramas.known, photo_of);
  for (calib::SfmImage& image : placed.images) {
    const calib::RigPhoto& photo = photo_of.at(image.name);
    image.cam_from_world = panoramas.known.cam_from_rig[photo.camera] * poses.at(photo.frame);
  }
}

}  // namespace

void RegisterHeldOutPhotos(const capture::Capture& held_out,
                           const std::vector<sfm::SfmImageInput>& sources,
                           const CameraGroups& groups, const fs::path& workspace,
                           const sfm::SfmOptions& options, const SetRig* panoramas,
                           calib::SfmModel& model, Progress& progress) {
  if (held_out.photos.empty()) return;
  capture::PrepareSfmImages(held_out, workspace / "photos", 0, options.memory_gb, progress);
  sfm::HeldOutResult placed = sfm::RegisterHeldOut(
      workspace / "photos", SfmInputs(held_out, groups, workspace / "photos"), model, sources,
      workspace / "sfm", workspace / "held_out", options, progress);
  if (panoramas != nullptr) StandAsPanoramas(*panoramas, held_out, model.points, placed);
  for (const calib::SfmImage& image : placed.images) {
    // The pose alone: what the photo shows of the points would enter the set outside held_out/.
    AddImage({0, image.name, 0, image.cam_from_world, {}}, placed.cameras.at(image.camera_id),
             model);
  }
}

CalibratedPhotos FromKnownPoses(const capture::Capture& capture, const CalibrateOptions& options,
                                const fs::path& workspace, const std::optional<sfm::SfmPart>& part,
                                Progress& progress) {
  Given given = GivenFor(capture, options, progress);
  CalibratedPhotos calibrated;
  if (!given.model) {
    calibrated = Triangulated(given, capture, options, workspace, part, progress);
  } else if (!part) {
    calibrated = WithPointsOfFile(std::move(*given.model), capture, options, workspace, progress);
  }
  calibrated.unit = given.unit;
  calibrated.world_origin = given.world_origin;
  const bool is_colmaps = IsColmapModel(options.poses, options.poses_format);
  calibrated.engine = is_colmaps ? "COLMAP model" : options.poses.filename().string();
  return calibrated;
}

}  // namespace dtr::pipeline
