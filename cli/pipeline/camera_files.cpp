#include "cli/pipeline/camera_files.h"

#include <fmt/format.h>

#include <algorithm>

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

io::SizedImage SizeOf(const fs::path& images_dir, const std::string& name) {
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
            {}};
  }
  return {io::ReadCamerasJson(file), {}};
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
