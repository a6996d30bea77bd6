#include "pipeline/dynamic/detail/fixed_cameras.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "calib/colmap/model_io.h"
#include "calib/sparse_from_sfm.h"
#include "calib/undistort.h"
#include "capture/ingest.h"
#include "dtr/base/durable.h"
#include "dtr/base/error.h"
#include "dtr/io/image_io.h"
#include "pipeline/dynamic/detail/scene_clocks.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

std::string PhotoName(const std::string& camera) { return camera + ".png"; }

// The images of one time step as photos, named by their cameras.
capture::Capture PhotosOfStep(const Recording& recording, size_t step, const fs::path& folder,
                              Progress& progress) {
  fs::create_directories(folder);
  for (size_t c = 0; c < recording.cameras().size(); ++c) {
    const fs::path file = folder / PhotoName(recording.cameras()[c]);
    if (fs::exists(file)) continue;
    recording.ForEach(
        c, [&](size_t s) { return s == step; },
        [&](size_t, const ImageRgb8& image) {
          const fs::path fresh = folder / ("." + recording.cameras()[c] + ".new.png");
          io::WriteImage(fresh, image);
          Rename(fresh, file);
        },
        progress);
  }
  return capture::IngestPhotos(folder, {.sort = false, .screen = false}, progress);
}

// Options for the photos of one time step, whose order is that of their file names.
CalibrateOptions OptionsFor(const capture::Capture& photos, const Recording& recording,
                            const CalibrateOptions& options) {
  CalibrateOptions own = options;
  own.held_out.clear();
  for (const capture::Photo& photo : photos.photos) {
    const auto& names = recording.cameras();
    const auto camera = std::find_if(names.begin(), names.end(), [&](const std::string& name) {
      return PhotoName(name) == photo.name;
    });
    own.held_out.push_back(camera != names.end() &&
                           options.held_out[static_cast<size_t>(camera - names.begin())]);
  }
  return own;
}

// Cameras without points, as a file that calibration takes.
void WriteCameras(const std::vector<std::string>& names,
                  const std::vector<calib::LensCamera>& lenses, const std::vector<Pose>& poses,
                  const fs::path& folder) {
  calib::SfmModel model;
  for (size_t c = 0; c < names.size(); ++c) {
    const auto id = static_cast<std::uint32_t>(c + 1);
    model.cameras[id] = lenses[c];
    model.images.push_back({id, PhotoName(names[c]), id, poses[c], {}});
  }
  colmap::WriteModel(folder, model, colmap::Format::kText);
}

CalibratedPhotos WithGivenCameras(const capture::Capture& photos, CalibrateOptions options,
                                  const fs::path& cameras, const fs::path& workspace,
                                  Progress& progress) {
  options.poses = cameras;
  options.poses_format = "colmap";
  options.rig.reset();
  return CalibratePhotos(photos, options, workspace, progress);
}

CalibratedPhotos FirstStep(const Recording& recording, const FixedCameraOptions& options,
                           const fs::path& workspace, Progress& progress) {
  const capture::Capture photos = PhotosOfStep(recording, 0, workspace / "photos0", progress);
  const CalibrateOptions calibrate = OptionsFor(photos, recording, options.calibrate);
  if (!options.rig) return CalibratePhotos(photos, calibrate, workspace / "sfm0", progress);
  const SetRig& rig = *options.rig;
  std::vector<calib::LensCamera> lenses;
  std::vector<Pose> poses;
  for (const std::string& camera : recording.cameras()) {
    const auto c = static_cast<size_t>(std::find(rig.names.begin(), rig.names.end(), camera) -
                                       rig.names.begin());
    lenses.push_back(rig.known.lenses[c]);
    poses.push_back(rig.known.cam_from_rig[c]);
  }
  WriteCameras(recording.cameras(), lenses, poses, workspace / "cameras0");
  CalibratedPhotos calibrated =
      WithGivenCameras(photos, calibrate, workspace / "cameras0", workspace / "points0", progress);
  calibrated.unit = rig.unit;
  calibrated.engine = rig.file;
  return calibrated;
}

void TakeCameras(const Recording& recording, FixedCameras& cameras) {
  const calib::SfmModel& model = cameras.calibrated.model;
  for (const std::string& camera : recording.cameras()) {
    const auto image = std::find_if(model.images.begin(), model.images.end(),
                                    [&](const auto& i) { return i.name == PhotoName(camera); });
    if (image == model.images.end()) {
      throw Error(fmt::format(
          "calibration: camera {} was not found by structure from motion in the first time step; "
          "give `rig`, or another first time step (`from`), or leave the camera out",
          camera));
    }
    cameras.lens.push_back(model.cameras.at(image->camera_id));
    cameras.cam_from_world.push_back(image->cam_from_world);
  }
}

