#include "calib/undistort.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"
#include "dtr/types/area_average.h"

namespace dtr::calib {
namespace {

constexpr int kTaps = 6;  // Lanczos-3

// Pixels and weights along one axis for a value at `position` (pixel centres at i + 0.5).
struct Taps {
  std::array<int, kTaps> pixel;
  std::array<float, kTaps> weight;
};

// Lanczos-3 at f + 2, f + 1, f, f - 1, f - 2, f - 3 for the fraction f in [0, 1), normalised to a
// sum of 1. sin(pi (f - k)) = (-1)^k sin(pi f) and the sum rule for sin(pi (f - k) / 3) leave two
// calls of trigonometry. Pixels beyond the border repeat the border.
Taps LanczosTaps(double position, int size) {
  static const double kRoot3Half = std::sqrt(3.0) / 2;
  static const std::array<double, kTaps> kCos{-0.5, 0.5, 1, 0.5, -0.5, -1};  // of pi k / 3
  static const std::array<double, kTaps> kSin{-kRoot3Half, -kRoot3Half, 0,
                                              kRoot3Half,  kRoot3Half,  0};
  const double index = position - 0.5;
  const double base = std::floor(index);
  const double f = index - base;
  const double s = std::sin(std::numbers::pi / 3 * f), c = std::cos(std::numbers::pi / 3 * f);
  const double sine = s * (3 - 4 * s * s);  // of pi f
  Taps taps;
  std::array<double, kTaps> weight;
  double sum = 0;
  for (int i = 0; i < kTaps; ++i) {
    const int k = i - 2;
    const auto u = static_cast<size_t>(i);
    const double d = f - k;
    const double sign = k % 2 == 0 ? 1 : -1;
    weight[u] = d == 0 ? std::numbers::pi * std::numbers::pi / 3
                       : sign * sine * (s * kCos[u] - c * kSin[u]) / (d * d);
    sum += weight[u];
    taps.pixel[u] = std::clamp(static_cast<int>(base) + k, 0, size - 1);
  }
  for (size_t i = 0; i < kTaps; ++i) taps.weight[i] = static_cast<float>(weight[i] / sum);
  return taps;
}

std::uint8_t ToByte(float value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0.0f, 255.0f) + 0.5f);
}

void Sample(const ImageRgb8& photo, const Eigen::Vector2d& pixel, std::uint8_t* rgb) {
  const Taps columns = LanczosTaps(pixel.x(), photo.width());
  const Taps rows = LanczosTaps(pixel.y(), photo.height());
  std::array<float, 3> sum{};
  for (size_t j = 0; j < kTaps; ++j) {
    const std::uint8_t* row = photo.row(rows.pixel[j]);
    std::array<float, 3> row_sum{};
    for (size_t i = 0; i < kTaps; ++i) {
      const std::uint8_t* value = row + 3 * columns.pixel[i];
      for (size_t c = 0; c < 3; ++c) row_sum[c] += columns.weight[i] * value[c];
    }
    for (size_t c = 0; c < 3; ++c) sum[c] += rows.weight[j] * row_sum[c];
  }
  for (size_t c = 0; c < 3; ++c) rgb[c] = ToByte(sum[c]);
}

// False where one of the 4 pixels about `pixel` may not be used. `usable` may be empty.
bool IsUsable(const Mask& usable, const Eigen::Vector2d& pixel) {
  if (usable.empty()) return true;
  const int x = static_cast<int>(std::floor(pixel.x() - 0.5));
  const int y = static_cast<int>(std::floor(pixel.y() - 0.5));
  for (int j = y; j <= y + 1; ++j) {
    for (int i = x; i <= x + 1; ++i) {
      if (usable(std::clamp(i, 0, usable.width() - 1), std::clamp(j, 0, usable.height() - 1)) ==
          0) {
        return false;
      }
    }
  }
  return true;
}

// Without a lens only the mask remains to be applied.
UndistortedPhoto AsItIs(const ImageRgb8& photo, const Mask& usable, const LensCamera& lens) {
  UndistortedPhoto out{photo, {}, lens.Pinhole()};
  const bool all = std::all_of(usable.data().begin(), usable.data().end(),
                               [](auto value) { return value != 0; });
  if (all) return out;
  out.mask = usable;
  for (size_t i = 0; i < out.mask.data().size(); ++i) {
    if (out.mask.data()[i] == 0) std::fill_n(&out.image.data()[3 * i], 3, std::uint8_t{0});
  }
  return out;
}

