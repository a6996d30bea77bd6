#include "pipeline/import.h"

#include <fmt/format.h>

#include <algorithm>

#include "capture/ingest.h"
#include "dtr/base/error.h"
#include "dtr/base/temporary_folder.h"
#include "dtr/io/formats/rgbd_capture.h"
#include "dtr/io/set_io.h"
#include "pipeline/detail/cameras/known_poses.h"
#include "pipeline/detail/import/camera_distortion.h"
#include "pipeline/detail/import/camera_files.h"
#include "pipeline/detail/import/import_photos.h"
#include "pipeline/detail/import/import_views.h"
#include "pipeline/detail/run/recorded_notes.h"

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

// The folder of the masks, the one that is asked for named in the cameras.
fs::path FindMasks(const ImportRequest& request, CamerasFromFile& cameras, Progress& progress) {
  if (request.masks.empty()) return cameras.mask_dir;
  NameMasks(request.masks, request.images, cameras.list);
  const auto bare = std::count_if(cameras.list.cameras.begin(), cameras.list.cameras.end(),
                                  [](const auto& camera) { return camera.mask_file.empty(); });
  if (bare > 0) {
    progress.Note(fmt::format("{} of {} photos have no mask: all of them is used", bare,
                              cameras.list.cameras.size()));
  }
  return request.masks;
}

// What is asked for, else what the file says.
std::set<std::string> HeldOut(const ImportRequest& request, const CamerasFromFile& cameras,
                              Progress& progress) {
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

// Points of a set without depth, where the cameras come without: COLMAP finds them.
void FindPoints(const ImportRequest& request, ImportOptions& options, CamerasFromFile& cameras,
                Progress& progress) {
  if (!request.depth.empty() || (cameras.points && !cameras.points->points.empty())) return;
  if (!cameras.points_file.empty()) {
    progress.Note(
        fmt::format("{}: points of {} are not used, they do not say which photo sees them",
                    request.cameras.string(), cameras.points_file));
  }
  cameras.list = io::RecentreWorld(std::move(cameras.list));
  const capture::Capture photos = PhotosOf(cameras.list, options);
  CalibrateOptions calibrate;
  for (const capture::Photo& photo : photos.photos) {
    calibrate.held_out.push_back(options.held_out.contains(photo.name));
  }
  calibrate.threads = request.threads;
  calibrate.seed = request.seed;
  calibrate.memory_gb = request.memory_gb;
  calibrate.poses = request.cameras;
  const TemporaryFolder workspace;
  cameras.points = TriangulatedPoints(cameras.list, photos, calibrate, workspace.path(),
                                      options.conventions.emplace(), progress);
}

ImportOptions OptionsFor(const ImportRequest& request, CamerasFromFile& cameras,
                         Progress& progress) {
  ImportOptions options;
  options.images_dir = request.images;
  options.depth_dir = request.depth;
  options.mask_dir = FindMasks(request, cameras, progress);
  options.depth_kind = request.depth_kind;
  options.depth_unit = DepthUnit(request, cameras, progress);
  options.held_out = HeldOut(request, cameras, progress);
  options.photo_grid = cameras.list.photo_grid;
  options.distortion_of = DistortionOf;
  options.memory_gb = request.memory_gb;
  options.threads = request.threads;
  options.completion = request.completion;
  return options;
}

// Captures have folders of their own; what they have without a depth map is no view of a set with
// depth.
void TakeFolders(CamerasFromFile& cameras, ImportRequest& request) {
  if (request.images.empty()) request.images = cameras.images_dir;
  if (request.depth.empty()) request.depth = cameras.depth_dir;
  if (cameras.depth_dir.empty() || request.depth != cameras.depth_dir) return;
  std::erase_if(cameras.list.cameras, [&](const io::NamedCamera& named) {
    if (!named.depth_file.empty()) return false;
    cameras.skipped.emplace_back(named.name, "no depth map");
    return true;
  });
  if (cameras.list.cameras.empty()) {
    throw Error(request.cameras.string() + ": expected depth maps, found none");
  }
}

}  // namespace

ImportReport Import(ImportRequest request, Progress& listener) {
  RecordedNotes progress(listener);
  if (request.images.empty() && io::RgbdFormatOf(request.cameras).empty()) {
    throw UsageError(fmt::format("`images`: expected the folder of the images of {}, found none",
                                 request.cameras.string()));
  }
  CamerasFromFile cameras = ReadCameraFile(request.cameras, request.format,
                                           {.images = request.images,
                                            .depth = request.depth,
                                            .masks = request.masks,
                                            .allow_missing = request.allow_missing});
  for (const std::string& note : cameras.notes) progress.Note(note);
  TakeFolders(cameras, request);
  ImportOptions options = OptionsFor(request, cameras, progress);
  io::SetWriter::RequireTarget(request.output, request.force);
  ImportReport report;
  report.contents = ContentsFor(options, cameras.list);
  listener.Note(capture::LineOf(report.contents));
  FindPoints(request, options, cameras, progress);
  report.alpha = ImportSet(cameras.list, options, request.output, request.force,
                           cameras.points ? &*cameras.points : nullptr, progress);
  report.views = cameras.list.cameras.size();
  report.held_out = options.held_out.size();
  report.skipped = std::move(cameras.skipped);
  report.notes = progress.lines();
  return report;
}

}  // namespace dtr::pipeline
