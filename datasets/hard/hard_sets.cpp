#include "datasets/hard/hard_sets.h"

#include <fmt/format.h>

#include <algorithm>

#include "datasets/layout.h"
#include "datasets/render_truth.h"
#include "dtr/base/error.h"
#include "dtr/base/work_folder.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/image_io.h"

namespace dtr::datasets {
namespace fs = std::filesystem;
namespace {

constexpr double kUsualFocal = 28;  // mm

// Each pixel the mean of its row from `half_px` before to `half_px` behind it, as if the border
// went on.
Grid<float> Blurred(const Grid<float>& light, int width_px, int half_px) {
  Grid<float> out = light;
  for (int y = 0; y < light.height(); ++y) {
    for (int x = 0; x < width_px; ++x) {
      for (int c = 0; c < 3; ++c) {
        double sum = 0;
        for (int d = -half_px; d <= half_px; ++d) {
          sum += light.row(y)[3 * std::clamp(x + d, 0, width_px - 1) + c];
        }
        out.row(y)[3 * x + c] = static_cast<float>(sum / (2 * half_px + 1));
      }
    }
  }
  return out;
}

void WritePhoto(const Scene& scene, const HardPhoto& photo, std::uint64_t index,
                const fs::path& file) {
  constexpr std::uint64_t kSeed = 77;
  constexpr int kJpegQuality = 95;
  PhotoOptions options;
  options.supersampling = 2;
  options.noise_sigma = 1.5;
  options.gain = photo.gain;
  options.seed = kSeed + index;
  const PinholeCamera camera = MakeCamera(photo.width_px, photo.height_px, photo.focal_35mm);
  Grid<float> light = RenderLight(scene, camera, photo.cam_from_world, options);
  if (photo.blur_px > 0) light = Blurred(light, photo.width_px, photo.blur_px);
  if (!photo.has_exif) return io::WriteImage(file, Develop(light, options));
  io::ExifFocal exif;
  exif.make = "dtr";
  exif.model = fmt::format("m{}{}", photo.width_px, photo.focal_35mm == kUsualFocal ? "" : "z");
  exif.focal_mm = exif.focal_35mm = photo.focal_35mm * photo.exif_factor;
  io::WriteJpegWithExif(file, Develop(light, options), kJpegQuality, exif);
}

}  // namespace

void WriteHardSet(const HardSet& set, const fs::path& folder) {
  if (WorkFolder::IsTaken(folder, "hard set")) {
    throw UsageError(folder.string() +
                     ": expected a folder that does not exist yet; remove it or choose another "
                     "name");
  }
  WorkFolder work(WorkFolder::Of(folder), "hard set");
  fs::create_directory(work.path() / "photos");
  io::CameraList list;
  for (size_t i = 0; i < set.photos.size(); ++i) {
    const HardPhoto& photo = set.photos[i];
    io::NamedCamera camera;
    camera.name = fmt::format("{:04}.jpg", i);
    camera.camera = MakeCamera(photo.width_px, photo.height_px, photo.focal_35mm);
    camera.cam_from_world = photo.cam_from_world;
    WritePhoto(*set.scene, photo, i, work.path() / "photos" / camera.name);
    list.cameras.push_back(std::move(camera));
  }
  io::WriteCamerasJson(work.path() / "cameras.json", list);
  work.Become(folder);
}

}  // namespace dtr::datasets
