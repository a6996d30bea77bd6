#include "stereo/sgbm/match.h"

#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>

namespace dtr::stereo {
namespace {

/// StereoSGBM's own unit: disparities are stored in sixteenths of a pixel.
constexpr int kSixteenths = 16;
/// Side of the matched block and the smoothness penalties OpenCV recommends for it.
constexpr int kBlock = 3;
constexpr int kPenalty1 = 8 * kBlock * kBlock;
constexpr int kPenalty2 = 32 * kBlock * kBlock;
/// Left-right check: matches may differ by this much, in pixels.
constexpr int kMaxLeftRightPx = 1;
/// Gradients are clipped here, so that strong edges do not outvote the rest of a block.
constexpr int kGradientCap = 31;
/// The best cost must beat the second best by so many per cent.
constexpr int kUniquenessPercent = 5;
/// Four disparities whose spread is larger do not lie on one surface; they are not interpolated.
constexpr float kSmoothPx = 1.0f;

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

cv::Mat Wrap(Grid<std::uint8_t>& grid) {
  return cv::Mat(grid.height(), grid.width(), CV_8UC1, grid.row(0));
}

/// Disparity in px per pixel of the rectified reference; NaN where there is none.
Grid<float> Disparities(WarpedPicture& left, WarpedPicture& right, int disparities) {
  const auto matcher =
      cv::StereoSGBM::create(0, disparities, kBlock, kPenalty1, kPenalty2, kMaxLeftRightPx,
                             kGradientCap, kUniquenessPercent, 0, 0, cv::StereoSGBM::MODE_HH);
  cv::Mat sixteenths;
  matcher->compute(Wrap(left.grey), Wrap(right.grey), sixteenths);
  Grid<float> result(left.grey.width(), left.grey.height(), 1, kNone);
  for (int y = 0; y < result.height(); ++y) {
    const short* row = sixteenths.ptr<short>(y);
    for (int x = disparities; x < result.width(); ++x) {
      if (row[x] < 0 || left.usable(x, y) == 0) continue;
      const float disparity = static_cast<float>(row[x]) / kSixteenths;
      const int partner = static_cast<int>(std::lround(static_cast<float>(x) - disparity));
      if (partner < 0 || right.usable(partner, y) == 0) continue;
      result(x, y) = disparity;
    }
  }
  return result;
}

/// Disparity at pixel-index coordinates: bilinear on one surface, else the nearest; may be NaN.
float DisparityAt(const Grid<float>& grid, double x, double y) {
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  if (grid.Contains(x0, y0) && grid.Contains(x0 + 1, y0 + 1)) {
    const float a = grid(x0, y0), b = grid(x0 + 1, y0);
    const float c = grid(x0, y0 + 1), d = grid(x0 + 1, y0 + 1);
    const float low = std::min(std::min(a, b), std::min(c, d));
    const float high = std::max(std::max(a, b), std::max(c, d));
    if (high - low <= kSmoothPx && !std::isnan(a + b + c + d)) {
      const float u = static_cast<float>(x - x0), v = static_cast<float>(y - y0);
      return (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d);
    }
  }
  const int xn = static_cast<int>(std::lround(x)), yn = static_cast<int>(std::lround(y));
  return grid.Contains(xn, yn) ? grid(xn, yn) : kNone;
}

}  // namespace

PairDepth MatchPair(const Picture& reference, const Picture& neighbour, const RectifiedPair& pair) {
  WarpedPicture left = Warp(reference, pair.reference, pair.rect_from_reference);
  WarpedPicture right = Warp(neighbour, pair.neighbour, pair.rect_from_neighbour);
  const Grid<float> disparity = Disparities(left, right, pair.disparities);

  const PinholeCamera& camera = reference.camera;
  PairDepth result;
  result.inverse_depth = Grid<float>(camera.width_px(), camera.height_px(), 1, kNone);
  // 1/z = (rectified z of the ray) / Z, and 1/Z = (disparity + shift) / (focal * baseline).
  result.step_from_ray =
      pair.rect_from_reference.row(2).transpose() / (pair.reference.fx_px() * pair.baseline);
  for (int y = 0; y < camera.height_px(); ++y) {
    for (int x = 0; x < camera.width_px(); ++x) {
      if (reference.usable(x, y) == 0) continue;
      const Eigen::Vector3d ray = camera.RayFromPixel({x + 0.5, y + 0.5});
      const auto pixel = pair.reference.PixelFromCam(pair.rect_from_reference * ray);
      if (!pixel) continue;
      const float d = DisparityAt(disparity, pixel->x() - 0.5, pixel->y() - 0.5);
      if (std::isnan(d)) continue;
      result.inverse_depth(x, y) =
          static_cast<float>((d + pair.shift_px) * result.step_from_ray.dot(ray));
    }
  }
  return result;
}

}  // namespace dtr::stereo
