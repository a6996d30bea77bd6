#include "pipeline/export/detail/points_from_depth.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "dtr/io/set_io.h"

namespace dtr::pipeline {
namespace {

constexpr size_t kMaxCandidates = 2'000'000;  // 48 MB
constexpr double kSameDepth = 0.02;           // relative; what depth maps of one scene differ by

View WithDepth(const std::filesystem::path& folder, View view) {
  io::LoadOptions load;
  load.images = view.mask_file.has_value();  // masks come with images
  io::LoadPixels(folder, view, load);
  return view;
}

bool IsUsable(const View& view, const Eigen::Vector2d& pixel) {
  return view.mask.empty() ||
         view.mask(static_cast<int>(pixel.x()), static_cast<int>(pixel.y())) != 0;
}

// Every `step`th pixel of a depth map, as points in the world.
void AddCandidates(const View& view, int step, std::vector<Eigen::Vector3d>& points) {
  const PinholeCamera camera = view.DepthCamera();
  const Pose world_from_cam = view.cam_from_world.Inverse();
  for (int y = step / 2; y < view.depth.height(); y += step) {
    for (int x = step / 2; x < view.depth.width(); x += step) {
      const float z = view.depth(x, y);
      const Eigen::Vector2d pixel(x + 0.5, y + 0.5);
      if (DepthImage::IsHole(z) || !IsUsable(view, view.depth_scale * pixel)) continue;
      points.push_back(world_from_cam * camera.CamFromPixel(pixel, z, DepthKind::kPlaneZ));
    }
  }
}

int StepFor(const DtrSet& set) {
  double pixels = 0;
  for (const View& view : set.frames.front().views) {
    if (!view.depth_file) continue;
    pixels += double(view.camera.width_px()) * view.camera.height_px() / view.depth_scale /
              view.depth_scale;
  }
  return std::max(1, static_cast<int>(std::ceil(std::sqrt(pixels / kMaxCandidates))));
}

// The first point of every voxel with that side.
std::vector<Eigen::Vector3d> OnePerVoxel(const std::vector<Eigen::Vector3d>& points, double side) {
  using VoxelIndex = std::array<std::int64_t, 3>;
  std::vector<std::pair<VoxelIndex, size_t>> voxels;
  voxels.reserve(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    VoxelIndex voxel;
    for (int c = 0; c < 3; ++c) {
      voxel[static_cast<size_t>(c)] = static_cast<std::int64_t>(std::floor(points[i][c] / side));
    }
    voxels.emplace_back(voxel, i);
  }
  std::sort(voxels.begin(), voxels.end());
  std::vector<size_t> first;
  for (size_t i = 0; i < voxels.size(); ++i) {
    if (i == 0 || voxels[i].first != voxels[i - 1].first) first.push_back(voxels[i].second);
  }
  std::sort(first.begin(), first.end());
  std::vector<Eigen::Vector3d> kept;
  for (const size_t i : first) kept.push_back(points[i]);
  return kept;
}

// At most that many of the points, evenly.
std::vector<Eigen::Vector3d> Thinned(std::vector<Eigen::Vector3d> points, size_t most) {
  if (points.size() <= most) return points;
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& point : points) box.extend(point);
  // Surfaces fill about (extent / side)^2 voxels; 1.19, a fourth root of 2, ends near `most`.
  constexpr double kFiner = 4, kGrowth = 1.19;
  double side = box.diagonal().norm() / (kFiner * std::sqrt(static_cast<double>(most)));
  while (points.size() > most) {
    points = OnePerVoxel(points, side);
    side *= kGrowth;
  }
  return points;
}

std::optional<Eigen::Vector2d> PixelSeen(const View& view, const Eigen::Vector3d& p_in_world) {
  const Eigen::Vector3d p_in_cam = view.cam_from_world * p_in_world;
  const auto pixel = view.camera.PixelFromCam(p_in_cam);
  if (!pixel || !view.camera.Contains(*pixel) || !IsUsable(view, *pixel)) return std::nullopt;
  const float z = view.depth(static_cast<int>(pixel->x()) / view.depth_scale,
                             static_cast<int>(pixel->y()) / view.depth_scale);
  if (DepthImage::IsHole(z) || std::abs(z / p_in_cam.z() - 1) > kSameDepth) return std::nullopt;
  return pixel;
}

}  // namespace

SparseScene PointsFromDepth(const std::filesystem::path& folder, const DtrSet& set,
                            const PointsFromDepthOptions& options, Progress& progress) {
  const std::vector<View>& views = set.frames.front().views;
  const int step = StepFor(set);
  std::vector<Eigen::Vector3d> points;
  progress.Stage("points from depth", 2 * static_cast<int>(views.size()));
  int done = 0;
  for (const View& view : views) {
    progress.ThrowIfInterrupted();
    if (view.depth_file) AddCandidates(WithDepth(folder, view), step, points);
    progress.Update(++done);
  }
  points = Thinned(std::move(points), options.max_points);
  SparseScene all;
  for (const Eigen::Vector3d& point : points) all.points.push_back({point});
  std::vector<bool> is_source;
  for (size_t v = 0; v < views.size(); ++v) {
    progress.ThrowIfInterrupted();
    is_source.push_back(views[v].depth_file.has_value());
    if (is_source.back()) {
      const View view = WithDepth(folder, views[v]);
      for (size_t i = 0; i < points.size(); ++i) {
        const auto pixel = PixelSeen(view, points[i]);
        if (pixel) all.observations.push_back({static_cast<int>(v), static_cast<int>(i), *pixel});
      }
    }
    progress.Update(++done);
  }
  return RestrictToViews(all, is_source);
}

}  // namespace dtr::pipeline
