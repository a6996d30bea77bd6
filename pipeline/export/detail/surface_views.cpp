#include "pipeline/export/detail/surface_views.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "dtr/base/memory_budget.h"
#include "dtr/base/parallel_for.h"
#include "dtr/io/set_io.h"
#include "pipeline/export/detail/sample_colours.h"

namespace dtr::pipeline {
namespace {

// Where the distance of the cameras says nothing of a pixel of disparity: a share of 1/z.
constexpr double kPixelOfLoneView = 0.003;

bool IsUsable(const View& view, int x, int y) {
  if (view.mask.empty()) return true;
  const auto at = [&](int i) { return static_cast<int>(view.depth_scale * (i + 0.5)); };
  return view.mask(at(x), at(y)) != 0;
}

double MedianInverseDepth(const Grid<float>& inverse_depth) {
  std::vector<float> some;
  const size_t step = inverse_depth.data().size() / 4096 + 1;
  for (size_t i = 0; i < inverse_depth.data().size(); i += step) {
    if (inverse_depth.data()[i] > 0) some.push_back(inverse_depth.data()[i]);
  }
  if (some.empty()) return 1;
  std::nth_element(some.begin(), some.begin() + static_cast<std::ptrdiff_t>(some.size() / 2),
                   some.end());
  return some[some.size() / 2];
}

double BytesOf(const SurfaceView& surface) {
  return static_cast<double>(4 * surface.inverse_depth.data().size() +
                             4 * surface.sigma.data().size() + surface.completed.data().size() +
                             surface.far.data().size() + surface.colours.data().size());
}

}  // namespace

std::optional<double> SurfaceView::InverseDepthAt(const Eigen::Vector2d& pixel) const {
  const double x = pixel.x() - 0.5, y = pixel.y() - 0.5;
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  if (inverse_depth.Contains(x0, y0) && inverse_depth.Contains(x0 + 1, y0 + 1)) {
    const float* row = inverse_depth.row(y0) + x0;
    const float* below = inverse_depth.row(y0 + 1) + x0;
    const float low = std::min(std::min(row[0], row[1]), std::min(below[0], below[1]));
    const float high = std::max(std::max(row[0], row[1]), std::max(below[0], below[1]));
    if (low > 0 && high - low <= kOneSurfacePx * inverse_depth_per_px) {
      const double u = x - x0, v = y - y0;
      return (1 - v) * ((1 - u) * row[0] + u * row[1]) + v * ((1 - u) * below[0] + u * below[1]);
    }
  }
  const int xn = static_cast<int>(std::floor(pixel.x())),
            yn = static_cast<int>(std::floor(pixel.y()));
  if (!inverse_depth.Contains(xn, yn) || !(inverse_depth(xn, yn) > 0)) return std::nullopt;
  return inverse_depth(xn, yn);
}

std::array<double, 3> SurfaceView::ColourAt(const Eigen::Vector2d& pixel) const {
  const double x = std::clamp(pixel.x() - 0.5, 0.0, colours.width() - 1.0);
  const double y = std::clamp(pixel.y() - 0.5, 0.0, colours.height() - 1.0);
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, colours.width() - 1), y1 = std::min(y0 + 1, colours.height() - 1);
  const double u = x - x0, v = y - y0;
  std::array<double, 3> rgb{};
  for (int c = 0; c < 3; ++c) {
    rgb[static_cast<size_t>(c)] =
        (1 - v) * ((1 - u) * colours(x0, y0, c) + u * colours(x1, y0, c)) +
        v * ((1 - u) * colours(x0, y1, c) + u * colours(x1, y1, c));
  }
  return rgb;
}

double SurfaceView::SigmaAt(const Eigen::Vector2d& pixel) const {
  const int x = static_cast<int>(std::floor(pixel.x())),
            y = static_cast<int>(std::floor(pixel.y()));
  return sigma.Contains(x, y) ? sigma(x, y) : 0;
}

LocalPlane PlaneAt(const SurfaceView& surface, int x, int y, int radius) {
  const Grid<float>& map = surface.inverse_depth;
  const double w = map(x, y);
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  double squares = 0;
  int samples = 0;
  for (int dy = -radius; dy <= radius; ++dy) {
    for (int dx = -radius; dx <= radius; ++dx) {
      if (!map.Contains(x + dx, y + dy) || !(map(x + dx, y + dy) > 0)) continue;
      const double off = map(x + dx, y + dy) - w;
      if (std::abs(off) > surface.inverse_depth_per_px * std::max(std::abs(dx), std::abs(dy))) {
        continue;
      }
      const Eigen::Vector3d row(1, dx, dy);
      normal += row * row.transpose();
      right += off * row;
      squares += off * off;
      ++samples;
    }
  }
  LocalPlane plane;
  plane.w = w;
  const double determinant = normal.determinant();
  if (samples < 4 || !(determinant > 0.5)) return plane;  // whole numbers: 0 on a line
  const Eigen::Vector3d solution = normal.inverse() * right;
  plane.w = w + solution[0];
  plane.x_slope = solution[1];
  plane.y_slope = solution[2];
  plane.rms = std::sqrt(std::max(0.0, squares - solution.dot(right)) / samples);
  plane.samples = samples;
  return plane;
}

