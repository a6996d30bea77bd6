#include "pipeline/core/cameras/panorama_poses.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "dtr/base/error.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

int ObservationsOf(const calib::SfmImage& image) {
  return static_cast<int>(
      std::count_if(image.features.begin(), image.features.end(),
                    [](const auto& f) { return f.point_id != calib::SfmFeature::kNoPoint; }));
}

// Takes images out, their observations with them, and points that fewer than two others see.
void TakeOut(const std::set<std::string>& names, calib::SfmModel& model) {
  std::erase_if(model.images,
                [&](const calib::SfmImage& image) { return names.contains(image.name); });
  std::map<std::uint64_t, int> seen;
  for (const calib::SfmImage& image : model.images) {
    for (const auto& f : image.features) {
      if (f.point_id != calib::SfmFeature::kNoPoint) ++seen[f.point_id];
    }
  }
  std::erase_if(model.points, [&](const auto& point) {
    const auto found = seen.find(point.first);
    return found == seen.end() || found->second < 2;
  });
  for (calib::SfmImage& image : model.images) {
    for (auto& f : image.features) {
      if (f.point_id != calib::SfmFeature::kNoPoint && !model.points.contains(f.point_id)) {
        f.point_id = calib::SfmFeature::kNoPoint;
      }
    }
  }
}

}  // namespace

void CompletePanoramas(const capture::Capture& capture, const SetRig& rig,
                       const std::vector<sfm::SfmImageInput>& inputs, const fs::path& workspace,
                       const sfm::SfmOptions& sfm_options, sfm::SfmResult& sfm,
                       Progress& progress) {
  const auto photo_of = PhotosOfRig(rig, capture);
  const auto poses = calib::RigPosesOf(sfm.model, rig.known, photo_of);
  std::map<std::string, Pose> cam_from_world;
  for (const auto& [name, photo] : photo_of) {
    const auto found = poses.find(photo.frame);
    if (found == poses.end()) continue;
    cam_from_world[name] = rig.known.cam_from_rig[photo.camera] * found->second;
  }
  const size_t found_alone = sfm.model.images.size();
  calib::SfmModel model =
      sfm::PointsOfMatches(workspace / "photos", inputs, workspace / "sfm", sfm_options,
                           rig.known.lenses.front(), cam_from_world, progress);
  std::map<std::string, std::string> why;
  for (bool changed = true; changed;) {
    std::set<std::string> poor;
    for (const calib::SfmImage& image : model.images) {
      const int count = ObservationsOf(image);
      if (count >= kMinViewObservations) continue;
      poor.insert(image.name);
      why[image.name] = fmt::format(
          "{} of its {} features became points of the scene, {} are needed: it shows "
          "sky, a plain surface or what no other panorama shows",
          count, image.features.size(), kMinViewObservations);
    }
    changed = !poor.empty();
    TakeOut(poor, model);
  }
  std::set<std::string> panoramas;
  for (const calib::SfmImage& image : model.images) {
    panoramas.insert(photo_of.at(image.name).frame);
  }
  if (panoramas.size() < 2) {
    throw Error(fmt::format(
        "structure from motion: of {} views of panoramas, those of {} panoramas have points in "
        "common, 2 or more are needed; take panoramas closer to each other",
        capture.photos.size(), panoramas.size()));
  }
  progress.Note(
      fmt::format("{} panoramas have a camera; {} of their views were found alone, {} are used",
                  panoramas.size(), found_alone, model.images.size()));
  for (const calib::SfmImage& image : model.images) {
    sfm.report.why_not_registered.erase(image.name);
  }
  for (auto& [name, reason] : why) sfm.report.why_not_registered[name] = std::move(reason);
  sfm.model = std::move(model);
}

}  // namespace dtr::pipeline
