#include "pipeline/import/import.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "calib/sparse_from_sfm.h"
#include "capture/ingest.h"
#include "dtr/base/error.h"
#include "dtr/base/temporary_folder.h"
#include "dtr/io/formats/rgbd_capture.h"
#include "dtr/io/set_io.h"
#include "dtr/types/computable.h"
#include "pipeline/core/cameras/camera_distortion.h"
#include "pipeline/core/cameras/given_cameras.h"
#include "pipeline/core/cameras/known_poses.h"
#include "pipeline/core/run/recorded_notes.h"
#include "pipeline/import/detail/camera_files.h"
#include "pipeline/import/detail/import_photos.h"
#include "pipeline/import/detail/import_views.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

// What of the folder of images the cameras use.
capture::FolderContents ContentsFor(const ImportOptions& options, const io::CameraList& list) {
  capture::FolderContents contents;
  if (fs::is_directory(options.images_dir)) {
    contents = capture::ContentsOfFiles(options.images_dir, true);
  }
  contents.Use("other_files");  // the cameras and what else belongs to a project
  contents.photos = static_cast<int>(list.cameras.size());
  for (const io::NamedCamera& camera : list.cameras) {
    contents.masks += !camera.mask_file.empty();
    contents.depth_maps += !options.depth_dir.empty() && !options.held_out.contains(camera.name);
  }
  // Depth maps that are found by name may lie among the photos.
  if (options.depth_dir == options.images_dir) return contents;
  const std::vector<std::string> unused = PhotosWithoutCamera(list, options.images_dir);
  if (!unused.empty()) {
    contents.Ignore("unused_photos", "other images",
                    "no camera is of them, first " + unused.front(), "",
                    static_cast<int>(unused.size()));
  }
  return contents;
}

// The cameras with the masks that are asked for, else with those of their file.
CamerasFromFile WithMasks(CamerasFromFile cameras, const ImportRequest& request,
                          Progress& progress) {
  if (request.masks.empty()) return cameras;
  cameras.mask_dir = request.masks;
  NameMasks(request.masks, request.images, cameras.list);
  const auto bare = std::count_if(cameras.list.cameras.begin(), cameras.list.cameras.end(),
                                  [](const auto& camera) { return camera.mask_file.empty(); });
  if (bare > 0) {
    progress.Note(fmt::format("{} of {} photos have no mask: all of them is used", bare,
                              cameras.list.cameras.size()));
  }
  return cameras;
}

// What is asked for, else what the file says.
std::set<std::string> HeldOut(const ImportRequest& request, const CamerasFromFile& cameras,
                              Progress& progress) {
  if (request.cameras_alone) return {};
  if (!cameras.held_out) return NamesHeldOut(request.holdout, cameras.list);
  if (!request.holdout.empty()) {
    progress.Note("`holdout` replaces train_filenames, test_filenames and val_filenames of " +
                  request.cameras.string());
    return NamesHeldOut(request.holdout, cameras.list);
  }
  progress.Note(fmt::format("{}: {} views held out, as its test_filenames and val_filenames say",
                            request.cameras.string(), cameras.held_out->size()));
  return *cameras.held_out;
}

// The unit that is asked for, else the file's; reports depth maps that nothing reads.
std::optional<double> DepthUnit(const ImportRequest& request, const CamerasFromFile& cameras,
                                Progress& progress) {
  const auto& list = cameras.list.cameras;
  const auto maps = std::count_if(list.begin(), list.end(),
                                  [](const auto& named) { return !named.depth_file.empty(); });
  if (request.depth.empty()) {
    if (maps > 0) {
      progress.Note(
          fmt::format("{}: {} depth maps that it names are not used; `depth` DIR takes "
                      "them",
                      request.cameras.string(), maps));
    }
    return request.depth_unit;
  }
  if (!cameras.depth_unit) return request.depth_unit;
  if (request.depth_unit && *request.depth_unit != *cameras.depth_unit) {
    progress.Note(fmt::format("`depth_unit` {} replaces the {} of {}", *request.depth_unit,
                              *cameras.depth_unit, request.cameras.string()));
  }
  return request.depth_unit ? request.depth_unit : cameras.depth_unit;
}

void RequireComputable(const std::optional<double>& depth_unit) {
  if (!depth_unit || (*depth_unit >= kMinLength && *depth_unit <= kMaxLength)) return;
  throw UsageError(
      fmt::format("`depth_unit` {:g}: expected {:g} to {:g}, with which can be computed",
                  *depth_unit, kMinLength, kMaxLength));
}

