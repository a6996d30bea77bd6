#include "pipeline/core/cameras/foreign_cameras.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "dtr/base/error.h"
#include "dtr/base/file_names.h"
#include "dtr/io/formats/plausible_intrinsics.h"
#include "pipeline/core/cameras/camera_distortion.h"
#include "pipeline/core/cameras/point_conventions.h"

namespace dtr::pipeline {
namespace {

// Pixels of the file's image: what counts in long sides or from the middle is turned into that.
io::Distortion InPixels(const io::ForeignIntrinsics& intrinsics, int width_px, int height_px) {
  io::Distortion lens = intrinsics.lens;
  if (intrinsics.in_long_sides) {
    const double side = std::max(width_px, height_px);
    for (size_t i = 0; i < 4; ++i) lens.params[i] *= side;
    if (lens.model.ends_with("_AFFINE")) lens.params.back() *= side;
  }
  if (intrinsics.from_centre) {
    lens.params[2] += width_px / 2.0;
    lens.params[3] += height_px / 2.0;
  }
  return lens;
}

// Absolute pixels without the size of the image: images of another size show by the principal
// point.
void RequireOwnSize(const io::ForeignIntrinsics& intrinsics, const io::SizedImage& image,
                    const std::string& where) {
  constexpr double kMaxShare = 0.25;
  if (intrinsics.width_px != 0 || intrinsics.from_centre) return;
  const double cx = intrinsics.lens.params[2], cy = intrinsics.lens.params[3];
  if (std::abs(cx - image.width_px / 2.0) <= kMaxShare * image.width_px &&
      std::abs(cy - image.height_px / 2.0) <= kMaxShare * image.height_px) {
    return;
  }
  throw Error(fmt::format(
      "{}: its principal point ({:g}, {:g}) is far from the middle of {} ({} x {} px): the cameras "
      "seem to be of images of about {:.0f} x {:.0f} px; give these",
      where, cx, cy, image.name, image.width_px, image.height_px, 2 * cx, 2 * cy));
}

PlacedCamera CameraOn(const io::ForeignCamera& camera, const io::SizedImage& image,
                      const std::string& where) {
  io::ForeignIntrinsics intrinsics = camera.intrinsics;
  RequireOwnSize(intrinsics, image, where);
  const bool has_size = intrinsics.width_px != 0;
  int width_px = has_size ? intrinsics.width_px : image.width_px;
  int height_px = has_size ? intrinsics.height_px : image.height_px;
  if (intrinsics.even_size && image.width_px - width_px >= 0 && image.width_px - width_px <= 1 &&
      image.height_px - height_px >= 0 && image.height_px - height_px <= 1) {
    width_px = image.width_px;
    height_px = image.height_px;
  }
  io::Distortion lens = InPixels(intrinsics, width_px, height_px);
  io::RequirePlausibleFocal(lens.params[0], lens.params[1], width_px, height_px, where);
  io::RequirePlausibleCentre(lens.params[2], lens.params[3], width_px, height_px, where);
  PlacedCamera on;
  on.named.name = image.name;
  on.named.cam_from_world = camera.cam_from_world;
  const PinholeCamera full(width_px, height_px, lens.params[0], lens.params[1], lens.params[2],
                           lens.params[3]);
  on.named.camera = io::ScaledToImage(full, image, where);
  on.scale_x = static_cast<double>(on.named.camera.width_px()) / width_px;
  on.scale_y = static_cast<double>(on.named.camera.height_px()) / height_px;
  if (intrinsics.from_centre) on.shift = Eigen::Vector2d(width_px, height_px) / 2;
  if (lens.model != "PINHOLE") {
    const PinholeCamera& scaled = on.named.camera;
    lens.params[0] = scaled.fx_px();
    lens.params[1] = scaled.fy_px();
    lens.params[2] = scaled.cx_px();
    lens.params[3] = scaled.cy_px();
    if (lens.model.ends_with("_AFFINE")) lens.params.back() *= on.scale_x;
    on.named.distortion = lens;
  }
  return on;
}

std::string ListOf(const std::vector<std::string>& names) {
  constexpr size_t kMax = 3;
  std::string list;
  for (size_t i = 0; i < std::min(kMax, names.size()); ++i) {
    list += (i > 0 ? ", " : "") + names[i];
  }
  return names.size() > kMax ? list + ", ..." : list;
}

// Images and points of the cameras that have a photo. `place`: of a camera of the scene in
// `placed`.
std::optional<calib::SfmModel> ModelOf(const io::ForeignScene& scene,
                                       const std::vector<PlacedCamera>& placed,
                                       const std::vector<size_t>& place) {
  if (scene.points.empty()) return std::nullopt;
  calib::SfmModel model;
  std::map<std::pair<std::string, std::vector<double>>, std::uint32_t> id_of;
  for (size_t i = 0; i < placed.size(); ++i) {
    const calib::LensCamera lens = CameraModelOf(placed[i].named);
    std::vector<double> key = lens.params;
    key.push_back(lens.width_px);
    key.push_back(lens.height_px);
    const auto next = static_cast<std::uint32_t>(id_of.size() + 1);
    const auto id = id_of.try_emplace({calib::NameOf(lens.model), key}, next).first->second;
    model.cameras.emplace(id, lens);
    model.images.push_back({static_cast<std::uint32_t>(i + 1),
                            placed[i].named.name,
                            id,
                            placed[i].named.cam_from_world,
                            {}});
  }
  std::uint64_t point_id = 0;
  for (const io::ForeignPoint& point : scene.points) {
    std::vector<std::pair<size_t, Eigen::Vector2d>> seen;
    for (const auto& [camera, pixel] : point.seen) {
      if (place[camera] == kNotPlaced) continue;
      seen.emplace_back(place[camera], placed[place[camera]].PhotoPixel(pixel));
    }
    // Of two features of one image on a point the first counts.
    std::stable_sort(seen.begin(), seen.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    seen.erase(std::unique(seen.begin(), seen.end(),
                           [](const auto& a, const auto& b) { return a.first == b.first; }),
               seen.end());
    if (seen.size() < 2) continue;
    model.points[++point_id] = {point.p_in_world, point.rgb, 0};
    for (const auto& [image, pixel] : seen) {
      model.images[image].features.push_back({pixel, point_id});
    }
  }
  if (model.points.empty()) return std::nullopt;
  std::sort(model.images.begin(), model.images.end(),
            [](const auto& a, const auto& b) { return a.name < b.name; });
  return model;
}

}  // namespace

PlacedCameras PlaceCameras(io::ForeignScene scene, const std::string& source,
                           const PhotoNames& photos,
                           const std::function<io::SizedImage(const std::string&)>& sized) {
  PlacedCameras out;
  std::vector<PlacedCamera> placed;
  std::vector<size_t> place(scene.cameras.size(), kNotPlaced);
  std::map<std::string, std::string> entry_of;  // by photo
  for (size_t i = 0; i < scene.cameras.size(); ++i) {
    const io::ForeignCamera& camera = scene.cameras[i];
    const std::string where =
        fmt::format("{}: {} ({})", source, camera.entry, Printable(camera.path));
    const std::vector<std::string> meant = photos.Meant(camera.path);
    if (meant.size() > 1) {
      throw Error(fmt::format(
          "{}: may mean any of {} photos, {}; give a folder with one of them, or name them apart",
          where, meant.size(), ListOf(meant)));
    }
    if (meant.empty()) {
      out.missing.emplace_back(Printable(camera.path), camera.entry);
      continue;
    }
    const auto [other, fresh] = entry_of.try_emplace(meant.front(), camera.entry);
    if (!fresh) {
      throw Error(fmt::format("{}: means the photo {}, which {} means too; name the photos apart",
                              where, meant.front(), other->second));
    }
    place[i] = placed.size();
    placed.push_back(CameraOn(camera, sized(meant.front()), where));
  }
  std::string line = SettleConventions(scene, source, place, placed);
  if (!line.empty()) scene.notes.push_back(std::move(line));
  out.list.unit = scene.unit;
  out.list.world_origin = scene.world_origin;
  out.list.photo_grid = scene.photo_grid;
  for (const PlacedCamera& on : placed) out.list.cameras.push_back(on.named);
  out.model = ModelOf(scene, placed, place);
  out.left_out = std::move(scene.left_out);
  out.notes = std::move(scene.notes);
  return out;
}

io::CameraList CamerasWithoutPhotos(const io::ForeignScene& scene, const std::string& source) {
  io::CameraList list;
  list.unit = scene.unit;
  list.world_origin = scene.world_origin;
  for (const io::ForeignCamera& camera : scene.cameras) {
    const std::string where =
        fmt::format("{}: {} ({})", source, camera.entry, Printable(camera.path));
    if (camera.intrinsics.width_px == 0) {
      throw Error(where + ": the file does not say the size of its images; give a cameras.json");
    }
    io::SizedImage image{camera.path, camera.intrinsics.width_px, camera.intrinsics.height_px};
    list.cameras.push_back(CameraOn(camera, image, where).named);
  }
  return list;
}

std::string LeftOutLine(const std::string& source,
                        const std::vector<std::pair<std::string, std::string>>& left_out,
                        size_t cameras) {
  if (left_out.empty()) return "";
  return fmt::format("{}: {} of its {} photos have no camera, first {} ({})", source,
                     left_out.size(), left_out.size() + cameras, Printable(left_out.front().first),
                     left_out.front().second);
}

}  // namespace dtr::pipeline
