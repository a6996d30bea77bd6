#include "pipeline/core/photos/camera_groups.h"

#include <algorithm>
#include <filesystem>
#include <utility>

namespace dtr::pipeline {
namespace {

// What photos must have in common to be of one camera: the size is part of it for photos from a
// capture, not for those of a rig.
std::string PoolKey(const capture::Photo& photo) {
  return photo.camera_group + "|" + std::to_string(photo.width_px) + "x" +
         std::to_string(photo.height_px);
}

// Turned upright, a camera has its principal point and its axes elsewhere.
std::string TurnedBy(const capture::Photo& photo) {
  const size_t at = photo.camera_group.find(capture::kTurnedGroup);
  return at == std::string::npos ? "" : photo.camera_group.substr(at);
}

}  // namespace

std::string FolderOf(const std::string& photo_name) {
  return std::filesystem::path(photo_name).parent_path().generic_string();
}

CameraGroups::CameraGroups(const std::vector<capture::Photo>& photos, CameraPer per, bool given)
    : per_(per), given_(given) {
  if (per != CameraPer::kAuto || given) return;
  std::map<std::string, std::map<std::string, int>> folders;
  for (const capture::Photo& photo : photos) ++folders[PoolKey(photo)][FolderOf(photo.name)];
  for (const auto& [group, counts] : folders) {
    FolderPool pool;
    pool.group = group;
    int most = 0;
    for (const auto& [folder, count] : counts) {
      if (count < kMinPhotosPerFolder) {
        pool.small.push_back(folder);
        continue;
      }
      pool.photos_of[folder] = count;
      if (count > most) pool.largest = folder;
      most = std::max(most, count);
    }
    if (pool.photos_of.size() < 2) continue;
    for (const std::string& folder : pool.small) pool.photos_of[pool.largest] += counts.at(folder);
    pools_.push_back(std::move(pool));
  }
}

std::string CameraGroups::GroupOf(const capture::Photo& photo) const {
  if (given_) return photo.camera_group;
  switch (per_) {
    case CameraPer::kSet:
      return "set" + TurnedBy(photo);
    case CameraPer::kFolder:
      return "folder " + FolderOf(photo.name) + TurnedBy(photo);
    case CameraPer::kPhoto:
      return "photo " + photo.name;
    case CameraPer::kAuto:
      break;
  }
  const auto pool = std::find_if(pools_.begin(), pools_.end(),
                                 [&](const auto& p) { return p.group == PoolKey(photo); });
  if (pool == pools_.end()) return photo.camera_group;
  return photo.camera_group + "|folder " + *FolderIn(*pool, photo);
}

std::optional<std::string> CameraGroups::FolderIn(const FolderPool& pool,
                                                  const capture::Photo& photo) const {
  if (pool.group != PoolKey(photo)) return {};
  const std::string folder = FolderOf(photo.name);
  return pool.photos_of.contains(folder) ? folder : pool.largest;
}

}  // namespace dtr::pipeline
