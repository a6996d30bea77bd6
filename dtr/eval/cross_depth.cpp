#include "dtr/eval/cross_depth.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <tuple>

#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"

namespace dtr::eval {
namespace {

constexpr float kSmoothDepthRatio = 1.03f;  // neighbouring depths of a larger ratio: other surfaces
constexpr double kOtherSurfacePx = 3.0;     // stereo keeps depth to well below a pixel
constexpr long long kEnoughPixels = 200;    // a median of fewer says little about a view

/// Inverse depth of the view's surface where `pixel` (of the depth grid) lies on one smooth
/// surface, exact on planes; empty at edges, holes and off the map.
std::optional<double> InverseDepthAt(const DepthImage& depth, const Eigen::Vector2d& pixel) {
  const double u = pixel.x() - 0.5, v = pixel.y() - 0.5;
  if (!(u >= 0 && v >= 0 && u < depth.width() - 1 && v < depth.height() - 1)) return std::nullopt;
  const int x = static_cast<int>(u), y = static_cast<int>(v);
  const float corner[4] = {depth(x, y), depth(x + 1, y), depth(x, y + 1), depth(x + 1, y + 1)};
  for (const float z : corner) {
    if (DepthImage::IsHole(z)) return std::nullopt;
  }
  const auto [low, high] = std::minmax_element(corner, corner + 4);
  if (*high >= kSmoothDepthRatio * *low) return std::nullopt;
  const double a = u - x, b = v - y;
  return (1 - b) * ((1 - a) / corner[0] + a / corner[1]) +
         b * ((1 - a) / corner[2] + a / corner[3]);
}

enum class Outcome { kNothing, kOccluded, kContradicted, kCompared };

/// A view's depth map with the camera and the pose that it was made for.
struct Surface {
  const DepthImage& depth;
  const PinholeCamera& grid;
  const Pose& cam_from_world;
  int depth_scale;
};

/// One round trip: the depth pixel (x, y) of `view` through `other`.
Outcome RoundTrip(const Surface& view, const Surface& other, const Pose& other_from_view, int x,
                  int y, double* error_px) {
  const Eigen::Vector2d start(x + 0.5, y + 0.5);
  const Eigen::Vector3d p_in_view =
      view.grid.CamFromPixel(start, view.depth(x, y), DepthKind::kPlaneZ);
  const Eigen::Vector3d p_in_other = other_from_view * p_in_view;
  const auto landed = other.grid.PixelFromCam(p_in_other);
  if (!landed) return Outcome::kNothing;
  const auto inverse = InverseDepthAt(other.depth, *landed);
  if (!inverse) return Outcome::kNothing;
  const Eigen::Vector3d back = other_from_view.Inverse() *
                               other.grid.CamFromPixel(*landed, 1 / *inverse, DepthKind::kPlaneZ);
  const auto returned = view.grid.PixelFromCam(back);
  // A surface behind this camera cannot be told from one that hides the point: no statement.
  if (!returned) return Outcome::kNothing;
  *error_px = (*returned - start).norm() * view.depth_scale;
  if (*error_px <= kOtherSurfacePx) return Outcome::kCompared;
  return 1 / *inverse < p_in_other.z() ? Outcome::kOccluded : Outcome::kContradicted;
}

double AngleAt(const Eigen::Vector3d& center, const View& a, const View& b) {
  const Eigen::Vector3d u = a.CenterInWorld() - center, v = b.CenterInWorld() - center;
  return std::atan2(u.cross(v).norm(), u.dot(v));
}

/// Indices of the nearest views, nearest first; ties by index.
// Views from one point, as those of a panorama, say nothing of each other's depth; views that look
// elsewhere have nothing in common, however near they stand.
bool MayCompare(const View& a, const View& b) {
  constexpr double kMinCosine = 0.5, kSamePoint = 1e-9;
  const Eigen::Vector3d centre_a = a.CenterInWorld(), centre_b = b.CenterInWorld();
  const double size = std::max(centre_a.norm(), centre_b.norm());
  if ((centre_a - centre_b).norm() <= kSamePoint * size) return false;
  const Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
  return (a.cam_from_world.rotation.conjugate() * axis)
             .dot(b.cam_from_world.rotation.conjugate() * axis) >= kMinCosine;
}

std::vector<size_t> Neighbours(std::span<const View* const> views, size_t reference,
                               const CrossDepthOptions& options) {
  std::vector<std::tuple<bool, double, size_t>> order;
  for (size_t i = 0; i < views.size(); ++i) {
    if (i == reference) continue;
    order.emplace_back(!MayCompare(*views[reference], *views[i]),
                       options.scene_center
                           ? AngleAt(*options.scene_center, *views[reference], *views[i])
                           : (views[reference]->CenterInWorld() - views[i]->CenterInWorld()).norm(),
                       i);
  }
  std::sort(order.begin(), order.end());
  // What cannot be compared takes no place where something can.
  if (!order.empty() && !std::get<0>(order.front())) {
    std::erase_if(order, [](const auto& candidate) { return std::get<0>(candidate); });
  }
  if (order.size() > static_cast<size_t>(std::max(1, options.neighbours))) {
    order.resize(static_cast<size_t>(std::max(1, options.neighbours)));
  }
  std::vector<size_t> nearest;
  for (const auto& [last, distance, i] : order) nearest.push_back(i);
  return nearest;
}

/// Sorts the errors and fills in the percentiles (nearest rank).
void Summarise(std::vector<float>& errors, CrossDepthOfView* result) {
  result->compared = static_cast<long long>(errors.size());
  if (errors.empty()) return;
  std::sort(errors.begin(), errors.end());
  const auto rank = [&](double share) {
    const double position = std::ceil(share * static_cast<double>(errors.size())) - 1;
    return static_cast<double>(errors[static_cast<size_t>(std::max(0.0, position))]);
  };
  result->median_px = rank(0.5);
  result->p95_px = rank(0.95);
}

std::vector<Check> MakeTests(const CrossDepthReport& report, const CrossDepthOptions& options) {
  constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
  const CrossDepthOfView& all = report.all;
  const double value = all.compared >= kEnoughPixels ? all.median_px : kNothing;
  std::vector<Check> tests;
  tests.push_back(
      {"cross_depth_px", value, options.max_cross_px, value <= options.max_cross_px,
       all.compared >= kEnoughPixels
           ? fmt::format(
                 "median round trip of {} depth pixels; 95 % within {:.3g} px, {:.2g} % "
                 "contradicted",
                 all.compared, all.p95_px,
                 100.0 * static_cast<double>(all.contradicted) / static_cast<double>(all.compared))
           : fmt::format("only {} depth pixels could be compared: too little overlap or depth",
                         all.compared)});
  const CrossDepthOfView* worst = nullptr;
  for (const CrossDepthOfView& view : report.views) {
    if (view.compared < kEnoughPixels) continue;
    if (worst == nullptr || view.median_px > worst->median_px) worst = &view;
  }
  if (worst != nullptr) {
    tests.push_back(
        {"worst_view_cross_depth_px", worst->median_px, options.max_view_cross_px,
         worst->median_px <= options.max_view_cross_px,
         fmt::format("view {}: median of {} depth pixels", worst->name, worst->compared)});
  }
  return tests;
}

/// The samples of one view, through all its neighbours. `errors`: of what counts.
CrossDepthOfView ThroughNeighbours(const Surface& view, std::span<const Surface> neighbours,
                                   int samples, std::vector<float>& errors) {
  CrossDepthOfView result;
  const double pixels = static_cast<double>(view.depth.width()) * view.depth.height();
  const int step =
      std::max(1, static_cast<int>(std::ceil(std::sqrt(pixels / std::max(1, samples)))));
  for (const Surface& other : neighbours) {
    const Pose other_from_view = other.cam_from_world * view.cam_from_world.Inverse();
    for (int y = step / 2; y < view.depth.height(); y += step) {
      for (int x = step / 2; x < view.depth.width(); x += step) {
        if (DepthImage::IsHole(view.depth(x, y))) continue;
        double error_px = 0;
        const Outcome outcome = RoundTrip(view, other, other_from_view, x, y, &error_px);
        if (outcome == Outcome::kNothing) continue;
        result.occluded += outcome == Outcome::kOccluded;
        result.contradicted += outcome == Outcome::kContradicted;
        if (outcome != Outcome::kOccluded) errors.push_back(static_cast<float>(error_px));
      }
    }
  }
  Summarise(errors, &result);
  return result;
}

/// Depth maps as far as they are needed: those in memory stay where they are, others are brought.
class DepthMaps {
 public:
  DepthMaps(std::span<const View* const> views, const DepthLoader& load)
      : views_(views), load_(load), own_(views.size()) {
    for (const View* view : views) grids_.push_back(view->DepthCamera());
  }

