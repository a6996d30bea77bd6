#include "stereo/complete/cells.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "dtr/render/colour.h"
#include "dtr/render/exposure.h"
#include "dtr/render/scene.h"

namespace dtr::stereo {
namespace {

constexpr int kMaxCells = 340;
constexpr int kPlaneReach = 2;   // cells on either side, for a plane's slope
constexpr float kLevel = 1e-3F;  // of the weight, towards a plane of constant depth
constexpr int kPlaneFits = 3;

struct CellSums {
  double rgb[3] = {};
  int usable = 0;
  std::vector<float> inverse_depths;
};

void Average(const View& view, int cell_px, CellView& cells) {
  const int width = view.image.width(), height = view.image.height();
  for (int y = 0; y < cells.camera.height_px(); ++y) {
    for (int x = 0; x < cells.camera.width_px(); ++x) {
      CellSums sums;
      for (int j = y * cell_px; j < std::min((y + 1) * cell_px, height); ++j) {
        for (int i = x * cell_px; i < std::min((x + 1) * cell_px, width); ++i) {
          if (!view.mask.empty() && view.mask(i, j) == 0) continue;
          for (int c = 0; c < 3; ++c) sums.rgb[c] += view.image(i, j, c);
          ++sums.usable;
          const float z = view.depth(std::min(i / view.depth_scale, view.depth.width() - 1),
                                     std::min(j / view.depth_scale, view.depth.height() - 1));
          if (!DepthImage::IsHole(z)) sums.inverse_depths.push_back(1 / z);
        }
      }
      if (sums.usable == 0) continue;
      cells.usable(x, y) = 255;
      for (int c = 0; c < 3; ++c) {
        const double mean = sums.rgb[c] / sums.usable / 255;
        cells.colour(x, y, c) =
            static_cast<float>(255 * SrgbFromLinear(Exposed(LinearFromSrgb(mean), view.gain[c])));
      }
      const auto known = sums.inverse_depths.size();
      if (2 * known < static_cast<size_t>(sums.usable)) continue;
      const auto middle = sums.inverse_depths.begin() + static_cast<std::ptrdiff_t>(known / 2);
      std::nth_element(sums.inverse_depths.begin(), middle, sums.inverse_depths.end());
      cells.inverse_depth(x, y) = *middle;
      if (known < static_cast<size_t>(sums.usable)) cells.shared(x, y) = 255;
    }
  }
}

/// Of the measured cells around that lie on one surface, closer and closer.
ViewPlane FitPlane(const CellView& cells, int x, int y) {
  const float w = cells.inverse_depth(x, y);
  Eigen::Vector3f slope(0, 0, w);  // 1/z at (dx, dy) is slope . (dx, dy, 1)
  float tolerance = 4 * cells.pixel;
  for (int fit = 0; fit < kPlaneFits; ++fit, tolerance /= 2) {
    Eigen::Matrix3f normal = Eigen::Matrix3f::Identity() * kLevel;
    Eigen::Vector3f right(0, 0, kLevel * w);
    for (int dy = -kPlaneReach; dy <= kPlaneReach; ++dy) {
      for (int dx = -kPlaneReach; dx <= kPlaneReach; ++dx) {
        if (!cells.inverse_depth.Contains(x + dx, y + dy)) continue;
        const float other = cells.inverse_depth(x + dx, y + dy);
        const Eigen::Vector3f at(static_cast<float>(dx), static_cast<float>(dy), 1);
        if (!(other > 0) || std::abs(other - slope.dot(at)) > tolerance) continue;
        normal += at * at.transpose();
        right += other * at;
      }
    }
    slope = normal.ldlt().solve(right);
  }
  // From cells to rays: 1/z = a x + b y + c.
  const auto fx = static_cast<float>(cells.camera.fx_px()),
             fy = static_cast<float>(cells.camera.fy_px());
  const Eigen::Vector3f ray = cells.RayOf(x, y);
  const float a = slope.x() * fx, b = slope.y() * fy;
  return {a, b, slope.z() - a * ray.x() - b * ray.y()};
}

/// Photo pixels per cell and axis.
int CellSizeOf(const PinholeCamera& camera) {
  const int side = std::max(camera.width_px(), camera.height_px());
  return (side + kMaxCells - 1) / kMaxCells;
}

}  // namespace

std::uint64_t CellBytes(const PinholeCamera& camera) {
  const int size = CellSizeOf(camera);
  const auto columns = static_cast<std::uint64_t>((camera.width_px() + size - 1) / size);
  const auto rows = static_cast<std::uint64_t>((camera.height_px() + size - 1) / size);
  return columns * rows * (7 * sizeof(float) + 2);
}

CellView MakeCells(const View& view) {
  const int cell_px = CellSizeOf(view.camera);
  const int columns = (view.camera.width_px() + cell_px - 1) / cell_px;
  const int rows = (view.camera.height_px() + cell_px - 1) / cell_px;
  const double size = cell_px;
  CellView cells;
  cells.cell_px = cell_px;
  cells.camera =
      PinholeCamera(columns, rows, view.camera.fx_px() / size, view.camera.fy_px() / size,
                    view.camera.cx_px() / size, view.camera.cy_px() / size);
  cells.cam_from_world = view.cam_from_world;
  cells.colour = Grid<float>(columns, rows, 3);
  cells.usable = Mask(columns, rows);
  cells.inverse_depth = Grid<float>(columns, rows);
  cells.planes = Grid<float>(columns, rows, 3);
  cells.shared = Grid<std::uint8_t>(columns, rows);
  cells.pixel = static_cast<float>(1 / (cells.camera.fx_px() * DisparityBaseline(view)));
  Average(view, cell_px, cells);
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      if (!(cells.inverse_depth(x, y) > 0)) continue;
      const ViewPlane plane = FitPlane(cells, x, y);
      for (int c = 0; c < 3; ++c) cells.planes(x, y, c) = plane[c];
    }
  }
  return cells;
}

std::optional<ViewPlane> PlaneInOther(const ViewPlane& plane, const Pose& other_from_view) {
  // p = R' (q - t) for q before the other camera.
  const Eigen::Vector3d turned = other_from_view.rotation * plane.cast<double>();
  const double scale = 1 + turned.dot(other_from_view.translation);
  if (!(std::abs(scale) > 1e-9)) return std::nullopt;
  return (turned / scale).cast<float>();
}

}  // namespace dtr::stereo