UndistortedPhoto UndistortFullSize(const ImageRgb8& photo, const Mask& usable,
                                   const LensCamera& lens, const PinholeCamera& onto) {
  const LensMap map(lens);
  const int width = photo.width(), height = photo.height();
  UndistortedPhoto out{ImageRgb8(width, height, 3), Mask(width, height), onto};
  std::atomic<bool> anything_missing{false};
  ParallelFor(0, height, [&](int y) {
    bool missing = false;
    for (int x = 0; x < width; ++x) {
      const auto pixel = map.PixelFromCam(out.camera.RayFromPixel({x + 0.5, y + 0.5}));
      const bool has_source = pixel && pixel->x() >= 0 && pixel->y() >= 0 && pixel->x() <= width &&
                              pixel->y() <= height && IsUsable(usable, *pixel);
      missing |= !has_source;
      if (!has_source) continue;
      out.mask(x, y) = 255;
      Sample(photo, *pixel, &out.image(x, y));
    }
    if (missing) anything_missing = true;
  });
  if (!anything_missing) out.mask = {};
  return out;
}

void Shrink(UndistortedPhoto& photo, const PinholeCamera& camera) {
  const int width = camera.width_px(), height = camera.height_px();
  photo.image = AreaAverage(photo.image, width, height);
  photo.camera = camera;
  if (photo.mask.empty()) return;
  photo.mask = ShrinkMask(photo.mask, width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (photo.mask(x, y) == 0) std::fill_n(&photo.image(x, y), 3, std::uint8_t{0});
    }
  }
}

}  // namespace

UndistortedPhoto Undistort(const ImageRgb8& photo, const LensCamera& lens, int max_size_px) {
  return Undistort(photo, {}, lens, max_size_px);
}

UndistortedPhoto Undistort(const ImageRgb8& photo, const Mask& usable, const LensCamera& lens,
                           int max_size_px) {
  return Undistort(photo, usable, lens, lens.Pinhole(), max_size_px);
}

UndistortedPhoto Undistort(const ImageRgb8& photo, const Mask& usable, const LensCamera& lens,
                           const PinholeCamera& onto, int max_size_px) {
  lens.Check();
  if (!usable.empty() && (usable.width() != photo.width() || usable.height() != photo.height())) {
    throw std::invalid_argument("Undistort: mask and photo differ in size");
  }
  if (photo.width() != lens.width_px || photo.height() != lens.height_px || photo.channels() != 3) {
    throw Error("undistortion: expected a photo of " + std::to_string(lens.width_px) + "x" +
                std::to_string(lens.height_px) +
                " pixels and 3 channels as its camera has, found " + std::to_string(photo.width()) +
                "x" + std::to_string(photo.height()) + " and " + std::to_string(photo.channels()) +
                "; calibrate with the photo as it is");
  }
  if (onto.width_px() != photo.width() || onto.height_px() != photo.height()) {
    throw std::invalid_argument("Undistort: the camera to draw on and the photo differ in size");
  }
  UndistortedPhoto out = lens.IsUndistorted() && onto == lens.Pinhole()
                             ? AsItIs(photo, usable, lens)
                             : UndistortFullSize(photo, usable, lens, onto);
  const PinholeCamera shrunk = ShrunkCamera(onto, max_size_px);
  if (!(shrunk == onto)) Shrink(out, shrunk);
  return out;
}

PinholeCamera ShrunkCamera(const PinholeCamera& onto, int max_size_px) {
  const auto [width, height] = TargetSize(onto.width_px(), onto.height_px(), max_size_px);
  const bool same = width == onto.width_px() && height == onto.height_px();
  return same ? onto : onto.Resized(width, height);
}

std::optional<Eigen::Vector2d> UndistortedPixel(const LensMap& lens,
                                                const PinholeCamera& undistorted_camera,
                                                const Eigen::Vector2d& distorted_pixel) {
  const auto ray = lens.RayFromPixel(distorted_pixel);
  return ray ? undistorted_camera.PixelFromCam(*ray) : std::nullopt;
}

std::optional<Eigen::Vector2d> UndistortedPixel(const LensCamera& lens,
                                                const PinholeCamera& undistorted_camera,
                                                const Eigen::Vector2d& distorted_pixel) {
  return UndistortedPixel(LensMap(lens), undistorted_camera, distorted_pixel);
}

}  // namespace dtr::calib
