// flicker_report: how steady are images along a path? Each image of the fly-through is compared
// with the one before, warped by its depth: mean absolute difference in levels of sRGB over pixels
// whose depth agrees, apart where measured depth alone shows them and where completed depth is
// needed; docs/accuracy/RENDERING.md has the figures.
//
//   flicker_report SET.dtr [FRAMES=96] [WIDTH=480]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <utility>

#include "dtr/io/set_io.h"
#include "dtr/render/camera_path.h"
#include "dtr/render/scene.h"
#include "dtr/simd/renderer.h"

namespace {

// Farther apart than this share of the depth, a pixel was hidden before: nothing to compare.
constexpr double kSameDepth = 0.02;

struct Frame {
  dtr::NovelCamera camera;
  dtr::RenderResult image, measured_only;
};

struct Change {
  double sum = 0;
  size_t count = 0;
  void Add(double levels) { sum += levels, ++count; }
  double Mean() const { return count == 0 ? 0 : sum / static_cast<double>(count); }
};

struct Changes {
  Change measured, completed;
};

/// Bilinear, at a pixel position inside the image by half a pixel.
double LevelAt(const dtr::ImageRgb8& image, const Eigen::Vector2d& pixel, int channel) {
  const double x = pixel.x() - 0.5, y = pixel.y() - 0.5;
  const int left = static_cast<int>(x), top = static_cast<int>(y);
  const double u = x - left, v = y - top;
  return (1 - v) * ((1 - u) * image(left, top, channel) + u * image(left + 1, top, channel)) +
         v * ((1 - u) * image(left, top + 1, channel) + u * image(left + 1, top + 1, channel));
}

void AddChanges(const Frame& before, const Frame& now, Changes& changes) {
  const dtr::PinholeCamera& camera = now.camera.camera;
  const dtr::Pose before_from_now =
      before.camera.cam_from_world * now.camera.cam_from_world.Inverse();
  for (int y = 0; y < camera.height_px(); ++y) {
    for (int x = 0; x < camera.width_px(); ++x) {
      if (now.image.coverage(x, y) == 0) continue;
      const double z = now.image.depth(x, y);
      const Eigen::Vector3d p = before_from_now * (z * camera.RayFromPixel({x + 0.5, y + 0.5}));
      const auto pixel = camera.PixelFromCam(p);
      if (!pixel || pixel->x() < 0.5 || pixel->y() < 0.5 || pixel->x() >= camera.width_px() - 0.5 ||
          pixel->y() >= camera.height_px() - 0.5) {
        continue;
      }
      const int u = static_cast<int>(pixel->x()), v = static_cast<int>(pixel->y());
      if (before.image.coverage(u, v) == 0) continue;
      const double there = before.image.depth(u, v);
      if (std::abs(there - p.z()) > kSameDepth * p.z()) continue;
      double levels = 0;
      for (int c = 0; c < 3; ++c) {
        levels += std::abs(now.image.image(x, y, c) - LevelAt(before.image.image, *pixel, c)) / 3;
      }
      const bool measured = now.measured_only.coverage(x, y) != 0;
      (measured ? changes.measured : changes.completed).Add(levels);
    }
  }
}

Changes Along(const std::vector<dtr::NovelCamera>& path, const dtr::RenderScene& scene,
              const dtr::RenderScene& measured_only, bool smooth_edges) {
  dtr::RenderOptions options = dtr::WholeFrames();
  options.smooth_edges = smooth_edges;
  dtr::simd::Renderer renderer, other;
  Changes changes;
  Frame before;
  for (const dtr::NovelCamera& camera : path) {
    Frame now{camera, renderer.Render(scene, camera.camera, camera.cam_from_world, options),
              other.Render(measured_only, camera.camera, camera.cam_from_world, {})};
    if (!before.image.image.empty()) AddChanges(before, now, changes);
    before = std::move(now);
  }
  return changes;
}

void Report(const std::string& set_file, int frames, int width_px) {
  const dtr::DtrSet set = dtr::io::LoadSet(set_file, {.completed = true});
  const dtr::DtrSet measured = dtr::io::LoadSet(set_file, {.completed = false});
  const dtr::RenderScene scene = dtr::MakeRenderScene(set);
  const dtr::RenderScene measured_only = dtr::MakeRenderScene(measured);
  std::vector<dtr::NovelCamera> path = dtr::FlyThrough(set, frames);
  for (dtr::NovelCamera& camera : path) {
    const dtr::PinholeCamera& full = camera.camera;
    const int height_px = std::max(1, width_px * full.height_px() / full.width_px());
    camera.camera = full.Resized(width_px, height_px);
  }
  std::printf("mean absolute change, levels       measured   completed   share completed\n");
  for (const bool smooth_edges : {false, true}) {
    const Changes changes = Along(path, scene, measured_only, smooth_edges);
    const double all = static_cast<double>(changes.measured.count + changes.completed.count);
    std::printf("%-32s %10.2f %11.2f %15.1f %%\n", smooth_edges ? "smooth edges" : "stairs",
                changes.measured.Mean(), changes.completed.Mean(),
                100 * static_cast<double>(changes.completed.count) / std::max(all, 1.0));
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 4) {
    std::fprintf(stderr, "flicker_report SET.dtr [FRAMES=96] [WIDTH=480]\n");
    return 2;
  }
  try {
    Report(argv[1], argc > 2 ? std::atoi(argv[2]) : 96, argc > 3 ? std::atoi(argv[3]) : 480);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
