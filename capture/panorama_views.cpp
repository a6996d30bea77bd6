#include "capture/panorama_views.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "dtr/base/parallel_for.h"

namespace dtr::capture {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kMaxSamples = 8;  // of a pixel, per axis
constexpr double kWholePx = 0.5;

// Weights of the four pixels around a position `t` behind the second (Keys 1981, a = -1/2).
std::array<double, 4> CatmullRom(double t) {
  return {((-0.5 * t + 1) * t - 0.5) * t, (1.5 * t - 2.5) * t * t + 1,
          ((-1.5 * t + 2) * t + 0.5) * t, (0.5 * t - 0.5) * t * t};
}

// Pixels of a panorama by position: across its back the image goes on, over a pole on the other
// side of it.
class Sampler {
 public:
  Sampler(const ImageRgb8& image, const Mask& usable, const Panorama& panorama)
      : image_(image),
        usable_(usable),
        round_(std::abs(panorama.full_width_px - image.width()) < kWholePx &&
               std::abs(panorama.left_px) < kWholePx) {}

  // Adds the colours at `pixel` to `sum`; false where a pixel that they are made of is not usable.
  bool Add(const Vector2d& pixel, Vector3d& sum) const {
    const double x = pixel.x() - 0.5, y = pixel.y() - 0.5;
    const double left = std::floor(x), top = std::floor(y);
    const auto across = CatmullRom(x - left), along = CatmullRom(y - top);
    bool whole = round_ || (pixel.x() >= 0 && pixel.x() <= image_.width());
    whole = whole && pixel.y() >= 0 && pixel.y() <= image_.height();
    for (int j = 0; j < 4; ++j) {
      int row = static_cast<int>(top) - 1 + j, beyond = 0;
      if (row < 0 || row >= image_.height()) {
        row = row < 0 ? -1 - row : 2 * image_.height() - 1 - row;
        row = std::clamp(row, 0, image_.height() - 1);
        beyond = image_.width() / 2;
      }
      for (int i = 0; i < 4; ++i) {
        const int column = Column(static_cast<int>(left) - 1 + i + (round_ ? beyond : 0));
        const double weight = across[static_cast<size_t>(i)] * along[static_cast<size_t>(j)];
        for (int c = 0; c < 3; ++c) sum[c] += weight * image_(column, row, c);
        whole = whole && (usable_.empty() || usable_(column, row) != 0 || weight == 0);
      }
    }
    return whole;
  }

 private:
  int Column(int x) const {
    const int width = image_.width();
    return round_ ? ((x % width) + width) % width : std::clamp(x, 0, width - 1);
  }

  const ImageRgb8& image_;
  const Mask& usable_;
  bool round_;  // the image is the whole circle
};

// How many pixels of the panorama lie along the sides of a view's pixel.
int SamplesOf(const Panorama& panorama, const PinholeCamera& camera,
              const Eigen::Matrix3d& panorama_from_cam, const Vector2d& pixel) {
  const auto at = [&](double dx, double dy) {
    return panorama.PixelFromDirection(panorama_from_cam *
                                       camera.RayFromPixel(pixel + Vector2d(dx, dy)));
  };
  const Vector2d here = at(0, 0);
  double most = 1;
  for (const Vector2d& step : {Vector2d(at(1, 0) - here), Vector2d(at(0, 1) - here)}) {
    const double around = std::abs(step.x());
    most = std::max({most, std::min(around, panorama.full_width_px - around), std::abs(step.y())});
  }
  return std::min(kMaxSamples, static_cast<int>(std::ceil(most - 0.25)));
}

}  // namespace

PanoramaView ViewOfPanorama(const ImageRgb8& image, const Mask& usable, const Panorama& panorama,
                            const PinholeCamera& camera, const Eigen::Matrix3d& cam_from_panorama) {
  const Eigen::Matrix3d panorama_from_cam = cam_from_panorama.transpose();
  const Sampler sampler(image, usable, panorama);
  PanoramaView view{ImageRgb8(camera.width_px(), camera.height_px(), 3),
                    Mask(camera.width_px(), camera.height_px(), 1, 255)};
  std::atomic<bool> all_usable{true};
  ParallelFor(0, camera.height_px(), [&](int y) {
    for (int x = 0; x < camera.width_px(); ++x) {
      const int n = SamplesOf(panorama, camera, panorama_from_cam, {x + 0.5, y + 0.5});
      Vector3d sum = Vector3d::Zero();
      bool whole = true;
      for (int k = 0; k < n * n; ++k) {
        const Vector2d pixel(x + (k % n + 0.5) / n, y + (k / n + 0.5) / n);
        const Vector3d direction = panorama_from_cam * camera.RayFromPixel(pixel);
        whole = sampler.Add(panorama.PixelFromDirection(direction), sum) && whole;
      }
      for (int c = 0; c < 3; ++c) {
        view.image(x, y, c) =
            static_cast<std::uint8_t>(std::lround(std::clamp(sum[c] / (n * n), 0.0, 255.0)));
      }
      if (whole) continue;
      view.mask(x, y) = 0;
      all_usable = false;
    }
  });
  if (all_usable) view.mask = {};
  return view;
}

}  // namespace dtr::capture
