#include "pipeline/core/photos/undistort_photos.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "calib/lens_groups.h"
#include "calib/undistort.h"
#include "capture/ingest.h"
#include "dtr/base/error.h"
#include "pipeline/core/run/side_by_side.h"

namespace dtr::pipeline {
namespace {

// Lenses that a stabiliser moved, with the mean principal point of the photos to render from: those
// that are held out move nothing.
std::vector<calib::LensCamera> StabilisedLenses(const capture::Capture& capture,
                                                const std::vector<bool>& held_out,
                                                const calib::SfmModel& model) {
  std::set<std::string> sources;
  for (size_t i = 0; i < capture.photos.size(); ++i) {
    if (!held_out[i]) sources.insert(capture.photos[i].name);
  }
  std::map<std::uint32_t, calib::LensCamera> used;
  for (const calib::SfmImage& image : model.images) {
    if (sources.contains(image.name)) {
      used.emplace(image.camera_id, model.cameras.at(image.camera_id));
    }
  }
  std::vector<calib::LensCamera> lenses;
  for (const calib::LensGroup& group : calib::LensGroups(used)) {
    if (group.cameras.size() > 1) lenses.push_back(group.lens);
  }
  return lenses;
}

// The pinhole camera that photos of a camera are drawn on: its own, so that nothing that a photo
// shows is cut off. Held-out photos of a stabilised lens share one: a frame is compared where a
// lens that nobody moved would have seen it.
PinholeCamera CameraToDrawOn(const calib::LensCamera& camera, ViewRole role,
                             const std::vector<calib::LensCamera>& stabilised) {
  if (role == ViewRole::kSource || camera.IsUndistorted()) return camera.Pinhole();
  const auto lens = std::find_if(stabilised.begin(), stabilised.end(), [&](const auto& other) {
    return calib::SameButForPrincipalPoint(other, camera);
  });
  return lens == stabilised.end() ? camera.Pinhole() : lens->Pinhole();
}

void RequireSize(const capture::Photo& photo, const calib::LensCamera& lens) {
  if (lens.width_px == photo.width_px && lens.height_px == photo.height_px) return;
  throw Error(
      fmt::format("{}: expected a photo of {}x{} pixels as its camera has, found {}x{}; give "
                  "cameras for these photos",
                  photo.name, lens.width_px, lens.height_px, photo.width_px, photo.height_px));
}

// For a photo while it is decoded, drawn and coded again.
constexpr double kBytesPerPixel = 24;

}  // namespace

std::vector<View> UndistortPhotos(const capture::Capture& capture,
                                  const CalibratedPhotos& calibrated,
                                  const std::vector<bool>& held_out,
                                  const UndistortOptions& options, io::SetWriter& writer,
                                  Progress& progress, const Part& part) {
  const calib::SfmModel& model = calibrated.model;
  std::map<std::string, const calib::SfmImage*> registered;
  for (const auto& image : model.images) registered[image.name] = &image;
  const bool undistorted =
      std::all_of(model.cameras.begin(), model.cameras.end(),
                  [](const auto& camera) { return camera.second.IsUndistorted(); });
  if (undistorted) progress.Note("undistortion left out: no camera has distortion");
  const auto stabilised = StabilisedLenses(capture, held_out, model);
  std::vector<View> views;
  std::vector<const capture::Photo*> photos;  // of the views
  for (size_t i = 0; i < capture.photos.size(); ++i) {
    const capture::Photo& photo = capture.photos[i];
    const auto found = registered.find(photo.name);
    if (found == registered.end()) continue;
    const calib::LensCamera& lens = model.cameras.at(found->second->camera_id);
    RequireSize(photo, lens);
    View view;
    view.id = photo.id;
    view.name = photo.name;
    view.role = held_out[i] ? ViewRole::kHeldOut : ViewRole::kSource;
    view.camera =
        calib::ShrunkCamera(CameraToDrawOn(lens, view.role, stabilised), options.max_size_px);
    view.cam_from_world = found->second->cam_from_world;
    views.push_back(std::move(view));
    photos.push_back(&photo);
  }
  const size_t begin = part.Begin(views.size()), end = part.End(views.size());
  const auto bytes = [&](size_t k) {
    const capture::Photo& photo = *photos[begin + k];
    return std::max(capture::MemoryOf(photo), kBytesPerPixel * photo.width_px * photo.height_px);
  };
  const auto draw = [&](size_t k) {
    View& view = views[begin + k];
    if (writer.RestoreView(view)) return;
    const capture::Photo& photo = *photos[begin + k];
    const calib::LensCamera& lens = model.cameras.at(registered.at(photo.name)->camera_id);
    const capture::PhotoPixels pixels = capture::ReadPhotoAndMask(photo);
    calib::UndistortedPhoto flat =
        calib::Undistort(pixels.image, pixels.mask, lens,
                         CameraToDrawOn(lens, view.role, stabilised), options.max_size_px);
    view.image = std::move(flat.image);
    view.mask = std::move(flat.mask);
    writer.WriteView(view, calibrated.unit);
    view.image = {};
    view.mask = {};
  };
  SideBySide(end - begin, undistorted ? "reading photos" : "undistorting", options.memory_gb, bytes,
             progress, draw);
  return views;
}

}  // namespace dtr::pipeline