SparseScene PointsOf(const Recording& recording, const FixedCameras& cameras, int max_size_px,
                     const calib::SfmModel& model) {
  std::vector<std::string> names;
  std::vector<PinholeCamera> pinholes;
  for (size_t c = 0; c < recording.cameras().size(); ++c) {
    names.push_back(PhotoName(recording.cameras()[c]));
    pinholes.push_back(calib::ShrunkCamera(cameras.lens[c].Pinhole(), max_size_px));
  }
  return calib::ToSparseScene(model, names, pinholes);
}

void Append(const SparseScene& more, SparseScene& scene) {
  const int first = static_cast<int>(scene.points.size());
  scene.points.insert(scene.points.end(), more.points.begin(), more.points.end());
  for (SparseObservation seen : more.observations) {
    seen.point += first;
    scene.observations.push_back(seen);
  }
  std::sort(scene.observations.begin(), scene.observations.end(), [](const auto& a, const auto& b) {
    return std::pair(a.view, a.point) < std::pair(b.view, b.point);
  });
}

}  // namespace

void RequireRigCameras(const SetRig& rig, const Recording& recording, const Progress& progress) {
  for (size_t c = 0; c < recording.cameras().size(); ++c) {
    const std::string& camera = recording.cameras()[c];
    const auto found = std::find(rig.names.begin(), rig.names.end(), camera);
    if (found == rig.names.end()) {
      std::string known;
      for (const std::string& name : rig.names) known += (known.empty() ? "" : ", ") + name;
      throw Error(fmt::format(
          "`rig` {}: camera {}: expected one of its cameras ({}); name videos or folders of photos "
          "as the rig does, or move it out of the folder",
          rig.file, camera, known));
    }
    const auto& lens = rig.known.lenses[static_cast<size_t>(found - rig.names.begin())];
    recording.ForEach(
        c, [](size_t step) { return step == 0; },
        [&](size_t, const ImageRgb8& image) {
          if (image.width() == lens.width_px && image.height() == lens.height_px) return;
          throw Error(fmt::format(
              "`rig` {}: camera {}: expected {} x {} px as it was calibrated with, found {} x {}",
              rig.file, camera, lens.width_px, lens.height_px, image.width(), image.height()));
        },
        progress);
  }
}

FixedCameras CalibrateFixedCameras(Recording& recording, const FixedCameraOptions& options,
                                   const fs::path& workspace, Progress& progress) {
  FixedCameras cameras;
  // Where clocks differ the first images are not of one time, but most of what they show stands.
  cameras.calibrated = FirstStep(recording, options, workspace, progress);
  TakeCameras(recording, cameras);
  if (options.free_clocks) {
    cameras.clocks = FindClocks(recording, cameras.lens, cameras.cam_from_world, progress);
    ShiftByClocks(cameras.clocks, recording, progress);
  }
  cameras.sparse = PointsOf(recording, cameras, options.max_size_px, cameras.calibrated.model);
  cameras.all_points = cameras.sparse;
  const size_t last = recording.steps().size() - 1;
  for (const size_t step : std::set<size_t>{last / 2, last}) {
    if (step == 0) continue;
    const std::string number = std::to_string(step);
    const capture::Capture photos =
        PhotosOfStep(recording, step, workspace / ("photos" + number), progress);
    WriteCameras(recording.cameras(), cameras.lens, cameras.cam_from_world,
                 workspace / ("cameras" + number));
    try {
      const CalibratedPhotos later = WithGivenCameras(
          photos, OptionsFor(photos, recording, options.calibrate),
          workspace / ("cameras" + number), workspace / ("points" + number), progress);
      Append(PointsOf(recording, cameras, options.max_size_px, later.model), cameras.all_points);
    } catch (const Interrupted&) {
      throw;
    } catch (const Error& error) {
      progress.Note(
          fmt::format("no points of time step {}: {}", recording.steps()[step].name, error.what()));
    }
  }
  return cameras;
}

View ViewOf(const FixedCameras& cameras, const Recording& recording, size_t camera,
            const std::vector<bool>& held_out, int max_size_px) {
  View view;
  view.name = recording.cameras()[camera];
  view.role = held_out[camera] ? ViewRole::kHeldOut : ViewRole::kSource;
  view.camera = calib::ShrunkCamera(cameras.lens[camera].Pinhole(), max_size_px);
  view.cam_from_world = cameras.cam_from_world[camera];
  return view;
}

}  // namespace dtr::pipeline
