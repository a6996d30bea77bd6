#include "pipeline/core/photos/folder_cameras.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace dtr::pipeline {
namespace {

// What the model has of a pool.
struct Registered {
  std::map<std::uint32_t, std::string> folder_of;  // camera -> folder whose photos it took
  int photos = 0;

  std::vector<std::uint32_t> Cameras() const {
    std::vector<std::uint32_t> ids;
    for (const auto& [id, folder] : folder_of) ids.push_back(id);
    return ids;
  }
};

Registered RegisteredOf(const FolderPool& pool, const CameraGroups& groups,
                        const capture::Capture& capture, const calib::SfmModel& model) {
  std::map<std::string, const capture::Photo*> photos;
  for (const capture::Photo& photo : capture.photos) photos[photo.name] = &photo;
  Registered registered;
  for (const calib::SfmImage& image : model.images) {
    const capture::Photo& photo = *photos.at(image.name);
    const auto folder = groups.FolderIn(pool, photo);
    if (!folder) continue;
    registered.folder_of[image.camera_id] = *folder;
    ++registered.photos;
  }
  return registered;
}

std::string Shown(const std::string& folder) { return folder.empty() ? "." : folder; }

// "a, b: f 420.1 px; c: f 300.2 px", at most three.
std::string FocalLengths(const calib::SfmModel& model, const Registered& registered,
                         const std::vector<std::vector<std::uint32_t>>& cameras) {
  constexpr size_t kShown = 3;
  std::string text;
  for (size_t i = 0; i < std::min(kShown, cameras.size()); ++i) {
    std::string folders;
    for (size_t k = 0; k < std::min(kShown, cameras[i].size()); ++k) {
      folders += (k > 0 ? ", " : "") + Shown(registered.folder_of.at(cameras[i][k]));
    }
    if (cameras[i].size() > kShown) folders += ", ...";
    text += fmt::format("{}{}: f {:.1f} px", i > 0 ? "; " : "", folders,
                        model.cameras.at(cameras[i].front()).params.front());
  }
  return cameras.size() > kShown ? text + "; ..." : text;
}

std::string LineFor(const calib::SharedCameras& result, const Registered& registered,
                    const std::string& not_tested) {
  const size_t folders = registered.folder_of.size();
  std::string line = fmt::format("{} photos in {} folders: ", registered.photos, folders);
  const std::string focal = FocalLengths(result.model, registered, result.groups);
  if (!not_tested.empty()) {
    return line + fmt::format(
                      "separate intrinsics per folder, not tested: {} ({}); `camera_per` set "
                      "has them share",
                      not_tested, focal);
  }
  if (result.groups.size() == 1) {
    return line + fmt::format(
                      "shared intrinsics (held-out error {:.3g} px, {:.3g} px with separate "
                      "ones per folder)",
                      result.shared_px, result.separate_px);
  }
  const std::string what = result.groups.size() == folders
                               ? "separate intrinsics per folder"
                               : fmt::format("{} cameras", result.groups.size());
  return line +
         fmt::format("{} (held-out error {:.3g} px against {:.3g} px with shared ones{}); {}", what,
                     result.separate_px, result.shared_px,
                     result.shared_converged ? "" : ", which do not converge", focal);
}

FolderSharing ReportOf(const calib::SharedCameras& result, const Registered& registered,
                       const std::string& not_tested) {
  FolderSharing report;
  report.photos = registered.photos;
  for (const auto& [id, folder] : registered.folder_of) report.folders.push_back(Shown(folder));
  for (const auto& group : result.groups) {
    FolderSharing::Camera& camera = report.cameras.emplace_back();
    for (const std::uint32_t id : group) {
      camera.folders.push_back(Shown(registered.folder_of.at(id)));
    }
    camera.focal_px = result.model.cameras.at(group.front()).params.front();
  }
  report.not_tested = not_tested;
  report.shared_px = result.shared_px;
  report.separate_px = result.separate_px;
  report.low_px2 = result.low_px2;
  report.high_px2 = result.high_px2;
  report.shared_converged = result.shared_converged;
  return report;
}

}  // namespace

FolderCameras ChooseFolderCameras(const CameraGroups& groups, const capture::Capture& capture,
                                  const calib::SfmModel& model, bool test,
                                  const calib::SharingOptions& options) {
  FolderCameras out;
  out.model = model;
  for (const FolderPool& pool : groups.pools()) {
    const Registered registered = RegisteredOf(pool, groups, capture, out.model);
    if (registered.folder_of.size() < 2) continue;  // one camera: nothing to decide
    calib::SharedCameras result;
    std::string not_tested = "intrinsics are taken as they are";
    if (test) {
      result = calib::ShareCameras(out.model, registered.Cameras(), options);
      not_tested = result.not_tested;
    } else {
      result.model = out.model;
      for (const std::uint32_t id : registered.Cameras()) result.groups.push_back({id});
    }
    out.notes.push_back(LineFor(result, registered, not_tested));
    if (!pool.small.empty()) {
      out.notes.back() += fmt::format("; {} folders of fewer than {} photos share with {}",
                                      pool.small.size(), kMinPhotosPerFolder, Shown(pool.largest));
    }
    out.tests.push_back(ReportOf(result, registered, not_tested));
    out.model = std::move(result.model);
  }
  return out;
}

}  // namespace dtr::pipeline
