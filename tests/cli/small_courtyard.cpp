#include "tests/cli/small_courtyard.h"

#include <fmt/format.h>

#include "calib/colmap/model_io.h"
#include "datasets/layout.h"
#include "datasets/make.h"
#include "datasets/scene.h"
#include "dtr/io/image_io.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;

constexpr int kPointsAcross = 16, kPointsDown = 10;  // per view: about 1100 points in all

struct World {
  datasets::Scene scene;
  PinholeCamera camera;
  std::vector<Pose> cams_from_scene;
};

// Where a view sees a point that nothing hides; on the outer pixels SfM finds no features either.
std::optional<Eigen::Vector2d> Seen(const World& world, const Pose& cam_from_scene,
                                    const Eigen::Vector3d& p) {
  constexpr double kShortOfTheSurface = 1 - 1e-6;
  const auto pixel = world.camera.PixelFromCam(cam_from_scene * p);
  if (!pixel || !world.camera.Contains(*pixel)) return std::nullopt;
  const Eigen::Vector3d eye = cam_from_scene.TargetOriginInSource();
  if (world.scene.IsBlocked({eye, p - eye}, 0, kShortOfTheSurface)) return std::nullopt;
  return pixel;
}

void AddPoint(const World& world, const Eigen::Vector3d& p, const Eigen::Vector3d& p_written,
              calib::SfmModel& model) {
  std::vector<std::pair<size_t, Eigen::Vector2d>> track;
  for (size_t i = 0; i < model.images.size(); ++i) {
    if (const auto pixel = Seen(world, world.cams_from_scene[i], p)) track.push_back({i, *pixel});
  }
  if (track.size() < 2) return;
  const std::uint64_t id = model.points.size() + 1;
  model.points[id] = {p_written, {128, 128, 128}, 0};
  for (const auto& [image, pixel] : track) model.images[image].features.push_back({pixel, id});
}

calib::SfmModel ExactModel(const World& world, const datasets::DatasetSpec& spec) {
  calib::SfmModel model;
  model.cameras[1] = {
      calib::LensModel::kPinhole,
      spec.width_px,
      spec.height_px,
      {world.camera.fx_px(), world.camera.fy_px(), world.camera.cx_px(), world.camera.cy_px()}};
  for (size_t i = 0; i < world.cams_from_scene.size(); ++i) {
    model.images.push_back(
        {static_cast<std::uint32_t>(i + 1),
         fmt::format("{:04}.jpg", i),
         1,
         datasets::WrittenPose(world.cams_from_scene[i], spec.scale, spec.world_offset),
         {}});
  }
  for (const Pose& cam_from_scene : world.cams_from_scene) {
    for (int y = 0; y < kPointsDown; ++y) {
      for (int x = 0; x < kPointsAcross; ++x) {
        const Eigen::Vector2d pixel((x + 0.5) * spec.width_px / kPointsAcross,
                                    (y + 0.5) * spec.height_px / kPointsDown);
        const Eigen::Vector3d eye = cam_from_scene.TargetOriginInSource();
        const Eigen::Vector3d direction =
            cam_from_scene.rotation.conjugate() * world.camera.RayFromPixel(pixel);
        const auto hit = world.scene.Intersect({eye, direction});
        if (!hit) continue;
        AddPoint(world, hit->p_in_world, spec.scale * hit->p_in_world + spec.world_offset, model);
      }
    }
  }
  return model;
}

}  // namespace

void MakeSmallCourtyard(const fs::path& folder, double scale, const Eigen::Vector3d& offset) {
  datasets::DatasetSpec spec;
  spec.layout = "arc";
  spec.views = kCourtyardViews;
  spec.width_px = kCourtyardWidthPx;
  spec.height_px = kCourtyardHeightPx;
  spec.supersampling = 1;
  spec.scale = scale;
  spec.world_offset = offset;
  SilentProgress silent;
  datasets::MakeDataset(spec, folder, 2, silent);
  datasets::Scene scene = datasets::MakeScene(spec.scene, spec.seed);
  std::vector<Pose> poses = datasets::MakeLayout(scene, spec.layout, spec.views);
  const World world{std::move(scene),
                    datasets::MakeCamera(spec.width_px, spec.height_px, spec.focal_35mm), poses};
  colmap::WriteModel(folder / "sparse", ExactModel(world, spec), colmap::Format::kBinary);
}

void ChangePhoto(const fs::path& photo) {
  ImageRgb8 image = io::ReadImage(photo);
  for (auto& value : image.data()) value = static_cast<std::uint8_t>(255 - value);
  io::WriteImage(photo, image);
}

}  // namespace dtr::testing
