#include "pipeline/import/detail/camera_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "calib/colmap/model_io.h"
#include "capture/ingest.h"
#include "dtr/base/error.h"
#include "dtr/base/file_names.h"
#include "dtr/io/formats/llff.h"
#include "dtr/io/formats/rgbd_capture.h"
#include "dtr/io/formats/transforms_json.h"
#include "dtr/io/image_io.h"
#include "pipeline/core/cameras/camera_distortion.h"
#include "pipeline/core/cameras/camera_formats.h"
#include "pipeline/core/cameras/foreign_cameras.h"
#include "pipeline/core/cameras/photo_scale.h"
#include "pipeline/core/model_grid.h"
#include "pipeline/core/photos/holdout.h"
#include "pipeline/core/photos/named_files.h"
#include "pipeline/import/detail/rgbd_files.h"
#include "pipeline/import/import.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

std::vector<io::SizedImage> SizedImages(const fs::path& images_dir) {
  std::error_code error;
  std::vector<io::SizedImage> images;
  for (const auto& entry : fs::directory_iterator(images_dir, error)) {
    if (!entry.is_regular_file() || !capture::IsImageExtension(entry.path().extension().string())) {
      continue;
    }
    images.push_back(SizedImageAt(images_dir, entry.path().filename().string()));
  }
  if (error) throw UsageError(images_dir.string() + ": cannot be listed: " + error.message());
  return images;
}

// Images below a folder, by their names without the extension; of several the first by name.
std::map<std::string, std::string> ImagesByStem(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file() || !capture::IsImageExtension(entry.path().extension().string())) {
      continue;
    }
    names.insert(entry.path().lexically_relative(folder).generic_string());
  }
  std::map<std::string, std::string> by_stem;
  for (const std::string& name : names) {
    by_stem.emplace(fs::path(name).replace_extension().generic_string(), name);
  }
  return by_stem;
}

// Leaves out what has no photo, or says so: `name` may leave its folder, which readers reject.
bool HasPhoto(const std::string& name, const CameraFileFolders& folders) {
  return !WhyUnsafeName(name).empty() || IsFile(folders.images / name);
}

// One line about what is missing; without allow_missing the end.
void TellMissing(const fs::path& file, const CameraFileFolders& folders, size_t cameras,
                 CamerasFromFile& out) {
  if (out.skipped.empty()) return;
  const auto& [name, reason] = out.skipped.front();
  const std::string what = fmt::format("{}: {} of its {} cameras have no photo, first {} ({})",
                                       file.string(), out.skipped.size(), cameras, name, reason);
  if (out.skipped.size() == cameras) throw Error(what + "; give the folder of its photos");
  if (!folders.allow_missing) {
    throw Error(what +
                "; copy the photos there, or give `allow_missing` to leave such cameras out");
  }
  out.notes.push_back(what + ": left out");
}

CamerasFromFile FromColmap(const fs::path& folder, const CameraFileFolders& folders) {
  const fs::path model_folder = colmap::ModelFolderIn(folder);
  CamerasFromFile cameras;
  calib::SfmModel model = ReadGivenModel(folder, &cameras.notes);
  const size_t all = model.images.size();
  for (calib::SfmImage& image : model.images) image.name = NameBelow(folders.images, image.name);
  std::erase_if(model.images, [&](const calib::SfmImage& image) {
    if (HasPhoto(image.name, folders)) return false;
    cameras.skipped.emplace_back(image.name,
                                 "not there: " + (folders.images / image.name).string());
    return true;
  });
  TellMissing(model_folder, folders, all, cameras);
  std::map<std::string, StoredSize> sizes;
  for (const calib::SfmImage& image : model.images) {
    const io::SizedImage photo = SizedImageAt(folders.images, image.name);
    sizes[image.name] = {photo.width_px, photo.height_px, photo.exif_orientation};
  }
  std::string scaled =
      ScaleToPhotos(sizes, GridOfModel(model_folder), model_folder.string(), model);
  if (!scaled.empty()) cameras.notes.push_back(std::move(scaled));
  for (const calib::SfmImage& image : model.images) {
    io::NamedCamera named;
    named.name = image.name;
    SetCameraModel(named, model.cameras.at(image.camera_id));
    named.cam_from_world = image.cam_from_world;
    cameras.list.cameras.push_back(named);
  }
  cameras.list.photo_grid = GridOfModel(model_folder);
  if (std::string line = LineOfUnsharedPoints(model, model_folder.string()); !line.empty()) {
    cameras.notes.push_back(std::move(line));
  } else if (!model.points.empty()) {
    cameras.model = std::move(model);
  }
  return cameras;
}