// Poses that act on p_world - origin, the points of the model with them.
CamerasFromFile Recentred(CamerasFromFile cameras) {
  const Eigen::Vector3d before = cameras.list.world_origin;
  cameras.list = io::RecentreWorld(std::move(cameras.list));
  if (!cameras.model) return cameras;
  std::map<std::string, const Pose*> pose_of;
  for (const io::NamedCamera& named : cameras.list.cameras) {
    pose_of[named.name] = &named.cam_from_world;
  }
  for (calib::SfmImage& image : cameras.model->images) {
    image.cam_from_world = *pose_of.at(image.name);
  }
  const Eigen::Vector3d moved = cameras.list.world_origin - before;
  for (auto& [id, point] : cameras.model->points) point.p_in_world -= moved;
  return cameras;
}

// The model with points: the file's, tested, or of the photos; adjusted where that is asked for.
CalibratedPhotos Calibrated(const ImportRequest& request, const ImportOptions& options,
                            const CamerasFromFile& cameras, std::optional<calib::SfmModel> model,
                            Progress& progress) {
  const capture::Capture photos = PhotosOf(cameras.list, options);
  CalibrateOptions calibrate;
  for (const capture::Photo& photo : photos.photos) {
    calibrate.held_out.push_back(options.held_out.contains(photo.name));
  }
  calibrate.seed = request.seed;
  calibrate.memory_gb = request.memory_gb;
  calibrate.poses = request.cameras;
  calibrate.refine_poses = request.refine;
  const TemporaryFolder workspace;
  if (model) {
    return WithPointsOfFile(std::move(*model), photos, calibrate, workspace.path(), progress);
  }
  if (!cameras.points_file.empty()) {
    progress.Note(
        fmt::format("{}: points of {} are not used, they do not say which photo sees them",
                    request.cameras.string(), cameras.points_file));
  }
  return WithPointsOfPhotos(cameras.list, photos, calibrate, workspace.path(), progress);
}

// The list with the adjusted cameras of the model.
io::CameraList WithCamerasOf(const calib::SfmModel& model, io::CameraList list) {
  std::map<std::string, const calib::SfmImage*> image_of;
  for (const calib::SfmImage& image : model.images) image_of[image.name] = &image;
  for (io::NamedCamera& named : list.cameras) {
    const calib::SfmImage& image = *image_of.at(named.name);
    SetCameraModel(named, model.cameras.at(image.camera_id));
    named.cam_from_world = image.cam_from_world;
  }
  return list;
}

// Points of the views of `list`.
SparseScene PointsOf(const calib::SfmModel& model, const io::CameraList& list) {
  std::vector<std::string> names;
  std::vector<PinholeCamera> pinholes;
  for (const io::NamedCamera& named : list.cameras) {
    names.push_back(named.name);
    pinholes.push_back(named.camera);
  }
  return calib::ToSparseScene(model, names, pinholes);
}

/// Cameras as the set gets them, with its points.
struct CamerasAndPoints {
  CamerasFromFile cameras;  ///< without their model
  CalibrationReport report = {};
  std::optional<SparseScene> points = {};  ///< none: the set has depth
};

// Points of the file, or of the photos: those of a set without depth. Adjusts the cameras to them
// where that is asked for.
CamerasAndPoints FindPoints(const ImportRequest& request, const ImportOptions& options,
                            CamerasFromFile cameras, Progress& progress) {
  const bool from_file = cameras.model.has_value();
  if (!from_file && !request.depth.empty()) return {std::move(cameras)};
  cameras = Recentred(std::move(cameras));
  std::optional<calib::SfmModel> model = std::exchange(cameras.model, {});
  CalibratedPhotos calibrated = Calibrated(request, options, cameras, std::move(model), progress);
  const auto& adjustment = calibrated.report.bundle_adjustment;
  const bool adjusted = adjustment && adjustment->refined.changed;
  if (adjusted) cameras.list = WithCamerasOf(calibrated.model, std::move(cameras.list));
  SparseScene points = PointsOf(calibrated.model, cameras.list);
  const size_t all = calibrated.model.points.size(), used = points.points.size();
  if (from_file && !adjusted && used < all) {
    progress.Note(
        fmt::format("{}: {} of its {} points are not used, fewer than two of the photos see them",
                    request.cameras.string(), all - used, all));
  }
  return {std::move(cameras), std::move(calibrated.report), std::move(points)};
}

