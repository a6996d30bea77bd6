#include "stereo/widen.h"

#include <algorithm>

#include "dtr/base/parallel_for.h"
#include "dtr/types/area_average.h"
#include "stereo/side_by_side.h"

namespace dtr::stereo {
namespace {

constexpr int kLookSidePx = 256;
constexpr int kLookShrink = 4;  // per axis, for images that are small themselves
constexpr double kEndBand = 1.03;
constexpr double kSuspiciousShare = 0.01;
constexpr double kNearStep = 1.5, kFarStep = 2.0;

std::vector<SmallView> SmallViews(const Collection& c, Progress& progress) {
  std::vector<SmallView> small(c.views.size());
  progress.Stage("depth ranges", static_cast<int>(c.views.size()));
  std::uint64_t largest = 1;
  for (const StereoView& view : c.views) largest = std::max(largest, PixelBytes(view.camera));
  const std::uint64_t fit = c.pages->limit() / (Pages::kLoadingCopies * largest);
  const int at_once = static_cast<int>(
      std::clamp<std::uint64_t>(fit, 1, static_cast<std::uint64_t>(ThreadLimit::Current())));
  ParallelFor(0, static_cast<int>(c.views.size()), at_once, [&](int v) {
    progress.ThrowIfInterrupted();
    const ViewsAround alone(c.views, c.load_pixels, *c.pages, v, {});
    const StereoView& view = alone.views()[static_cast<size_t>(v)];
    small[static_cast<size_t>(v)] = Shrink(view, LookSide(view.camera));
  });
  return small;
}

/// The small images are all in memory, and what an engine takes for one is little.
int LooksAtOnce(const Collection& c, std::span<const StereoView> views) {
  const bool says = !views.empty() && c.engine->WorkBytes(views, 0, c.neighbours[0].views) > 0;
  return says ? ThreadLimit::Current() : 1;
}

/// Moves the ends that too many depths lie at; false when there is none.
bool Widen(const EndShares& shares, DepthRange* range) {
  const bool near_end = shares.at_near > kSuspiciousShare;
  const bool far_end = shares.at_far > kSuspiciousShare;
  if (near_end) range->near_z /= kNearStep;
  if (far_end) range->far_z *= kFarStep;
  return near_end || far_end;
}

std::string Summary(std::span<const DepthRange> before, std::span<const DepthRange> after) {
  int views = 0, near_ends = 0, far_ends = 0;
  for (size_t v = 0; v < before.size(); ++v) {
    const bool nearer = after[v].near_z < before[v].near_z;
    const bool farther = after[v].far_z > before[v].far_z;
    views += nearer || farther;
    near_ends += nearer;
    far_ends += farther;
  }
  if (views == 0) return {};
  return "depth range widened in " + std::to_string(views) + " of " +
         std::to_string(before.size()) + " views, in " + std::to_string(near_ends) +
         " at the near end, in " + std::to_string(far_ends) +
         " at the far one: depths were piled up there";
}

}  // namespace

int LookSide(const PinholeCamera& camera) {
  const int side = std::max(camera.width_px(), camera.height_px());
  return std::clamp(side / kLookShrink, 1, kLookSidePx);
}

SmallView Shrink(const StereoView& view, int max_size_px) {
  const PinholeCamera& camera = view.camera;
  const auto [w, h] = TargetSize(camera.width_px(), camera.height_px(), max_size_px);
  SmallView small;
  small.camera = camera.Resized(w, h);
  small.pixels.image = AreaAverage(*view.image, w, h);
  if (view.mask != nullptr && !view.mask->empty()) {
    small.pixels.mask = ShrinkMask(*view.mask, w, h);
  }
  return small;
}

EndShares SharesAtEnds(const DepthImage& depth, const DepthRange& range) {
  long kept = 0, at_near = 0, at_far = 0;
  for (const float z : depth.grid().data()) {
    if (DepthImage::IsHole(z)) continue;
    ++kept;
    at_near += z < kEndBand * range.near_z;
    at_far += z > range.far_z / kEndBand;
  }
  if (kept == 0) return {};
  return {static_cast<double>(at_near) / static_cast<double>(kept),
          static_cast<double>(at_far) / static_cast<double>(kept)};
}

std::vector<DepthRange> Widened(const Collection& c, int most, Progress& progress) {
  std::vector<DepthRange> ranges(c.ranges.begin(), c.ranges.end());
  if (most <= 0 || !c.engine->Searches()) return ranges;
  const std::vector<SmallView> small = SmallViews(c, progress);
  std::vector<StereoView> views;
  for (size_t v = 0; v < small.size(); ++v) {
    views.push_back({small[v].camera, c.views[v].cam_from_world, &small[v].pixels.image,
                     &small[v].pixels.mask, c.views[v].prior});
  }
  EngineOptions options = c.options;
  options.look = true;
  SideBySide(views.size(), LooksAtOnce(c, views), progress, [&](size_t v, std::string*) {
    std::span<const int> neighbours = c.neighbours[v].views;
    if (neighbours.empty()) return;
    neighbours = neighbours.first(std::min<size_t>(neighbours.size(), kLookNeighbours));
    try {
      for (int step = 0; step < most; ++step) {
        progress.ThrowIfInterrupted();
        const DepthEstimate look =
            c.engine->Estimate(views, static_cast<int>(v), neighbours, ranges[v], options);
        if (!Widen(SharesAtEnds(look.depth, ranges[v]), &ranges[v])) break;
      }
    } catch (const NoUsablePair&) {
      // The run itself will say so.
    }
  });
  if (const std::string summary = Summary(c.ranges, ranges); !summary.empty()) {
    progress.Note(summary);
  }
  return ranges;
}

}  // namespace dtr::stereo
