#include "dtr/cpu/own_depth.h"

#include <algorithm>
#include <cmath>

#include "dtr/base/parallel_for.h"
#include "dtr/render/blend_weights.h"
#include "dtr/render/deferred_limits.h"
#include "dtr/render/scene.h"
#include "dtr/render/triangulation.h"

namespace dtr::cpu {
namespace {

// SPEC 5.3: a position this close to a sample, or to the middle between two, is on it. From an
// input camera's own place every position is, and rounding would choose between blocks.
constexpr double kOnGrid = 1e-6;

double OnGrid(double position) {
  const double half = std::round(2 * position) / 2;
  return std::abs(position - half) < kOnGrid ? half : position;
}

/// How the views vote on a surface; shares of their weights.
struct Votes {
  double support = 0, against = 0;
  double front = 0;        ///< 1/z of the nearest whole patch of those that support it; 0: none
  double behind = 0;       ///< 1/z of the nearest surface that a view sees through it; 0: none
  double total = 0;        ///< of the weights of all who see anything there, or a hole
  double heaviest = 0;     ///< of these weights
  double of_heaviest = 0;  ///< 1/z of that view's own surface; 0: none

  /// SPEC 5.2.
  bool OneDecides() const { return of_heaviest > 0 && heaviest > kDecidingShare * total; }
};

/// The view's surface around a position of its grid: w = inverse_depth at the position, slopes per
/// sample.
struct Patch {
  double inverse_depth = 0;  ///< 0: none
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  bool whole = false;   ///< of four samples that belong together
  bool masked = false;  ///< the view does not look there
};

class OwnFragmentFinder {
 public:
  OwnFragmentFinder(const ViewInNovel& view_in_novel, const RenderOptions& options)
      : samples_(MakeSampleGrid(*view_in_novel.view, options.resolution)),
        thresholds_(ThresholdsOf(*view_in_novel.view, options)),
        breaks_(BreakRuleOf(*view_in_novel.view, options)),
        center_(view_in_novel.translation) {
    const PinholeCamera camera = view_in_novel.view->DepthCamera();
    const double origin = samples_.Centre(0), step = samples_.step;
    Eigen::Matrix3d grid_from_view;
    grid_from_view << camera.fx_px() / step, 0, (camera.cx_px() - origin) / step,  //
        0, camera.fy_px() / step, (camera.cy_px() - origin) / step,                //
        0, 0, 1;
    grid_from_novel_ = grid_from_view * view_in_novel.rotation.transpose();
    minus_center_ = -grid_from_novel_ * view_in_novel.translation;
  }

  bool HasSamples() const { return !samples_.inverse_depth.empty(); }

  /// Adds the view's vote on a surface at 1/z = `start` on `ray`.
  void Vote(const Eigen::Vector3d& ray, double start, const BlendParameters& blend,
            Votes& votes) const {
    const Eigen::Vector3d base = grid_from_novel_ * ray;
    const auto position = PositionOnGrid(base, start);
    if (!position) return;
    const double vote = VoteWeight(ray, start, blend);
    const Patch patch = PatchAt(*position);
    if (patch.masked) return;
    const double seen = Meet(base, *position, patch);
    votes.total += vote;
    if (vote > votes.heaviest) votes.heaviest = vote, votes.of_heaviest = seen;
    if (!(seen > 0)) {
      votes.against += kHoleVote * vote;
    } else if (seen - start < -kBehindPx * thresholds_.pixel) {
      votes.against += vote;
      votes.behind = std::max(votes.behind, seen);
    } else if (seen - start <= kSupportBeforePx * thresholds_.pixel) {
      votes.support += vote;
      if (patch.whole && seen - start <= kFragmentBeforePx * thresholds_.pixel) {
        votes.front = std::max(votes.front, seen);
      }
    }  // else the view looks at something before it
  }

  /// 1/z in the novel camera where `ray` (z = 1, novel frame) meets the view's surface near
  /// `surface`; 0 where the view shows another surface there, or none.
  double Find(const Eigen::Vector3d& ray, double surface) const {
    const Eigen::Vector3d base = grid_from_novel_ * ray;
    const auto position = PositionOnGrid(base, surface);
    if (!position) return 0;
    const double w = Meet(base, *position, PatchAt(*position));
    return w > 0 && Within(w - surface) && (base + minus_center_ * w).z() > 0 ? w : 0;
  }

 private:
  bool Within(double nearer) const {
    return nearer <= kFragmentBeforePx * thresholds_.pixel &&
           nearer >= -kBehindPx * thresholds_.pixel;
  }

  /// 1 / (tan^2 t + t_pixel^2), t the angle of SPEC 4.5 at the point ray / w; 0 from 90 degrees on.
  double VoteWeight(const Eigen::Vector3d& ray, double w, const BlendParameters& blend) const {
    w = std::max(w, blend.least_inverse_depth);
    const Eigen::Vector3d to_view = center_ * w - ray;
    const double dot = to_view.dot(-ray);
    if (!(dot > 0)) return 0;
    const double tangent_squared = to_view.cross(ray).squaredNorm() / (dot * dot);
    return 1 / (tangent_squared + blend.pixel_angle_rad * blend.pixel_angle_rad);
  }