  /// What a map takes in memory; nothing where it is there anyhow.
  size_t Bytes(size_t i) const {
    return load_ ? sizeof(float) * static_cast<size_t>(grids_[i].width_px()) *
                       static_cast<size_t>(grids_[i].height_px())
                 : 0;
  }

  /// Brings these, and lets go of all others.
  void Hold(const std::set<size_t>& needed) {
    std::vector<size_t> missing;
    for (size_t i = 0; i < own_.size(); ++i) {
      if (!needed.contains(i)) {
        own_[i] = DepthImage();
      } else if (load_ && own_[i].empty()) {
        missing.push_back(i);
      }
    }
    ParallelFor(0, static_cast<int>(missing.size()), [&](int at) {
      const size_t i = missing[static_cast<size_t>(at)];
      own_[i] = load_(*views_[i]);
    });
    for (const size_t i : needed) RequireSize(i);
  }

  Surface At(size_t i) const {
    return {Depth(i), grids_[i], views_[i]->cam_from_world, views_[i]->depth_scale};
  }

 private:
  const DepthImage& Depth(size_t i) const { return load_ ? own_[i] : views_[i]->depth; }

  void RequireSize(size_t i) const {
    const PinholeCamera& grid = grids_[i];
    if (grid.width_px() == Depth(i).width() && grid.height_px() == Depth(i).height()) return;
    throw Error(fmt::format("cross check: view {}: expected depth of {}x{}, found {}x{}",
                            views_[i]->name, grid.width_px(), grid.height_px(), Depth(i).width(),
                            Depth(i).height()));
  }