CamerasFromFile FromTransforms(const fs::path& file, const CameraFileFolders& folders) {
  io::TransformsPaths paths;
  paths.image_of = [&](const std::string& path) { return FindImage(folders.images, path); };
  const fs::path depth_dir = folders.depth.empty() ? folders.images : folders.depth;
  paths.depth_of = [&](const std::string& path) { return NameBelow(depth_dir, path); };
  // Below the photos, or beside them: programs write paths from where the file lies.
  std::vector<fs::path> mask_dirs = {folders.images, file.parent_path()};
  if (!folders.masks.empty()) mask_dirs = {folders.masks};
  paths.mask_of = [&](const std::string& path) {
    const auto holds = [&](const fs::path& dir) { return IsFile(dir / NameBelow(dir, path)); };
    const auto found = std::find_if(mask_dirs.begin(), mask_dirs.end(), holds);
    // All masks of a set lie below one folder: the first one found says which.
    if (found != mask_dirs.end()) mask_dirs = {fs::path(*found)};
    return NameBelow(mask_dirs.front(), path);
  };
  io::TransformsFile read = io::ReadTransformsJson(file, paths);
  CamerasFromFile cameras;
  cameras.list = std::move(read.list);
  cameras.mask_dir = mask_dirs.front().empty() ? fs::path(".") : mask_dirs.front();
  cameras.held_out = std::move(read.held_out);
  cameras.depth_unit = read.depth_unit;
  cameras.points_file = read.points_file;
  cameras.notes = std::move(read.notes);
  for (const io::FrameWithoutPhoto& frame : read.missing) {
    cameras.skipped.emplace_back(Printable(frame.path),
                                 fmt::format("frame {}: not there: {}", frame.frame,
                                             (folders.images / frame.path).string()));
  }
  TellMissing(file, folders, cameras.list.cameras.size() + read.missing.size(), cameras);
  return cameras;
}

CamerasFromFile FromCamerasJson(const fs::path& file, const CameraFileFolders& folders) {
  CamerasFromFile cameras;
  cameras.list = io::ReadCamerasJson(file);
  const size_t all = cameras.list.cameras.size();
  for (io::NamedCamera& named : cameras.list.cameras) {
    named.name = NameBelow(folders.images, named.name);
  }
  std::erase_if(cameras.list.cameras, [&](const io::NamedCamera& named) {
    if (HasPhoto(named.name, folders)) return false;
    cameras.skipped.emplace_back(named.name,
                                 "not there: " + (folders.images / named.name).string());
    return true;
  });
  TellMissing(file, folders, all, cameras);
  return cameras;
}

// Names of all images below a folder.
std::vector<std::string> ImagesBelow(const fs::path& folder) {
  std::error_code error;
  std::vector<std::string> names;
  fs::recursive_directory_iterator entries(folder, error);
  for (; !error && entries != fs::recursive_directory_iterator(); entries.increment(error)) {
    if (!IsFile(entries->path()) ||
        !capture::IsImageExtension(entries->path().extension().string())) {
      continue;
    }
    const std::string name = entries->path().lexically_relative(folder).generic_string();
    if (WhyUnsafeName(name).empty()) names.push_back(name);
  }
  if (error) throw UsageError(folder.string() + ": cannot be listed: " + error.message());
  return names;
}

CamerasFromFile FromForeign(const fs::path& file, const CameraFormat& format,
                            const CameraFileFolders& folders) {
  const std::string source = file.string();
  PlacedCameras placed =
      PlaceCameras(format.read(file), source, PhotoNames(ImagesBelow(folders.images)),
                   [&](const std::string& name) { return SizedImageAt(folders.images, name); });
  CamerasFromFile cameras;
  cameras.list = std::move(placed.list);
  cameras.notes = std::move(placed.notes);
  for (const auto& [path, entry] : placed.missing) {
    cameras.skipped.emplace_back(path,
                                 fmt::format("{}: not below {}", entry, folders.images.string()));
  }
  const size_t with_camera = cameras.list.cameras.size();
  TellMissing(file, folders, with_camera + placed.missing.size(), cameras);
  const std::string line =
      LeftOutLine(source, placed.left_out, with_camera + placed.missing.size());
  if (!line.empty()) cameras.notes.push_back(line);
  for (auto& [path, reason] : placed.left_out) {
    cameras.skipped.emplace_back(Printable(path), std::move(reason));
  }
  cameras.model = std::move(placed.model);
  return cameras;
}

}  // namespace