  /// Where the point at inverse depth w on the ray falls on the grid of samples, the centre of the
  /// first at (0, 0); empty behind the view and off the depth map. `base`: the ray on the grid.
  std::optional<Eigen::Vector2d> PositionOnGrid(const Eigen::Vector3d& base, double w) const {
    const Eigen::Vector3d q = base + minus_center_ * w;
    if (!(w > 0) || !(q.z() > 0)) return std::nullopt;
    const Eigen::Vector2d position(OnGrid(q.x() / q.z()), OnGrid(q.y() / q.z()));
    const Grid<double>& grid = samples_.inverse_depth;
    const bool inside = position.x() >= -0.5 && position.y() >= -0.5 &&
                        position.x() <= grid.width() - 0.5 && position.y() <= grid.height() - 0.5;
    return inside ? std::optional(position) : std::nullopt;
  }

  double NearestSample(const Eigen::Vector2d& position) const {
    const Grid<double>& grid = samples_.inverse_depth;
    return grid(std::clamp(static_cast<int>(std::floor(position.x() + 0.5)), 0, grid.width() - 1),
                std::clamp(static_cast<int>(std::floor(position.y() + 0.5)), 0, grid.height() - 1));
  }

  /// The tangent of the bilinear patch where the four samples around belong together, else the
  /// nearest sample, flat.
  Patch PatchAt(const Eigen::Vector2d& position) const {
    const Grid<double>& grid = samples_.inverse_depth;
    const int left = static_cast<int>(std::floor(position.x()));
    const int top = static_cast<int>(std::floor(position.y()));
    if (!IsWholeBlock(grid, left, top, breaks_)) {
      return {NearestSample(position), Eigen::Vector2d::Zero(), false,
              IsMaskedBlock(samples_, left, top)};
    }
    const double u = position.x() - left, v = position.y() - top;
    const int x0 = std::max(left, 0), x1 = std::min(left + 1, grid.width() - 1);
    const int y0 = std::max(top, 0), y1 = std::min(top + 1, grid.height() - 1);
    const double a = grid(x0, y0), b = grid(x1, y0), c = grid(x0, y1), d = grid(x1, y1);
    return {(1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d),
            {(1 - v) * (b - a) + v * (d - c), (1 - u) * (c - a) + u * (d - b)},
            true,
            false};
  }

  /// 1/z in the novel camera where the ray meets the patch's plane; 0 where it shows its back or
  /// there is no patch.
  double Meet(const Eigen::Vector3d& base, const Eigen::Vector2d& position,
              const Patch& patch) const {
    if (!(patch.inverse_depth > 0)) return 0;
    // The view's own w at grid point q is w_novel / q.z: on the plane (slope, rest) . q = w_novel.
    const Eigen::Vector3d plane(patch.slope.x(), patch.slope.y(),
                                patch.inverse_depth - patch.slope.dot(position));
    const double facing = 1 - plane.dot(minus_center_);
    return facing > 0 ? plane.dot(base) / facing : 0;
  }

  const SampleGrid samples_;
  const InverseDepthThresholds thresholds_;
  const BreakRule breaks_;
  const Eigen::Vector3d center_;  // of the view, in the novel frame
  // Grid position, homogeneous, of the point ray / w: grid_from_novel_ ray + minus_center_ w.
  Eigen::Matrix3d grid_from_novel_;
  Eigen::Vector3d minus_center_;
};

}  // namespace

std::vector<double> NearestSurface(std::span<const Layer> layers) {
  std::vector<double> nearest = layers.front().inverse_depth;
  for (const Layer& layer : layers.subspan(1)) {
    for (size_t p = 0; p < nearest.size(); ++p) {
      nearest[p] = std::max(nearest[p], layer.inverse_depth[p]);
    }
  }
  return nearest;
}

void KeepSupportedSurfaces(std::span<const ViewInNovel> views, const PinholeCamera& novel,
                           const RenderOptions& options, const BlendParameters& blend,
                           const Band& band, std::span<double> surfaces) {
  std::vector<OwnFragmentFinder> finders;
  for (const ViewInNovel& view : views) {
    finders.emplace_back(view, options);
    if (!finders.back().HasSamples()) finders.pop_back();
  }
  const auto surface_of = [&](const Eigen::Vector3d& ray, double surface) {
    for (int tried = 0; tried < kMaxSurfaces && surface > 0; ++tried) {
      Votes votes;
      for (const auto& finder : finders) finder.Vote(ray, surface, blend, votes);
      if (votes.OneDecides()) return votes.of_heaviest;
      if (votes.support >= votes.against) return votes.front > 0 ? votes.front : surface;
      surface = votes.behind;
    }
    return 0.0;
  };
  ParallelFor(0, band.rows, [&](int row) {
    for (int x = 0; x < band.width_px; ++x) {
      double& surface = surfaces[static_cast<size_t>(row) * static_cast<size_t>(band.width_px) +
                                 static_cast<size_t>(x)];
      surface = surface_of(novel.RayFromPixel({x + 0.5, band.first_row + row + 0.5}), surface);
    }
  });
}

Layer FindOwnFragments(const ViewInNovel& view_in_novel, const PinholeCamera& novel,
                       const RenderOptions& options, const Band& band,
                       std::span<const double> surfaces) {
  Layer layer(band);
  const OwnFragmentFinder finder(view_in_novel, options);
  if (!finder.HasSamples()) return layer;
  size_t p = 0;
  for (int y = band.first_row; y < band.first_row + band.rows; ++y) {
    for (int x = 0; x < band.width_px; ++x, ++p) {
      if (!(surfaces[p] > 0)) continue;
      layer.inverse_depth[p] = finder.Find(novel.RayFromPixel({x + 0.5, y + 0.5}), surfaces[p]);
    }
  }
  return layer;
}

}  // namespace dtr::cpu