Eigen::Vector3d NormalOf(const SurfaceView& surface, const Eigen::Vector2d& pixel,
                         const LocalPlane& plane) {
  const Eigen::Vector3d ray = surface.camera.RayFromPixel(pixel);
  // 1/z = n . (X / Z, Y / Z, 1) for the plane n . (X, Y, Z) = 1, so n points away from the camera.
  const double across = plane.x_slope * surface.camera.fx_px();
  const double down = plane.y_slope * surface.camera.fy_px();
  const Eigen::Vector3d n(across, down, plane.w - across * ray.x() - down * ray.y());
  const Eigen::Vector3d away = plane.samples > 0 && n.dot(ray) > 0 ? n : ray;
  return -(surface.rotation.transpose() * away).normalized();
}

std::vector<int> SurfaceViews::WithDepth() const {
  std::vector<int> views;
  for (size_t i = 0; i < set_.frames.front().views.size(); ++i) {
    if (set_.frames.front().views[i].depth_file) views.push_back(static_cast<int>(i));
  }
  return views;
}

SurfaceView SurfaceViews::Load(int index) const {
  const View& listed = set_.frames.front().views[static_cast<size_t>(index)];
  View view = listed;
  io::LoadOptions load;
  load.images = view.mask_file.has_value();  // masks come with images
  load.sigma = true;
  load.completed = options_.completed;
  io::LoadPixels(folder_, view, load);
  SurfaceView surface;
  surface.index = index;
  surface.view = &listed;
  surface.camera = listed.DepthCamera();
  surface.rotation = listed.cam_from_world.rotation.toRotationMatrix();
  surface.centre = listed.CenterInWorld();
  surface.inverse_depth = Grid<float>(view.depth.width(), view.depth.height());
  if (!view.depth_state.empty())
    surface.completed = surface.far = Grid<std::uint8_t>(view.depth.width(), view.depth.height());
  for (int y = 0; y < view.depth.height(); ++y) {
    for (int x = 0; x < view.depth.width(); ++x) {
      const float z = view.depth(x, y);
      if (DepthImage::IsHole(z) || !IsUsable(view, x, y)) continue;
      const DepthState state =
          view.depth_state.empty() ? DepthState::kMeasured : view.depth_state(x, y);
      if (state == DepthState::kFar) {
        surface.far(x, y) = 1;
        continue;
      }
      surface.inverse_depth(x, y) = 1 / z;
      if (state == DepthState::kCompleted) surface.completed(x, y) = 1;
    }
  }
  if (options_.colours) surface.colours = ColoursOnDepthGrid(folder_, listed);
  if (view.inverse_depth_sigma) surface.sigma = std::move(*view.inverse_depth_sigma);
  surface.inverse_depth_per_px = listed.reference_baseline > 0
                                     ? 1 / (surface.camera.fx_px() * listed.reference_baseline)
                                     : kPixelOfLoneView * MedianInverseDepth(surface.inverse_depth);
  return surface;
}

void SurfaceViews::Touch(int view) {
  order_.remove(view);
  order_.push_front(view);
}

std::vector<std::shared_ptr<const SurfaceView>> SurfaceViews::GetAll(
    const std::vector<int>& views) {
  std::vector<int> missing;
  for (const int view : views) {
    if (!held_.contains(view)) missing.push_back(view);
  }
  std::vector<std::shared_ptr<const SurfaceView>> loaded(missing.size());
  ParallelFor(0, static_cast<int>(missing.size()), [&](int i) {
    loaded[static_cast<size_t>(i)] =
        std::make_shared<const SurfaceView>(Load(missing[static_cast<size_t>(i)]));
  });
  for (size_t i = 0; i < missing.size(); ++i) held_[missing[i]] = loaded[i];
  std::vector<std::shared_ptr<const SurfaceView>> result;
  for (const int view : views) {
    Touch(view);
    result.push_back(held_.at(view));
  }
  double bytes = 0;
  for (const auto& [view, surface] : held_) bytes += BytesOf(*surface);
  while (order_.size() > views.size() && bytes > options_.memory_gb * kBytesPerGigabyte) {
    bytes -= BytesOf(*held_.at(order_.back()));
    held_.erase(order_.back());
    order_.pop_back();
  }
  return result;
}

}  // namespace dtr::pipeline
