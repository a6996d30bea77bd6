#include "dtr/eval/growth.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "dtr/base/error.h"
#include "dtr/render/geometry.h"
#include "dtr/render/valid_views.h"

namespace dtr::eval {
namespace {

constexpr std::array kViewsUsed{1, 2, 4, 8, 16};
constexpr std::array kPixelFactors{0.25, 0.5, 1.0, 2.0, 4.0};
constexpr std::array kViewsInSet{4, 16, 64, 256};
constexpr int kUsedOfLargeSet = 4;
// Copies stay this share of the way from the used views to the limit of valid ones.
constexpr double kFirstCopy = 0.1, kLastCopy = 0.9;
// Turns successive copies apart around the line of sight: the golden angle fills a circle evenly.
const double kGoldenAngleRad = std::numbers::pi * (3 - std::sqrt(5.0));

/// One frame of a series.
struct Frame {
  double value;
  RenderScene scene;
  PinholeCamera camera;
  RenderOptions options;
};

GrowthSeries Measure(const std::string& axis, const std::vector<Frame>& frames, bool linear,
                     const Pose& pose, int repeats, TimedRenderer& renderer, Progress& progress) {
  std::vector<FrameTimes> times(frames.size());
  progress.Stage(axis, repeats + 1);
  for (int repeat = -1; repeat < repeats; ++repeat) {  // the first round is not counted
    for (size_t i = 0; i < frames.size(); ++i) {
      progress.ThrowIfInterrupted();
      const Frame& f = frames[i];
      const FrameTime time = renderer.Draw(f.scene, f.camera, pose, f.options);
      if (repeat >= 0) times[i].Add(time);
    }
    progress.Update(repeat + 2);
  }
  GrowthSeries series{axis, {}, 0};
  for (size_t i = 0; i < frames.size(); ++i) {
    series.rows.push_back({frames[i].value, times[i].Frame(), times[i].Cpu()});
  }
  const auto cost = [&](const GrowthRow& row) {
    return renderer.HasGpuClock() ? row.frame.median_ms : row.cpu.median_ms;
  };
  for (const GrowthRow& a : series.rows) {
    for (const GrowthRow& b : series.rows) {
      if (!(b.value > a.value)) continue;
      const double growth = cost(b) / cost(a);
      series.worst_growth =
          std::max(series.worst_growth, linear ? growth * a.value / b.value : growth);
    }
  }
  return series;
}

/// Cameras of copies: turned about the scene's centre away from the novel camera.
std::vector<View> TurnedCopies(const RenderScene& scene, const std::vector<int>& nearest_first,
                               const Pose& novel_from_world, double max_angle_rad, int count) {
  const Eigen::Vector3d to_novel = novel_from_world.TargetOriginInSource() - scene.center;
  const auto angle_of = [&](int index) {
    const View& view = *scene.views[static_cast<size_t>(index)];
    return AngleBetween(view.CenterInWorld() - scene.center, to_novel);
  };
  const int used = std::min<int>(kUsedOfLargeSet, static_cast<int>(nearest_first.size()));
  const double first = angle_of(nearest_first.front());
  const double last = angle_of(nearest_first[static_cast<size_t>(used - 1)]);
  const Eigen::Vector3d line_of_sight = to_novel.normalized();
  std::vector<View> copies;
  for (int i = 0; i < count; ++i) {
    // Turned by t, a copy of the nearest view stands between t - first and t + first off.
    const double share = kFirstCopy + (kLastCopy - kFirstCopy) * i / count;
    const double turn = last + first + share * std::max(0.0, max_angle_rad - last - 2 * first);
    const Eigen::Vector3d axis =
        Eigen::AngleAxisd(i * kGoldenAngleRad, line_of_sight) * line_of_sight.unitOrthogonal();
    const Eigen::Quaterniond world_turn(Eigen::AngleAxisd(turn, axis));
    const View& original = *scene.views[static_cast<size_t>(nearest_first.front())];
    View copy;
    copy.id = "~copy" + std::to_string(i);
    copy.name = copy.id;
    copy.camera = original.camera;
    copy.reference_baseline = original.reference_baseline;
    const Eigen::Vector3d center = world_turn * (original.CenterInWorld() - scene.center);
    copy.cam_from_world.rotation = original.cam_from_world.rotation * world_turn.conjugate();
    copy.cam_from_world.translation = -(copy.cam_from_world.rotation * (center + scene.center));
    copies.push_back(std::move(copy));
  }
  return copies;
}

std::vector<Frame> ByViewsUsed(const RenderScene& scene, const PinholeCamera& camera,
                               const RenderOptions& options, int valid) {
  std::vector<Frame> frames;
  for (const int views : kViewsUsed) {
    if (views > valid) break;
    frames.push_back({static_cast<double>(views), scene, camera, options});
    frames.back().options.views = views;
  }
  return frames;
}

std::vector<Frame> ByPixels(const RenderScene& scene, const PinholeCamera& camera,
                            const RenderOptions& options) {
  std::vector<Frame> frames;
  for (const double factor : kPixelFactors) {
    const auto side = [&](int px) {
      return std::max(1, static_cast<int>(std::lround(px * std::sqrt(factor))));
    };
    const PinholeCamera sized = camera.Resized(side(camera.width_px()), side(camera.height_px()));
    frames.push_back({1e-6 * sized.width_px() * sized.height_px(), scene, sized, options});
  }
  return frames;
}

/// The nearest views first, so that every set has the four that are used.
std::vector<Frame> ByViewsInSet(const RenderScene& scene, const PinholeCamera& camera,
                                RenderOptions options, const std::vector<int>& nearest_first,
                                const std::vector<View>& copies, const std::vector<int>& counts) {
  // Copies have no pixels: they stand for what a large set adds, and are never drawn.
  options.views = std::min<int>(kUsedOfLargeSet, static_cast<int>(nearest_first.size()));
  std::vector<Frame> frames;
  for (const int count : counts) {
    RenderScene part = scene;
    part.views.clear();
    for (size_t i = 0; i < static_cast<size_t>(count); ++i) {
      part.views.push_back(i < nearest_first.size()
                               ? scene.views[static_cast<size_t>(nearest_first[i])]
                               : &copies[i - nearest_first.size()]);
    }
    std::sort(part.views.begin(), part.views.end(),
              [](const View* a, const View* b) { return a->id < b->id; });
    frames.push_back({static_cast<double>(count), std::move(part), camera, options});
  }
  return frames;
}

/// Sizes of the sets. By the per-pixel rule every view of a set is drawn, copies too: then sets are
/// of the `valid` views alone.
std::vector<int> SizesOfSets(int valid, bool per_pixel) {
  std::vector<int> counts(kViewsInSet.begin(), kViewsInSet.end());
  if (!per_pixel) return counts;
  std::erase_if(counts, [&](int count) { return count >= valid; });
  counts.push_back(valid);
  return counts;
}

}  // namespace

std::vector<GrowthSeries> MeasureGrowth(const DtrSet& set, const NovelCamera& novel,
                                        const GrowthOptions& options, TimedRenderer& renderer,
                                        Progress& progress) {
  const RenderScene scene = MakeRenderScene(set);
  RenderOptions render = options.render;
  render.fill_holes = render.smooth_edges = false;
  RenderOptions all = render;
  all.views = static_cast<int>(std::max<size_t>(1, scene.views.size()));
  const ViewSelection nearest = SelectViews(scene, novel.cam_from_world, all);
  if (nearest.views.empty()) throw UsageError("bench: no view of the set is valid for the camera");
  const auto valid = static_cast<int>(nearest.views.size());
  const std::vector<int> counts = SizesOfSets(valid, nearest.per_pixel);
  if (nearest.per_pixel) {
    progress.Note("every view is drawn by the per-pixel rule (SPEC 1.3): sets of up to the " +
                  std::to_string(valid) + " views there are, and their cost may grow");
  }
  const std::vector<View> copies =
      TurnedCopies(scene, nearest.views, novel.cam_from_world, render.max_angle_rad,
                   std::max(0, counts.back() - valid));
  const auto measure = [&](const std::string& axis, const std::vector<Frame>& frames, bool linear) {
    return Measure(axis, frames, linear, novel.cam_from_world, options.repeats, renderer, progress);
  };
  return {measure("views_used", ByViewsUsed(scene, novel.camera, render, valid), true),
          measure("pixels", ByPixels(scene, novel.camera, render), true),
          measure("views_in_set",
                  ByViewsInSet(scene, novel.camera, render, nearest.views, copies, counts), false)};
}

}  // namespace dtr::eval
