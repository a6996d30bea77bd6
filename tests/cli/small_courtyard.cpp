#include "tests/cli/small_courtyard.h"

#include <fmt/format.h>

#include "calib/colmap/model_io.h"
#include "datasets/layout.h"
#include "datasets/make.h"
#include "datasets/render_truth.h"
#include "datasets/scene.h"
#include "dtr/io/image_io.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;

constexpr int kPointsAcross = 16, kPointsDown = 10;  // per view: about 1100 points in all

constexpr char kScene[] = "courtyard";

struct World {
  datasets::Scene scene;
  const std::vector<CourtyardPhoto>& photos;
};

// Where a photo sees a point that nothing hides; on the outer pixels SfM finds no features either.
std::optional<Eigen::Vector2d> Seen(const datasets::Scene& scene, const CourtyardPhoto& photo,
                                    const Eigen::Vector3d& p) {
  constexpr double kShortOfTheSurface = 1 - 1e-6;
  const auto pixel = photo.camera.PixelFromCam(photo.cam_from_scene * p);
  if (!pixel || !photo.camera.Contains(*pixel)) return std::nullopt;
  const Eigen::Vector3d eye = photo.cam_from_scene.TargetOriginInSource();
  if (scene.IsBlocked({eye, p - eye}, 0, kShortOfTheSurface)) return std::nullopt;
  return pixel;
}

void AddPoint(const World& world, const Eigen::Vector3d& p, const Eigen::Vector3d& p_written,
              calib::SfmModel& model) {
  std::vector<std::pair<size_t, Eigen::Vector2d>> track;
  for (size_t i = 0; i < model.images.size(); ++i) {
    if (const auto pixel = Seen(world.scene, world.photos[i], p)) track.push_back({i, *pixel});
  }
  if (track.size() < 2) return;
  const std::uint64_t id = model.points.size() + 1;
  model.points[id] = {p_written, {128, 128, 128}, 0};
  for (const auto& [image, pixel] : track) model.images[image].features.push_back({pixel, id});
}

// The number of a camera among those of the model, where it is put if it is new.
std::uint32_t IdOf(const PinholeCamera& camera, calib::SfmModel& model) {
  const calib::LensCamera lens{calib::CameraModel::kPinhole,
                               camera.width_px(),
                               camera.height_px(),
                               {camera.fx_px(), camera.fy_px(), camera.cx_px(), camera.cy_px()}};
  for (const auto& [id, known] : model.cameras) {
    if (known.params == lens.params && known.width_px == lens.width_px &&
        known.height_px == lens.height_px) {
      return id;
    }
  }
  const auto id = static_cast<std::uint32_t>(model.cameras.size() + 1);
  model.cameras[id] = lens;
  return id;
}

}  // namespace

std::vector<Pose> CourtyardArc(int views) {
  return datasets::MakeLayout(datasets::MakeScene(kScene, datasets::DatasetSpec{}.seed), "arc",
                              views);
}

void RenderCourtyard(const fs::path& folder, const std::vector<CourtyardPhoto>& photos) {
  const datasets::Scene scene = datasets::MakeScene(kScene, datasets::DatasetSpec{}.seed);
  datasets::PhotoOptions options;
  options.supersampling = 1;
  for (const CourtyardPhoto& photo : photos) {
    fs::create_directories((folder / photo.name).parent_path());
    io::WriteImage(folder / photo.name,
                   datasets::RenderPhoto(scene, photo.camera, photo.cam_from_scene, options));
  }
}

calib::SfmModel CourtyardModel(const std::vector<CourtyardPhoto>& photos, double scale,
                               const Eigen::Vector3d& offset) {
  const World world{datasets::MakeScene(kScene, datasets::DatasetSpec{}.seed), photos};
  calib::SfmModel model;
  for (const CourtyardPhoto& photo : photos) {
    const auto id = static_cast<std::uint32_t>(model.images.size() + 1);
    model.images.push_back({id,
                            photo.name,
                            IdOf(photo.camera, model),
                            datasets::WrittenPose(photo.cam_from_scene, scale, offset),
                            {}});
  }
  for (const CourtyardPhoto& photo : photos) {
    const Eigen::Vector3d eye = photo.cam_from_scene.TargetOriginInSource();
    for (int y = 0; y < kPointsDown; ++y) {
      for (int x = 0; x < kPointsAcross; ++x) {
        const Eigen::Vector2d pixel((x + 0.5) * photo.camera.width_px() / kPointsAcross,
                                    (y + 0.5) * photo.camera.height_px() / kPointsDown);
        const Eigen::Vector3d direction =
            photo.cam_from_scene.rotation.conjugate() * photo.camera.RayFromPixel(pixel);
        const auto hit = world.scene.Intersect({eye, direction});
        if (hit) AddPoint(world, hit->p_in_world, scale * hit->p_in_world + offset, model);
      }
    }
  }
  return model;
}

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
  datasets::MakeDataset(spec, folder, silent);
  std::vector<CourtyardPhoto> photos;
  const PinholeCamera camera = datasets::MakeCamera(spec.width_px, spec.height_px, spec.focal_35mm);
  for (const Pose& pose : CourtyardArc(spec.views)) {
    photos.push_back({fmt::format("{:04}.jpg", photos.size()), camera, pose});
  }
  colmap::WriteModel(folder / "sparse", CourtyardModel(photos, scale, offset),
                     colmap::Format::kBinary);
}

std::vector<std::string> NumberImages(calib::SfmModel& model) {
  std::vector<std::string> names;
  for (calib::SfmImage& image : model.images) {
    image.name = names.emplace_back(fmt::format("{:06}.jpg", names.size()));
  }
  return names;
}

void ChangePhoto(const fs::path& photo) {
  ImageRgb8 image = io::ReadImage(photo);
  for (auto& value : image.data()) value = static_cast<std::uint8_t>(255 - value);
  io::WriteImage(photo, image);
}

}  // namespace dtr::testing