  std::span<const View* const> views_;
  const DepthLoader& load_;
  std::vector<PinholeCamera> grids_;
  std::vector<DepthImage> own_;
};

CrossDepthReport Compare(std::span<const View* const> views, const CrossDepthOptions& options,
                         const DepthLoader& load) {
  if (views.size() < 2) {
    throw Error(
        fmt::format("cross check: expected at least 2 views with depth, found {}", views.size()));
  }
  DepthMaps maps(views, load);
  std::vector<std::vector<size_t>> neighbours;
  for (size_t i = 0; i < views.size(); ++i) neighbours.push_back(Neighbours(views, i, options));
  CrossDepthReport report;
  report.views.resize(views.size());
  std::vector<std::vector<float>> errors(views.size());
  // As many views at a time as fit into memory with their neighbours.
  for (size_t begin = 0, end = 0; begin < views.size(); begin = end) {
    std::set<size_t> needed;
    for (; end < views.size(); ++end) {
      std::set<size_t> more(neighbours[end].begin(), neighbours[end].end());
      more.insert(end);
      more.merge(std::set<size_t>(needed));
      size_t bytes = 0;
      for (const size_t i : more) bytes += maps.Bytes(i);
      if (end > begin && bytes > options.memory_bytes) break;
      needed = std::move(more);
    }
    maps.Hold(needed);
    ParallelFor(static_cast<int>(begin), static_cast<int>(end), [&](int item) {
      const auto i = static_cast<size_t>(item);
      std::vector<Surface> others;
      for (const size_t n : neighbours[i]) others.push_back(maps.At(n));
      report.views[i] = ThroughNeighbours(maps.At(i), others, options.samples_per_view, errors[i]);
      report.views[i].name = views[i]->name;
    });
  }

  std::vector<float> all;
  for (size_t i = 0; i < views.size(); ++i) {
    all.insert(all.end(), errors[i].begin(), errors[i].end());
    report.all.occluded += report.views[i].occluded;
    report.all.contradicted += report.views[i].contradicted;
  }
  report.all.name = "all";
  Summarise(all, &report.all);
  report.tests = MakeTests(report, options);
  return report;
}

}  // namespace

CrossDepthReport CrossDepth(std::span<const View* const> all_views,
                            const CrossDepthOptions& options) {
  std::vector<const View*> views;
  for (const View* view : all_views) {
    if (!view->depth.empty()) views.push_back(view);
  }
  return Compare(views, options, {});
}

CrossDepthReport CrossDepth(std::span<const View* const> views, const CrossDepthOptions& options,
                            const DepthLoader& load) {
  return Compare(views, options, load);
}

}  // namespace dtr::eval
