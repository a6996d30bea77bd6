#include "stereo/sgbm/match.h"

#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>

namespace dtr::stereo {
namespace {

/// StereoSGBM's own unit: disparities are stored in sixteenths of a pixel.
constexpr int kSixteenths = 16;
/// Side of the matched block and the smoothness penalties for it. OpenCV recommends 8 and 32 times
/// the area; half the small one lets slanted surfaces through.
constexpr int kBlock = 3;
constexpr int kPenalty1 = 4 * kBlock * kBlock;
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

/// Steps of the sweep per pixel of the left image (its margin of `steps` columns included); NaN
/// where nothing matches.
Grid<float> Steps(WarpedImage& left, WarpedImage& right, int steps) {
  const auto matcher =
      cv::StereoSGBM::create(0, steps, kBlock, kPenalty1, kPenalty2, kMaxLeftRightPx, kGradientCap,
                             kUniquenessPercent, 0, 0, cv::StereoSGBM::MODE_HH);
  cv::Mat sixteenths;
  matcher->compute(Wrap(left.grey), Wrap(right.grey), sixteenths);
  Grid<float> result(left.grey.width(), left.grey.height(), 1, kNone);
  for (int y = 0; y < result.height(); ++y) {
    const short* row = sixteenths.ptr<short>(y);
    for (int x = steps; x < result.width(); ++x) {
      if (row[x] < 0 || left.usable(x, y) == 0) continue;
      const float disparity = static_cast<float>(row[x]) / kSixteenths;
      const int partner = static_cast<int>(std::lround(static_cast<float>(x) - disparity));
      if (partner < 0 || right.usable(partner, y) == 0) continue;
      result(x, y) = disparity;
    }
  }
  return result;
}

/// Step at pixel-index coordinates: bilinear on one surface, else the nearest; may be NaN.
float StepAt(const Grid<float>& grid, double x, double y) {
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

/// Rays, in the rectified frame, of pixels of the rectified pair.
Eigen::Matrix3d RayFromRectified(const PinholeCamera& camera) {
  Eigen::Matrix3d ray_from_pixel;
  ray_from_pixel << 1 / camera.fx_px(), 0, -camera.cx_px() / camera.fx_px(), 0, 1 / camera.fy_px(),
      -camera.cy_px() / camera.fy_px(), 0, 0, 1;
  return ray_from_pixel;
}

/// The matcher computes nothing in its first `steps` columns, so both images get that margin.
Eigen::Matrix3d WithoutMargin(const Sweep& sweep) {
  Eigen::Matrix3d pixel_from_padded = Eigen::Matrix3d::Identity();
  pixel_from_padded(0, 2) = -sweep.steps;
  return pixel_from_padded;
}

VirtualImage LeftImage(const RectifiedPair& pair, const Sweep& sweep) {
  const PinholeCamera& c = pair.camera;
  return {c.width_px() + sweep.steps, c.height_px(), c.fx_px(),
          pair.rect_from_reference.transpose() * RayFromRectified(c) * WithoutMargin(sweep)};
}

/// The neighbour's image, moved so that on the sweep's plane it lies on the left one. With
/// disparity = a x + b y + c + (1 - a) step, a right pixel x - disparity is found at x - step when
/// column x' of the new image shows column (1 - a) x' - b y - c.
VirtualImage RightImage(const RectifiedPair& pair, const Sweep& sweep) {
  const PinholeCamera& c = pair.camera;
  Eigen::Matrix3d right_from_moved = Eigen::Matrix3d::Identity();
  right_from_moved.row(0) =
      Eigen::RowVector3d(1 - sweep.plane.x(), -sweep.plane.y(), -sweep.plane.z());
  return {c.width_px() + sweep.steps, c.height_px(), c.fx_px(),
          pair.rect_from_neighbour.transpose() * RayFromRectified(c) * right_from_moved *
              WithoutMargin(sweep)};
}

}  // namespace

PairDepth MatchPair(const GreyImage& reference, const GreyImage& neighbour,
                    const RectifiedPair& pair, const Sweep& sweep, const PinholeCamera& grid) {
  WarpedImage left = Warp(reference, LeftImage(pair, sweep));
  WarpedImage right = Warp(neighbour, RightImage(pair, sweep));
  const Grid<float> steps = Steps(left, right, sweep.steps);

  PairDepth result;
  result.inverse_depth = Grid<float>(grid.width_px(), grid.height_px(), 1, kNone);
  // 1/z = (rectified z of the ray) / Z, and 1/Z = disparity / (focal * baseline).
  result.step_from_ray =
      pair.rect_from_reference.row(2).transpose() / (pair.camera.fx_px() * pair.baseline);
  for (int y = 0; y < grid.height_px(); ++y) {
    for (int x = 0; x < grid.width_px(); ++x) {
      const Eigen::Vector3d ray = grid.RayFromPixel({x + 0.5, y + 0.5});
      const auto pixel = pair.camera.PixelFromCam(pair.rect_from_reference * ray);
      if (!pixel) continue;
      const float step = StepAt(steps, pixel->x() + sweep.steps - 0.5, pixel->y() - 0.5);
      if (std::isnan(step)) continue;
      result.inverse_depth(x, y) =
          static_cast<float>(sweep.DisparityAt(*pixel, step) * result.StepAt(ray));
    }
  }
  return result;
}

}  // namespace dtr::stereo
