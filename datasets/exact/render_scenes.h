// datasets/exact/render_scenes.h -- small sets to draw, and comparisons of what was drawn; shared
// by the tests and by `dtr selftest`.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "datasets/exact/analytic_scene.h"
#include "dtr/render/geometry.h"
#include "dtr/render/options.h"
#include "dtr/render/result.h"

namespace dtr::testing {

inline constexpr BlendWeight kAllWeights[] = {BlendWeight::kCosine, BlendWeight::kExponential,
                                              BlendWeight::kAngle, BlendWeight::kInverseAngle,
                                              BlendWeight::kKNearest};

inline constexpr RenderMethod kBothMethods[] = {RenderMethod::kTwoPass, RenderMethod::kDeferred};

inline RenderOptions OptionsOf(RenderMethod method) {
  RenderOptions options;
  options.method = method;
  return options;
}

inline DtrSet SetOf(std::vector<View> views) {
  DtrSet set;
  set.frames.resize(1);
  set.frames[0].views = std::move(views);
  FinishGeometry(set);
  return set;
}

inline Shot ShotFrom(const std::string& id, const Eigen::Vector3d& center,
                     const Eigen::Vector3d& target) {
  Shot shot;
  shot.id = id;
  shot.cam_from_world = LookAt(center, target);
  return shot;
}

/// A square of side 2 at z = 5 before the plane z = 10.
inline Surface SquareAndPlane() { return Union(Square(0, 0, 5, 1), Plane({0, 0, 1}, 10)); }

/// Five views of it, 0.5 apart on a line.
inline DtrSet SquareBeforePlane() {
  std::vector<View> views;
  for (int i = 0; i < 5; ++i) {
    views.push_back(Photograph(
        SquareAndPlane(), ShotFrom("v" + std::to_string(i), {0.5 * (i - 2), 0, 0}, {0, 0, 10})));
  }
  return SetOf(std::move(views));
}

inline int PixelDifference(const ImageRgb8& a, const ImageRgb8& b, int x, int y) {
  int largest = 0;
  for (int c = 0; c < 3; ++c) largest = std::max(largest, std::abs(a(x, y, c) - b(x, y, c)));
  return largest;
}

inline int LargestDifference(const ImageRgb8& a, const ImageRgb8& b) {
  int largest = 0;
  for (int y = 0; y < a.height(); ++y) {
    for (int x = 0; x < a.width(); ++x) largest = std::max(largest, PixelDifference(a, b, x, y));
  }
  return largest;
}

/// Pixels of a result whose fields contradict each other, or that hold NaN or infinity: depth is
/// finite, and what is seen has depth and a view, what is not is black.
inline long long Contradictions(const RenderResult& result) {
  long long count = 0;
  for (size_t p = 0; p < result.coverage.data().size(); ++p) {
    const float depth = result.depth.grid().data()[p];
    const bool seen = result.coverage.data()[p] != 0;
    bool sound = std::isfinite(depth) && depth >= 0 && seen == (depth > 0) &&
                 seen == (result.view_count.data()[p] > 0);
    for (size_t c = 0; c < 3; ++c) sound = sound && (seen || result.image.data()[3 * p + c] == 0);
    count += !sound;
  }
  return count;
}

/// True when two images agree to the byte in every plane.
inline bool SameBytes(const RenderResult& a, const RenderResult& b) {
  return a.image == b.image && a.depth.grid() == b.depth.grid() && a.coverage == b.coverage &&
         a.view_count == b.view_count && a.delta_border == b.delta_border;
}

inline DtrSet FromAround(const Surface& surface, int count, double spread,
                         const Eigen::Vector3d& target, int depth_scale = 1) {
  std::vector<View> views;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * 3.14159265358979323846 * i / count;
    Shot shot =
        ShotFrom("v" + std::to_string(i),
                 {spread * std::cos(angle), 0.7 * spread * std::sin(angle), 0.1 * i}, target);
    shot.depth_scale = depth_scale;
    views.push_back(Photograph(surface, shot));
  }
  return SetOf(std::move(views));
}

// Single precision moves a vertex by 1e-4 px at most; a pixel on an outline may change hands, any
// other by one level of 255.
inline constexpr int kSameLevels = 1;
inline constexpr double kOutlineShare = 0.005;

/// Share of the pixels more than that apart, or seen in one image alone.
inline double ShareApart(const RenderResult& a, const RenderResult& b) {
  long long apart = 0;
  for (int y = 0; y < a.image.height(); ++y) {
    for (int x = 0; x < a.image.width(); ++x) {
      apart += PixelDifference(a.image, b.image, x, y) > kSameLevels ||
               a.coverage(x, y) != b.coverage(x, y);
    }
  }
  return static_cast<double>(apart) / static_cast<double>(a.coverage.data().size());
}

/// The world scaled and moved; the image must not know.
inline DtrSet Moved(DtrSet set, double scale, const Eigen::Vector3d& offset) {
  for (View& view : set.frames[0].views) {
    const Eigen::Vector3d centre = scale * view.CenterInWorld() + offset;
    view.cam_from_world.translation = -(view.cam_from_world.rotation * centre);
    for (float& depth : view.depth.grid().data()) depth *= static_cast<float>(scale);
  }
  FinishGeometry(set);
  return set;
}
inline Shot Moved(Shot shot, double scale, const Eigen::Vector3d& offset) {
  const Eigen::Vector3d centre = scale * shot.cam_from_world.TargetOriginInSource() + offset;
  shot.cam_from_world.translation = -(shot.cam_from_world.rotation * centre);
  return shot;
}

}  // namespace dtr::testing
