// Sets of photos with calibrated cameras and no depth, and plaza, which has all.
#include "datasets/convert/converters.h"
#include "dtr/base/error.h"
#include "dtr/io/formats/foreign_depth.h"
#include "dtr/io/formats/llff.h"
#include "dtr/io/formats/text_cameras.h"

namespace dtr::datasets {
namespace fs = std::filesystem;

io::CameraList ConvertFountain(const fs::path& source, const ConvertedFolder& out) {
  const std::string ending = ".camera";
  io::CameraList list;
  list.unit = LengthUnit::kMetre;
  for (const std::string& file : FilesEndingIn(source / "gt_cameras", ending)) {
    const fs::path camera_file = source / "gt_cameras" / file;
    const io::StrechaCamera given = io::ReadStrechaCamera(camera_file);
    io::NamedCamera named;
    named.name = file.substr(0, file.size() - ending.size());
    // The format does not say where its pixels begin, and the data do not tell half a pixel apart
    // (docs/CONVENTIONS.md); K is taken as written.
    const PinholeCamera full_size = io::CameraFromK(given.k, given.width_px, given.height_px,
                                                    io::PixelOrigin::kCorner, camera_file.string());
    named.camera =
        io::ScaledToImage(full_size, ImageAt(source / "images", named.name), camera_file.string());
    named.cam_from_world = given.cam_from_world;
    out.CopyImage(source / "images" / named.name, named.name);
    list.cameras.push_back(named);
  }
  return list;
}

namespace {

io::CameraList ConvertPar(const fs::path& par_file, const fs::path& images, double unit_m,
                          io::PixelOrigin origin, const ConvertedFolder& out) {
  io::CameraList list;
  list.unit = LengthUnit::kMetre;
  for (const io::ParCamera& given : io::ReadMiddleburyPar(par_file)) {
    const io::SizedImage image = ImageAt(images, given.name);
    io::NamedCamera named;
    named.name = given.name;
    named.camera = io::CameraFromK(given.k, image.width_px, image.height_px, origin,
                                   par_file.string() + ": " + given.name);
    named.cam_from_world = given.cam_from_world;
    named.cam_from_world.translation *= unit_m;
    out.CopyImage(images / given.name, given.name);
    list.cameras.push_back(named);
  }
  return list;
}

}  // namespace

io::CameraList ConvertDtu(const fs::path& source, const ConvertedFolder& out) {
  constexpr double kMillimetre = 0.001;
  // Halved from the full size without a shift; origins in the corner and at the centre would differ
  // by a quarter of a pixel here, less than the calibration's residual.
  return ConvertPar(source / "cameras_half_par.txt", source / "images", kMillimetre,
                    io::PixelOrigin::kCorner, out);
}

io::CameraList ConvertTemple(const fs::path& source, const ConvertedFolder& out) {
  return ConvertPar(source / "templeSR_par.txt", source, 1.0, io::PixelOrigin::kCentre, out);
}

io::CameraList ConvertFern(const fs::path& source, const ConvertedFolder& out) {
  const fs::path images = source / "images_4";
  std::vector<io::SizedImage> sizes;
  for (const std::string& name : FilesEndingIn(images, ".png")) {
    sizes.push_back(ImageAt(images, name));
    out.CopyImage(images / name, name);
  }
  return io::ReadLlff(source / "poses_bounds.npy", sizes).list;
}

io::CameraList ConvertPlaza(const fs::path& source, const ConvertedFolder& out) {
  io::CameraList list = io::ReadCamerasJson(source / "cameras.json");
  list.unit = LengthUnit::kMetre;  // "to be read as metres", SOURCE.md
  for (io::NamedCamera& named : list.cameras) {
    const PinholeCamera& camera = named.camera;
    out.CopyImage(source / "images" / named.name, named.name);
    named.depth_file = out.WriteDepth(
        named.name, io::ReadForeignDepth(source / "depth" / named.depth_file, named.depth_kind, 1.0,
                                         camera.width_px(), camera.height_px()));
  }
  return list;
}

}  // namespace dtr::datasets