ImportOptions OptionsFor(const ImportRequest& request, const CamerasFromFile& cameras,
                         Progress& progress) {
  ImportOptions options;
  options.images_dir = request.images;
  options.depth_dir = request.depth;
  if (request.depth == cameras.depth_dir) options.confidence = cameras.confidence;
  options.mask_dir = cameras.mask_dir;
  options.depth_kind = request.depth_kind;
  options.depth_unit = DepthUnit(request, cameras, progress);
  RequireComputable(options.depth_unit);
  options.held_out = HeldOut(request, cameras, progress);
  options.photo_grid = cameras.list.photo_grid;
  options.distortion_of = DistortionOf;
  options.memory_gb = request.memory_gb;
  options.completion = request.completion;
  return options;
}

// The request with a capture's own folders where it names none.
ImportRequest WithFolders(ImportRequest request, const CamerasFromFile& cameras) {
  if (request.images.empty()) request.images = cameras.images_dir;
  if (request.depth.empty() && !request.cameras_alone) request.depth = cameras.depth_dir;
  return request;
}

// The cameras that are views of a set with depth: of a capture, those with a depth map.
CamerasFromFile WithDepth(CamerasFromFile cameras, const ImportRequest& request) {
  if (cameras.depth_dir.empty() || request.depth != cameras.depth_dir) return cameras;
  std::erase_if(cameras.list.cameras, [&](const io::NamedCamera& named) {
    if (!named.depth_file.empty()) return false;
    cameras.skipped.emplace_back(named.name, "no depth map");
    return true;
  });
  if (cameras.list.cameras.empty()) {
    throw Error(request.cameras.string() + ": expected depth maps, found none");
  }
  return cameras;
}

void RejectRefiningOfDepth(const ImportRequest& request) {
  if (!request.refine || request.depth.empty()) return;
  throw UsageError(
      "`refine`: depth maps belong to the cameras as they are given; leave out `depth`, or let "
      "dtr build adjust the cameras (`poses`, `refine`) and take the depth as a prior "
      "(`depth_prior`)");
}

// The cameras of the file, with what it says of them reported.
CamerasFromFile ReadCameras(const ImportRequest& asked, Progress& progress) {
  if (asked.images.empty() && io::RgbdFormatOf(asked.cameras).empty()) {
    throw UsageError(fmt::format("`images`: expected the folder of the images of {}, found none",
                                 asked.cameras.string()));
  }
  CamerasFromFile cameras = ReadCameraFile(asked.cameras, asked.format,
                                           {.images = asked.images,
                                            .depth = asked.depth,
                                            .masks = asked.masks,
                                            .allow_missing = asked.allow_missing});
  io::RequireComputable(cameras.list, asked.cameras.string());
  for (const std::string& note : cameras.notes) progress.Note(note);
  return cameras;
}

}  // namespace

ImportReport Import(const ImportRequest& asked, Progress& listener) {
  RecordedNotes progress(listener);
  CamerasFromFile cameras = ReadCameras(asked, progress);
  const ImportRequest request = WithFolders(asked, cameras);
  cameras = WithDepth(std::move(cameras), request);
  RejectRefiningOfDepth(request);
  cameras = WithMasks(std::move(cameras), request, progress);
  ImportOptions options = OptionsFor(request, cameras, progress);
  io::SetWriter::RequireTarget(request.output, request.force);
  ImportReport report;
  report.contents = ContentsFor(options, cameras.list);
  listener.Note(capture::LineOf(report.contents));
  CamerasAndPoints found = FindPoints(request, options, std::move(cameras), progress);
  if (request.cameras_alone && (!found.points || found.points->points.empty())) {
    throw NotDecidable(request.cameras.string() +
                       ": no two photos show a point whose position these cameras give; photos "
                       "must overlap, from different positions");
  }
  options.calibration = std::move(found.report);
  report.alpha = ImportSet(found.cameras.list, options, request.output, request.force,
                           found.points ? &*found.points : nullptr, progress);
  report.calibration = std::move(options.calibration);
  report.views = found.cameras.list.cameras.size();
  report.held_out = options.held_out.size();
  report.skipped = std::move(found.cameras.skipped);
  report.notes = progress.lines();
  return report;
}

}  // namespace dtr::pipeline
