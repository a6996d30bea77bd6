#include "cli/pipeline/camera_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "calib/colmap/model_io.h"
#include "calib/sparse_from_sfm.h"
#include "capture/ingest.h"
#include "cli/pipeline/holdout.h"
#include "dtr/base/error.h"
#include "dtr/io/formats/llff.h"
#include "dtr/io/formats/transforms_json.h"
#include "dtr/io/image_io.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

// A name without an extension, as in NeRF's own files, is that of the one image called so.
std::string WithExtension(const fs::path& images_dir, const std::string& name) {
  std::error_code ignored;
  if (fs::is_regular_file(images_dir / name, ignored)) return name;
  std::set<std::string> found;
  const fs::path folder = (images_dir / name).parent_path();
  fs::directory_iterator entries(folder, ignored);
  for (; !ignored && entries != fs::directory_iterator(); entries.increment(ignored)) {
    const fs::path& file = entries->path();
    if (file.stem() == fs::path(name).filename() &&
        capture::IsImageExtension(file.extension().string())) {
      found.insert(file.extension().string());
    }
  }
  return found.size() == 1 ? name + *found.begin() : name;
}

io::SizedImage SizeOf(const fs::path& images_dir, const std::string& given) {
  const std::string name = WithExtension(images_dir, given);
  const io::ImageHeader header = io::ReadImageHeader(images_dir / name);
  return {name, header.width_px, header.height_px};
}

std::vector<io::SizedImage> SizedImages(const fs::path& images_dir) {
  std::error_code error;
  std::vector<io::SizedImage> images;
  for (const auto& entry : fs::directory_iterator(images_dir, error)) {
    if (!entry.is_regular_file() || !capture::IsImageExtension(entry.path().extension().string())) {
      continue;
    }
    images.push_back(SizeOf(images_dir, entry.path().filename().string()));
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

CamerasFromFile FromColmap(const fs::path& folder) {
  const calib::SfmModel model = colmap::ReadModel(folder);
  CamerasFromFile cameras;
  std::vector<std::string> names;
  std::vector<PinholeCamera> pinholes;
  for (const calib::SfmImage& image : model.images) {
    const calib::LensCamera& lens = model.cameras.at(image.camera_id);
    if (!lens.IsUndistorted()) {
      throw Error(
          fmt::format("{}: camera of '{}': expected no distortion, found {}; undistort the "
                      "images first, or use dtr build --poses",
                      folder.string(), image.name, calib::NameOf(lens.model)));
    }
    io::NamedCamera named;
    named.name = image.name;
    named.camera = lens.Pinhole();
    named.cam_from_world = image.cam_from_world;
    names.push_back(image.name);
    pinholes.push_back(named.camera);
    cameras.list.cameras.push_back(named);
  }
  cameras.points = calib::ToSparseScene(model, names, pinholes);
  return cameras;
}

std::string FormatOf(const fs::path& file) {
  if (fs::is_directory(file)) return "colmap";
  if (file.extension() == ".npy") return "llff";
  if (file.filename().string().starts_with("transforms")) return "nerf";
  if (file.extension() == ".json") return "cameras-json";
  throw UsageError(
      fmt::format("{}: expected the folder of a COLMAP model, a cameras.json, a transforms.json or "
                  "a poses_bounds.npy, found another name; give --format",
                  file.string()));
}

}  // namespace

std::vector<std::string> CameraFormats() { return {"cameras-json", "colmap", "llff", "nerf"}; }

CamerasFromFile ReadCameraFile(const fs::path& file, const std::string& format,
                               const fs::path& images_dir) {
  if (!fs::exists(file)) {
    throw UsageError(fmt::format("--cameras {}: no such file or folder", file.string()));
  }
  const std::string kind = format.empty() ? FormatOf(file) : format;
  if (kind == "colmap") return FromColmap(file);
  if (kind == "llff") return {io::ReadLlff(file, SizedImages(images_dir)).list, {}};
  if (kind == "nerf") {
    return {io::ReadTransformsJson(
                file, [&](const std::string& name) { return SizeOf(images_dir, name); }),
            {},
            images_dir};
  }
  return {io::ReadCamerasJson(file), {}};
}

void NameMasks(const fs::path& mask_dir, const fs::path& images_dir, io::CameraList& list) {
  if (!fs::is_directory(mask_dir)) {
    throw UsageError(fmt::format("--masks {}: no such folder", mask_dir.string()));
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
      "--masks {}: expected a mask of {} or of another photo, called {}.png or "
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
