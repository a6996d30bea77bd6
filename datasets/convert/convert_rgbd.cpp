// Sets whose images come with depth of their own kind and unit.
#include "datasets/convert/converters.h"
#include "dtr/base/error.h"
#include "dtr/io/formats/foreign_depth.h"
#include "dtr/io/formats/text_cameras.h"
#include "dtr/io/formats/transforms_json.h"
#include "dtr/io/image_io.h"
#include "dtr/io/oiio_files.h"

namespace dtr::datasets {
namespace {

namespace fs = std::filesystem;

constexpr double kMillimetre = 0.001;

// Red, green, blue and alpha as stored, not multiplied.
Grid<std::uint8_t> ReadRgba(const fs::path& file) {
  const auto in = io::OpenImage(file);
  if (in->facts().channels != 4 || in->facts().sample != io::Sample::kUint8) {
    throw Error(file.string() + ": expected 8-bit RGBA, found another kind of image");
  }
  Grid<std::uint8_t> rgba(in->facts().width, in->facts().height, 4);
  io::ReadPixels(*in, file, 0, 4, io::Sample::kUint8, rgba.data().data());
  return rgba;
}

// Colour over black, which is what the renderer leaves where nothing is; and the pixels that are
// all object. Pixels at its rim mix object and nothing, so they are masked like the background.
void SplitRgba(const Grid<std::uint8_t>& rgba, ImageRgb8& on_black, Mask& opaque) {
  on_black = ImageRgb8(rgba.width(), rgba.height(), 3);
  opaque = Mask(rgba.width(), rgba.height());
  for (int y = 0; y < rgba.height(); ++y) {
    for (int x = 0; x < rgba.width(); ++x) {
      const int alpha = rgba(x, y, 3);
      opaque(x, y) = alpha == 255 ? 255 : 0;
      for (int c = 0; c < 3; ++c) {
        on_black(x, y, c) = static_cast<std::uint8_t>((rgba(x, y, c) * alpha + 127) / 255);
      }
    }
  }
}

// v = 0 is background, else the distance along the ray is 8 (1 - v / 255): found by reprojection
// (SOURCE.md of the set), as the files say nothing.
DepthImage LegoDepth(const fs::path& file, const PinholeCamera& camera) {
  constexpr double kFarthest = 8.0;
  const Grid<std::uint8_t> codes = ReadRgba(file);  // all four channels are the number: no alpha
  if (codes.width() != camera.width_px() || codes.height() != camera.height_px()) {
    throw Error(file.string() + ": expected the size of its photo, found another");
  }
  DepthImage ray_distance(codes.width(), codes.height(), DepthKind::kRayDistance);
  for (int y = 0; y < codes.height(); ++y) {
    for (int x = 0; x < codes.width(); ++x) {
      const int v = codes(x, y, 0);
      if (v > 0) ray_distance(x, y) = static_cast<float>(kFarthest * (1.0 - v / 255.0));
    }
  }
  return ToPlaneZ(ray_distance, camera);
}

// One colour image with its 16-bit depth in millimetres.
io::NamedCamera ConvertRgbdFrame(const Eigen::Matrix3d& k, io::PixelOrigin origin,
                                 const Pose& cam_from_world, const fs::path& image,
                                 const fs::path& depth_mm, const ConvertedFolder& out) {
  const io::SizedImage size = ImageAt(image.parent_path(), image.filename().string());
  io::NamedCamera named;
  named.name = size.name;
  named.camera = io::CameraFromK(k, size.width_px, size.height_px, origin, image.string());
  named.cam_from_world = cam_from_world;
  DepthImage depth = io::ReadForeignDepth(depth_mm, DepthKind::kPlaneZ, kMillimetre, size.width_px,
                                          size.height_px);
  constexpr float kNoDepth = 65.535f;  // the code 65535: no reading, in 7-Scenes' own description
  for (float& z : depth.grid().data()) {
    if (z >= kNoDepth) z = 0;
  }
  named.depth_file = out.WriteDepth(named.name, depth);
  out.CopyImage(image, named.name);
  return named;
}

std::string FiveDigits(int number) {
  std::string digits = std::to_string(number);
  return std::string(digits.size() < 5 ? 5 - digits.size() : 0, '0') + digits;
}

}  // namespace

io::CameraList ConvertLego(const fs::path& source, const ConvertedFolder& out) {
  io::TransformsPaths paths;
  paths.image_of = [&](const std::string& path) { return ImageAt(source, path + ".png"); };
  io::CameraList list = io::ReadTransformsJson(source / "transforms_test_subset.json", paths).list;
  for (io::NamedCamera& named : list.cameras) {
    const fs::path image = source / named.name;
    const fs::path depth = image.parent_path() / (image.stem().string() + "_depth_0001.png");
    named.name = image.filename().string();
    ImageRgb8 on_black;
    Mask opaque;
    SplitRgba(ReadRgba(image), on_black, opaque);
    io::WriteImage(out.ImageFile(named.name), on_black);
    named.mask_file = out.WriteMask(named.name, opaque);
    named.depth_file = out.WriteDepth(named.name, LegoDepth(depth, named.camera));
  }
  return list;
}

io::CameraList ConvertLivingRoom(const fs::path& source, const ConvertedFolder& out) {
  // PrimeSense default of Open3D, which un-projects whole pixel numbers: centres at integers.
  Eigen::Matrix3d k;
  k << 525, 0, 319.5, 0, 525, 239.5, 0, 0, 1;
  io::CameraList list;
  list.unit = LengthUnit::kMetre;
  for (const io::LogPose& given : io::ReadOpen3dLog(source / "trajectory_subset.log")) {
    const std::string stem = FiveDigits(given.id);
    list.cameras.push_back(ConvertRgbdFrame(k, io::PixelOrigin::kCentre, given.cam_from_world,
                                            source / "image" / (stem + ".jpg"),
                                            source / "depth" / (stem + ".png"), out));
  }
  return list;
}

io::CameraList Convert7Scenes(const fs::path& source, const ConvertedFolder& out) {
  // The programs that come with these files un-project whole pixel numbers too.
  const Eigen::Matrix3d k = io::ReadMatrix3Text(source / "camera-intrinsics.txt");
  const std::string ending = ".pose.txt";
  io::CameraList list;
  list.unit = LengthUnit::kMetre;
  for (const std::string& file : FilesEndingIn(source, ending)) {
    const std::string frame = file.substr(0, file.size() - ending.size());
    list.cameras.push_back(
        ConvertRgbdFrame(k, io::PixelOrigin::kCentre, io::ReadWorldFromCamText(source / file),
                         source / (frame + ".color.jpg"), source / (frame + ".depth.png"), out));
  }
  return list;
}

}  // namespace dtr::datasets