CamerasFromFile ReadCameraFile(const fs::path& file, const std::string& format,
                               const CameraFileFolders& folders) {
  const CameraFormat chosen = FormatOf(file, format, "`cameras`");
  const std::string kind = chosen.name;
  if (chosen.read != nullptr) return FromForeign(file, chosen, folders);
  if (kind == "colmap") return FromColmap(file, folders);
  if (io::IsRgbdFormat(kind)) return FromRgbdCapture(file, kind, folders);
  if (kind == "nerf") return FromTransforms(file, folders);
  if (kind == "llff") {
    CamerasFromFile cameras;
    cameras.list = io::ReadLlff(file, SizedImages(folders.images)).list;
    cameras.notes.push_back(file.string() + ": its nearest and farthest depths are not used");
    return cameras;
  }
  return FromCamerasJson(file, folders);
}

std::vector<std::string> PhotosWithoutCamera(const io::CameraList& list,
                                             const fs::path& images_dir) {
  std::set<std::string> used, folders;
  for (const io::NamedCamera& named : list.cameras) {
    used.insert({named.name, named.depth_file, named.mask_file});
    folders.insert(fs::path(named.name).parent_path().generic_string());
  }
  std::set<std::string> left;
  for (const std::string& folder : folders) {
    std::error_code error;
    fs::directory_iterator entries(images_dir / folder, error);
    for (; !error && entries != fs::directory_iterator(); entries.increment(error)) {
      const fs::path& file = entries->path();
      const bool is_photo = IsFile(file) && capture::IsImageExtension(file.extension().string()) &&
                            !file.stem().string().ends_with("_mask");
      const std::string name = (fs::path(folder) / file.filename()).generic_string();
      if (is_photo && !used.contains(name)) left.insert(name);
    }
  }
  return {left.begin(), left.end()};
}

void NameMasks(const fs::path& mask_dir, const fs::path& images_dir, io::CameraList& list) {
  if (!fs::is_directory(mask_dir)) {
    throw UsageError(fmt::format("`masks` {}: no such folder", mask_dir.string()));
  }
  const auto is_named = [](const io::NamedCamera& camera) { return !camera.mask_file.empty(); };
  if (std::any_of(list.cameras.begin(), list.cameras.end(), is_named)) return;
  const std::map<std::string, std::string> masks = ImagesByStem(mask_dir);
  for (io::NamedCamera& camera : list.cameras) {
    const std::string stem = fs::path(camera.name).replace_extension().generic_string();
    for (const std::string& name : {stem + "_mask", camera.name, stem}) {
      const auto mask = masks.find(name);
      std::error_code ignored;  // masks may lie beside the photos, which are none
      if (mask == masks.end() ||
          fs::equivalent(mask_dir / mask->second, images_dir / camera.name, ignored)) {
        continue;
      }
      camera.mask_file = mask->second;
      break;
    }
  }
  if (list.cameras.empty() || std::any_of(list.cameras.begin(), list.cameras.end(), is_named)) {
    return;
  }
  const std::string& first = list.cameras.front().name;
  throw UsageError(fmt::format(
      "`masks` {}: expected a mask of {} or of another photo, called {}.png or "
      "{}.png, found none",
      mask_dir.string(), first, fs::path(first).replace_extension().generic_string(), first));
}

std::set<std::string> NamesHeldOut(const std::string& spec, const io::CameraList& list) {
  std::vector<std::string> names;
  for (const io::NamedCamera& camera : list.cameras) names.push_back(camera.name);
  std::sort(names.begin(), names.end());
  const std::vector<bool> held_out = ChooseHeldOut(spec, names);
  std::set<std::string> chosen;
  for (size_t i = 0; i < names.size(); ++i) {
    if (held_out[i]) chosen.insert(names[i]);
  }
  return chosen;
}

}  // namespace dtr::pipeline
