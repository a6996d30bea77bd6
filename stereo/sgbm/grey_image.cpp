#include "stereo/sgbm/grey_image.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

namespace dtr::stereo {
namespace {

/// Replaces the values of one line (given by its stride) that may not be used.
/// Returns false when the line has no usable value at all.
bool BridgeLine(float* grey, const std::uint8_t* usable, int count, std::ptrdiff_t stride) {
  int last = -1;
  for (int i = 0; i <= count; ++i) {
    const bool end = i == count;
    if (!end && usable[i * stride] == 0) continue;
    if (end && last < 0) return false;
    for (int k = last + 1; k < i; ++k) {
      const float before = last < 0 ? grey[i * stride] : grey[last * stride];
      const float after = end ? grey[last * stride] : grey[i * stride];
      const float t = static_cast<float>(k - last) / static_cast<float>(i - last);
      grey[k * stride] = before + t * (after - before);
    }
    last = i;
  }
  return true;
}

void BridgeMasked(GreyImage* picture) {
  const int w = picture->grey.width(), h = picture->grey.height();
  Mask row_known(1, h);
  for (int y = 0; y < h; ++y) {
    row_known(0, y) = BridgeLine(picture->grey.row(y), picture->usable.row(y), w, 1) ? 255 : 0;
  }
  for (int x = 0; x < w; ++x) {  // rows without any usable pixel
    std::vector<float> column(static_cast<size_t>(h));
    for (int y = 0; y < h; ++y) column[static_cast<size_t>(y)] = picture->grey(x, y);
    if (!BridgeLine(column.data(), row_known.data().data(), h, 1)) {
      std::fill(column.begin(), column.end(), 0.0f);  // everything is masked
    }
    for (int y = 0; y < h; ++y) picture->grey(x, y) = column[static_cast<size_t>(y)];
  }
}

std::array<float, 4> CatmullRom(float t) {
  const float t2 = t * t, t3 = t2 * t;
  return {0.5f * (-t3 + 2 * t2 - t), 0.5f * (3 * t3 - 5 * t2 + 2), 0.5f * (-3 * t3 + 4 * t2 + t),
          0.5f * (t3 - t2)};
}

/// Value at pixel-index coordinates, borders repeated.
float Sample(const Grid<float>& grid, double x, double y) {
  const int w = grid.width(), h = grid.height();
  const double xc = std::clamp(x, 0.0, w - 1.0), yc = std::clamp(y, 0.0, h - 1.0);
  const int x0 = static_cast<int>(xc), y0 = static_cast<int>(yc);
  const auto wx = CatmullRom(static_cast<float>(xc - x0));
  const auto wy = CatmullRom(static_cast<float>(yc - y0));
  float sum = 0;
  for (int j = 0; j < 4; ++j) {
    const float* row = grid.row(std::clamp(y0 + j - 1, 0, h - 1));
    float line = 0;
    for (int i = 0; i < 4; ++i) {
      line += wx[static_cast<size_t>(i)] * row[std::clamp(x0 + i - 1, 0, w - 1)];
    }
    sum += wy[static_cast<size_t>(j)] * line;
  }
  return sum;
}

void WarpInto(const GreyImage& source, const VirtualImage& target, WarpedImage* out) {
  const PinholeCamera& camera = source.camera;
  for (int y = 0; y < target.height_px; ++y) {
    for (int x = 0; x < target.width_px; ++x) {
      const auto pixel =
          camera.PixelFromCam(target.ray_from_pixel * Eigen::Vector3d(x + 0.5, y + 0.5, 1));
      if (!pixel) continue;
      const float value = Sample(source.grey, pixel->x() - 0.5, pixel->y() - 0.5);
      out->grey(x, y) = static_cast<std::uint8_t>(std::clamp(value + 0.5f, 0.0f, 255.0f));
      if (!camera.Contains(*pixel)) continue;
      out->usable(x, y) = source.usable(static_cast<int>(pixel->x()), static_cast<int>(pixel->y()));
    }
  }
}

}  // namespace

GreyImage MakeGreyImage(const StereoView& view) {
  const int w = view.camera.width_px(), h = view.camera.height_px();
  const auto size_text = [](int a, int b) { return std::to_string(a) + "x" + std::to_string(b); };
  if (view.image == nullptr || view.image->width() != w || view.image->height() != h ||
      view.image->channels() != 3) {
    throw Error("stereo: image and camera differ in size, expected RGB of " + size_text(w, h) +
                (view.image ? ", found " + size_text(view.image->width(), view.image->height())
                            : std::string(", found none")));
  }
  const bool masked = view.mask != nullptr && !view.mask->empty();
  if (masked && (view.mask->width() != w || view.mask->height() != h)) {
    throw Error("stereo: mask and camera differ in size, expected " + size_text(w, h) + ", found " +
                size_text(view.mask->width(), view.mask->height()));
  }
  GreyImage picture{view.camera, Grid<float>(w, h), masked ? *view.mask : Mask(w, h, 1, 255)};
  for (int y = 0; y < h; ++y) {
    const std::uint8_t* rgb = view.image->row(y);
    for (int x = 0; x < w; ++x, rgb += 3) {  // Rec. 601 luma
      picture.grey(x, y) = 0.299f * rgb[0] + 0.587f * rgb[1] + 0.114f * rgb[2];
    }
  }
  if (masked) BridgeMasked(&picture);
  return picture;
}

GreyImage Halved(const GreyImage& picture) {
  const int w = picture.grey.width() / 2, h = picture.grey.height() / 2;
  const PinholeCamera& c = picture.camera;
  GreyImage half{PinholeCamera(w, h, c.fx_px() / 2, c.fy_px() / 2, c.cx_px() / 2, c.cy_px() / 2),
                 Grid<float>(w, h), Mask(w, h)};
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      float sum = 0;
      std::uint8_t usable = 255;
      for (int k = 0; k < 4; ++k) {
        sum += picture.grey(2 * x + k % 2, 2 * y + k / 2);
        usable = std::min(usable, picture.usable(2 * x + k % 2, 2 * y + k / 2));
      }
      half.grey(x, y) = 0.25f * sum;
      half.usable(x, y) = usable;
    }
  }
  return half;
}

WarpedImage Warp(const GreyImage& source, const VirtualImage& target) {
  constexpr double kHalve = 0.6;  // below, a pixel of the target covers nearly two of the source
  constexpr int kSmallest = 16;
  WarpedImage out{Grid<std::uint8_t>(target.width_px, target.height_px),
                  Mask(target.width_px, target.height_px)};
  GreyImage half;
  const GreyImage* use = &source;
  while (target.focal_px < kHalve * use->camera.fx_px() && use->grey.width() >= 2 * kSmallest &&
         use->grey.height() >= 2 * kSmallest) {
    half = Halved(*use);
    use = &half;
  }
  WarpInto(*use, target, &out);
  return out;
}

}  // namespace dtr::stereo
