#include "dtr/prune/coding.h"

#include <algorithm>

#include "dtr/render/scene.h"
#include "dtr/types/area_average.h"

namespace dtr::prune {
namespace {

/// The largest group of ascending values none of which are farther apart than `width`; of equals
/// the last, which is the nearest surface of inverse depths.
std::pair<size_t, size_t> LargestGroup(const std::vector<double>& sorted, double width) {
  std::pair<size_t, size_t> best{0, 0};
  for (size_t begin = 0, end = 0; begin < sorted.size(); ++begin) {
    while (end < sorted.size() && sorted[end] - sorted[begin] <= width) ++end;
    if (end - begin >= best.second - best.first) best = {begin, end};
  }
  return best;
}

}  // namespace

bool CanShrink(const DtrSet& set, int shrink) {
  const auto divides = [&](const View& view) {
    const int step = shrink * view.depth_scale;
    return view.role != ViewRole::kSource ||
           (view.camera.width_px() % step == 0 && view.camera.height_px() % step == 0);
  };
  return !set.frames.empty() &&
         std::all_of(set.frames[0].views.begin(), set.frames[0].views.end(), divides);
}

DepthImage ShrunkDepth(const DepthImage& depth, int shrink, double depth_break) {
  DepthImage small(depth.width() / shrink, depth.height() / shrink);
  const auto needed = static_cast<size_t>(shrink * shrink + 1) / 2;
  std::vector<double> inverse;
  for (int y = 0; y < small.height(); ++y) {
    for (int x = 0; x < small.width(); ++x) {
      inverse.clear();
      for (int k = 0; k < shrink * shrink; ++k) {
        const float z = depth(x * shrink + k % shrink, y * shrink + k / shrink);
        if (!DepthImage::IsHole(z)) inverse.push_back(1.0 / z);
      }
      if (inverse.size() < needed) continue;
      std::sort(inverse.begin(), inverse.end());
      const auto [begin, end] = LargestGroup(inverse, depth_break);
      double sum = 0;
      for (size_t i = begin; i < end; ++i) sum += inverse[i];
      small(x, y) = static_cast<float>(static_cast<double>(end - begin) / sum);
    }
  }
  return small;
}

namespace {

/// A mean of rounded numbers may miss the end of the range by one digit.
DepthImage ShrunkWithin(const DepthImage& depth, int shrink, double depth_break, double near_z,
                        double far_z) {
  DepthImage small = ShrunkDepth(depth, shrink, depth_break);
  const auto nearest = static_cast<float>(near_z), farthest = static_cast<float>(far_z);
  for (float& z : small.grid().data()) {
    if (near_z > 0 && !DepthImage::IsHole(z)) z = std::clamp(z, nearest, farthest);
  }
  return small;
}

}  // namespace

View ShrunkView(const View& view, int shrink) {
  View small = view;
  const int width = view.camera.width_px() / shrink, height = view.camera.height_px() / shrink;
  small.camera = view.camera.Resized(width, height);
  small.image = AreaAverage(view.image, width, height);
  if (!view.mask.empty()) small.mask = ShrinkMask(view.mask, width, height);
  const double depth_break = ThresholdsOf(view, {}).depth_break;
  small.depth_state = {};
  small.depth = ShrunkWithin(MeasuredDepth(view), shrink, depth_break, view.near_z, view.far_z);
  if (!view.depth_state.empty()) {
    AddCompletedDepth(ShrunkWithin(CompletedDepth(view), shrink, depth_break, view.completed_near_z,
                                   view.completed_far_z),
                      small);
  }
  small.inverse_depth_sigma.reset();
  small.mesh.reset();
  small.mesh_file.reset();
  small.sigma_file.reset();
  return small;
}

}  // namespace dtr::prune
