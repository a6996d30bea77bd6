#include "dtr/advise/redundant.h"

#include <algorithm>
#include <atomic>
#include <numbers>

#include "dtr/advise/places.h"
#include "dtr/base/parallel_for.h"
#include "dtr/render/geometry.h"

namespace dtr::advise {
namespace {

constexpr double kAsLarge = 0.7;  // pixels per length on the surface
constexpr int kEvery = 2;         // sample of the coarse grid, per axis

// Which others show each point of a view: bit k is others[k].
struct Shown {
  std::vector<size_t> others;
  std::vector<std::uint32_t> points;
};

// Pixels of the photo per unit of length at a point, for a surface that faces it.
double Magnification(const CoarseView& view, const Eigen::Vector3d& p_in_world) {
  return view.camera.fx_px() * view.pixel_of_fine / (view.cam_from_world * p_in_world).z();
}

Shown ShownOf(std::span<const CoarseView> views, size_t index, double max_angle_rad) {
  const CoarseView& view = views[index];
  Shown shown;
  shown.others = NearestViews(views, view.cam_from_world, kViewsAsked + 1);
  std::erase(shown.others, index);
  const Pose world_from_cam = view.cam_from_world.Inverse();
  const Eigen::Vector3d center = view.CenterInWorld();
  for (int y = kEvery / 2; y < view.depth.height(); y += kEvery) {
    for (int x = kEvery / 2; x < view.depth.width(); x += kEvery) {
      const float z = view.depth(x, y);
      if (DepthImage::IsHole(z)) continue;
      const Eigen::Vector3d p =
          world_from_cam * view.camera.CamFromPixel({x + 0.5, y + 0.5}, z, DepthKind::kPlaneZ);
      std::uint32_t bits = 0;
      for (size_t k = 0; k < shown.others.size() && k < kViewsAsked; ++k) {
        const CoarseView& other = views[shown.others[k]];
        const bool covers = VisibilityOf(other, p, kOneSurface) == Visibility::kSeen &&
                            AngleBetween(center - p, other.CenterInWorld() - p) <= max_angle_rad &&
                            Magnification(other, p) >= kAsLarge * Magnification(view, p);
        if (covers) bits |= 1U << k;
      }
      shown.points.push_back(bits);
    }
  }
  return shown;
}

double CoveredShare(const Shown& shown, const std::vector<bool>& stays) {
  std::uint32_t active = 0;
  for (size_t k = 0; k < shown.others.size() && k < kViewsAsked; ++k) {
    if (stays[shown.others[k]]) active |= 1U << k;
  }
  if (shown.points.empty()) return 0;
  const auto covered = std::count_if(shown.points.begin(), shown.points.end(),
                                     [&](std::uint32_t bits) { return (bits & active) != 0; });
  return static_cast<double>(covered) / static_cast<double>(shown.points.size());
}

}  // namespace

std::vector<Redundant> FindRedundant(std::span<const CoarseView> views,
                                     const AdviseOptions& options, Progress& progress) {
  const int count = static_cast<int>(views.size());
  progress.Stage("what cameras share", count);
  const double max_angle = options.max_gap_deg / 2 * std::numbers::pi / 180;
  std::vector<Shown> shown(views.size());
  std::atomic<int> done{0};
  ParallelFor(0, count, [&](int i) {
    progress.ThrowIfInterrupted();
    shown[static_cast<size_t>(i)] = ShownOf(views, static_cast<size_t>(i), max_angle);
    progress.Update(++done);
  });

  std::vector<bool> stays(views.size(), true);
  std::vector<size_t> out;
  // Whether all that was left out stays covered without `index` too.
  const auto may_go = [&](size_t index) {
    stays[index] = false;
    const bool fine = std::all_of(out.begin(), out.end(), [&](size_t gone) {
      return CoveredShare(shown[gone], stays) >= options.redundant_share;
    });
    stays[index] = true;
    return fine;
  };
  while (views.size() - out.size() > 2) {
    std::vector<std::pair<double, size_t>> best;
    for (size_t i = 0; i < views.size(); ++i) {
      const double share = stays[i] ? CoveredShare(shown[i], stays) : 0;
      if (share >= options.redundant_share) best.emplace_back(-share, i);
    }
    std::sort(best.begin(), best.end());
    const auto next = std::find_if(best.begin(), best.end(),
                                   [&](const auto& candidate) { return may_go(candidate.second); });
    if (next == best.end()) break;
    stays[next->second] = false;
    out.push_back(next->second);
  }
  std::vector<Redundant> redundant;
  for (const size_t index : out) {
    redundant.push_back({views[index].name, CoveredShare(shown[index], stays)});
  }
  return redundant;
}

}  // namespace dtr::advise
