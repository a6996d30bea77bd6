#include "stereo/complete/label_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <utility>
#include <vector>

namespace dtr::stereo {
namespace {

constexpr int kDirections = 8;
constexpr std::array<std::array<int, 2>, kDirections> kSteps = {
    {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {1, -1}, {-1, 1}}};
// Which candidate is which. A measured cell has one alone, its own plane, in the place of far.
constexpr int kFirstDirection = 1, kFirstCarried = kFirstDirection + kDirections;
constexpr int kCarried = 2, kByColour = kFirstCarried + kCarried, kByOutline = kByColour + 1;
constexpr int kFirstScenePlane = kByOutline + 1;
static_assert(kFirstScenePlane == kOwnLabels);
constexpr float kSamePx = 2;  // cells of disparity: the same surface
constexpr int kInset = 1;     // cells from a rim, where planes are taken from
/// Difference of colour, levels, at which a step between neighbouring cells is twice as long; the
/// addition grows with its square.
constexpr float kLevelsPerCell = 6;

/// Candidates of every cell: a plane each, and what it costs.
class Candidates {
 public:
  Candidates(int columns, int rows, int labels)
      : labels_(labels),
        columns_(columns),
        planes_(static_cast<size_t>(columns) * rows * labels, ViewPlane::Constant(kNone)),
        costs_(static_cast<size_t>(columns) * rows * labels, kNever) {}
  static constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  static constexpr float kNever = 1e6F;
  int labels() const { return labels_; }
  ViewPlane* PlanesOf(int x, int y) { return &planes_[At(x, y)]; }
  const ViewPlane* PlanesOf(int x, int y) const { return &planes_[At(x, y)]; }
  float* CostsOf(int x, int y) { return &costs_[At(x, y)]; }
  const float* CostsOf(int x, int y) const { return &costs_[At(x, y)]; }

 private:
  size_t At(int x, int y) const {
    return (static_cast<size_t>(y) * static_cast<size_t>(columns_) + static_cast<size_t>(x)) *
           static_cast<size_t>(labels_);
  }
  int labels_, columns_;
  std::vector<ViewPlane> planes_;
  std::vector<float> costs_;
};

std::vector<const Grid<float>*> PlanesOf(std::span<const CompletedCells* const> completed) {
  std::vector<const Grid<float>*> planes;
  for (const CompletedCells* cells : completed) planes.push_back(&cells->planes);
  return planes;
}

class Labelling {
 public:
  Labelling(const CellView& view, std::span<const CellView* const> others,
            std::span<const CompletedCells* const> completed, std::span<const ScenePlane> planes,
            const Grid<float>& by_outline, const LabelWeights& weights)
      : view_(view),
        weights_(weights),
        others_(others),
        completed_(completed),
        columns_(view.colour.width()),
        rows_(view.colour.height()),
        agreement_(view, others, PlanesOf(completed), weights.agreement),
        candidates_(columns_, rows_, kFirstScenePlane + static_cast<int>(planes.size())) {
    AddOwnOrFar();
    AddDirections();
    AddCarried();
    AddNearestByColour();
    AddByOutline(by_outline);
    AddScenePlanes(planes);
    SetCosts();
  }

  CompletedCells Solve() {
    std::vector<float> sums(SumsAt(0, rows_), 0.0F);
    for (int y = 0; y < rows_; ++y) {
      Follow(0, y, 1, 0, columns_, sums);
      Follow(columns_ - 1, y, -1, 0, columns_, sums);
    }
    for (int x = 0; x < columns_; ++x) {
      Follow(x, 0, 0, 1, rows_, sums);
      Follow(x, rows_ - 1, 0, -1, rows_, sums);
    }
    CompletedCells found{Grid<float>(columns_, rows_, 3)};
    for (int y = 0; y < rows_; ++y) {
      for (int x = 0; x < columns_; ++x) {
        const float* s = &sums[SumsAt(x, y)];
        const auto best = Measured(x, y) ? 0 : std::min_element(s, s + candidates_.labels()) - s;
        ViewPlane plane = candidates_.PlanesOf(x, y)[best];
        if (!plane.allFinite()) plane.setZero();
        for (int c = 0; c < 3; ++c) found.planes(x, y, c) = plane[c];
      }
    }
    return found;
  }

 private:
  bool Measured(int x, int y) const { return view_.inverse_depth(x, y) > 0; }
  Eigen::Vector3f Ray(int x, int y) const { return view_.RayOf(x, y); }

  void AddOwnOrFar() {
    for (int y = 0; y < rows_; ++y) {
      for (int x = 0; x < columns_; ++x) {
        candidates_.PlanesOf(x, y)[0] =
            Measured(x, y) ? view_.PlaneAt(x, y) : ViewPlane(ViewPlane::Zero());
      }
    }
  }

  /// Of the nearest measured cell in each direction.
  void AddDirections() {
    for (int k = 0; k < kDirections; ++k) {
      const int dx = kSteps[static_cast<size_t>(k)][0], dy = kSteps[static_cast<size_t>(k)][1];
      Grid<float> carried(columns_, rows_, 3, Candidates::kNone);
      // From the side that `dx, dy` points away from.
      for (int j = 0; j < rows_; ++j) {
        const int y = dy > 0 ? j : rows_ - 1 - j;
        for (int i = 0; i < columns_; ++i) {
          const int x = dx > 0 ? i : columns_ - 1 - i;
          ViewPlane plane = ViewPlane::Constant(Candidates::kNone);
          if (Measured(x, y)) {
            plane = PlaneBehindRim(x, y, dx, dy);
          } else if (carried.Contains(x - dx, y - dy)) {
            for (int c = 0; c < 3; ++c) plane[c] = carried(x - dx, y - dy, c);
          }
          for (int c = 0; c < 3; ++c) carried(x, y, c) = plane[c];
          if (!Measured(x, y)) candidates_.PlanesOf(x, y)[kFirstDirection + k] = plane;
        }
      }
    }
  }

  /// That of the measured cell a little further back, where it is the same surface: at rims depths
  /// are the least sure.
  ViewPlane PlaneBehindRim(int x, int y, int dx, int dy) const {
    const int px = x - kInset * dx, py = y - kInset * dy;
    const bool inside = view_.inverse_depth.Contains(px, py) && Measured(px, py) &&
                        std::abs(view_.PlaneAt(px, py).dot(Ray(x, y)) - view_.inverse_depth(x, y)) <
                            kSamePx * view_.pixel;
    return inside ? view_.PlaneAt(px, py) : view_.PlaneAt(x, y);
  }

  /// The nearest surfaces that neighbours have where this view has none.
  void AddCarried() {
    Grid<float> depths(columns_, rows_, kCarried);
    for (size_t o = 0; o < others_.size(); ++o) {
      const CellView& cells = *others_[o];
      const Pose view_from_other = view_.cam_from_world * cells.cam_from_world.Inverse();
      for (int v = 0; v < cells.colour.height(); ++v) {
        for (int u = 0; u < cells.colour.width(); ++u) {
          const bool measured = cells.inverse_depth(u, v) > 0;
          if (!measured && completed_.empty()) continue;
          const ViewPlane there = measured ? cells.PlaneAt(u, v) : completed_[o]->PlaneAt(u, v);
          Carry(there, cells.RayOf(u, v), view_from_other, depths);
        }
      }
    }
  }

  /// The point of a neighbour's plane on its ray, to where this view would see it. `depths`: 1/z of
  /// what was carried there so far, the nearest first.
  void Carry(const ViewPlane& there, const Eigen::Vector3f& ray, const Pose& view_from_other,
             Grid<float>& depths) {
    const float w = there.dot(ray);
    if (!(w > 0)) return;
    const Eigen::Vector3d p = view_from_other * (ray / w).cast<double>();
    const auto at = view_.camera.PixelFromCam(p);
    if (!at || !view_.camera.Contains(*at)) return;
    const int x = static_cast<int>(at->x()), y = static_cast<int>(at->y());
    if (Measured(x, y)) return;
    const auto plane = PlaneInOther(there, view_from_other);
    if (!plane) return;
    const auto here = static_cast<float>(1 / p.z());
    const float near = depths(x, y, 0), second = depths(x, y, 1);
    ViewPlane* slots = candidates_.PlanesOf(x, y) + kFirstCarried;
    if (here > near + kSamePx * view_.pixel) {
      depths(x, y, 1) = near, slots[1] = slots[0];
      depths(x, y, 0) = here, slots[0] = *plane;
    } else if (here < near - kSamePx * view_.pixel && here > second) {
      depths(x, y, 1) = here, slots[1] = *plane;
    }
  }

  /// Adds the plane of the measured cell at the smallest geodesic distance, in which edges of the
  /// image are long steps: a surface without texture continues to its outline, whatever its shape.
  void AddNearestByColour() {
    using Path = std::pair<float, std::array<int, 4>>;  // length; y, x of its end and of its start
    std::priority_queue<Path, std::vector<Path>, std::greater<>> paths;
    Grid<std::uint8_t> reached(columns_, rows_);
    for (int y = 0; y < rows_; ++y) {
      for (int x = 0; x < columns_; ++x) {
        if (Measured(x, y)) paths.push({0.0F, {y, x, y, x}});
      }
    }
    while (!paths.empty()) {
      const auto [length, cells] = paths.top();
      paths.pop();
      const auto [y, x, from_y, from_x] = cells;
      if (reached(x, y) != 0) continue;
      reached(x, y) = 1;
      if (!Measured(x, y)) candidates_.PlanesOf(x, y)[kByColour] = view_.PlaneAt(from_x, from_y);
      for (int k = 0; k < 4; ++k) {
        const int u = x + kSteps[static_cast<size_t>(k)][0],
                  v = y + kSteps[static_cast<size_t>(k)][1];
        if (!reached.Contains(u, v) || reached(u, v) != 0 || Measured(u, v)) continue;
        const float levels = view_.Difference(x, y, u, v) / kLevelsPerCell;
        paths.push({length + 1 + levels * levels, {v, u, from_y, from_x}});
      }
    }
  }

  void AddByOutline(const Grid<float>& planes) {
    for (int y = 0; y < rows_; ++y) {
      for (int x = 0; x < columns_; ++x) {
        const ViewPlane plane(planes(x, y, 0), planes(x, y, 1), planes(x, y, 2));
        if (!Measured(x, y) && !plane.isZero()) candidates_.PlanesOf(x, y)[kByOutline] = plane;
      }
    }
  }

  void AddScenePlanes(std::span<const ScenePlane> planes) {
    int label = kFirstScenePlane;
    for (const ScenePlane& plane : planes) {
      const auto before = plane.Before(view_.cam_from_world);
      for (int y = 0; before && y < rows_; ++y) {
        for (int x = 0; x < columns_; ++x) {
          if (!Measured(x, y)) candidates_.PlanesOf(x, y)[label] = *before;
        }
      }
      ++label;
    }
  }

  void SetCosts() {
    for (int y = 0; y < rows_; ++y) {
      for (int x = 0; x < columns_; ++x) {
        float* costs = candidates_.CostsOf(x, y);
        if (Measured(x, y)) {
          costs[0] = 0;
          continue;
        }
        const ViewPlane* planes = candidates_.PlanesOf(x, y);
        const Eigen::Vector3f ray = Ray(x, y);
        for (int k = 0; k < candidates_.labels(); ++k) {
          const float w = planes[k].dot(ray);
          if (k == 0) {
            costs[k] = agreement_.CostAt(x, y, 0) + weights_.far;
          } else if (w > 0) {
            costs[k] = agreement_.CostAt(x, y, w);
          }
        }
      }
    }
  }

  float JumpBetween(int x, int y, int u, int v) const {
    return weights_.jump * std::exp(-view_.Difference(x, y, u, v) / weights_.edge_levels);
  }

  /// Semi-global matching along one path (Hirschmueller 2008, eq. 13), where a change costs by how
  /// far the two planes are apart.
  void Follow(int x, int y, int dx, int dy, int count, std::vector<float>& sums) const {
    const auto labels = static_cast<size_t>(candidates_.labels());
    std::vector<float> before(labels), now(labels), w_before(labels);
    for (int i = 0; i < count; ++i, x += dx, y += dy) {
      if (Measured(x, y)) {
        std::fill(now.begin(), now.end(), Candidates::kNever);
        now[0] = 0;
      } else {
        const float* costs = candidates_.CostsOf(x, y);
        std::copy(costs, costs + labels, now.begin());
        if (i > 0) Arrive(x, y, x - dx, y - dy, before, w_before, now);
        float* sum = &sums[SumsAt(x, y)];
        for (size_t k = 0; k < labels; ++k) sum[k] += now[k];
      }
      std::swap(before, now);
    }
  }

  /// Adds to the costs of a cell's labels what it costs to come there from the cell before.
  void Arrive(int x, int y, int from_x, int from_y, const std::vector<float>& before,
              std::vector<float>& w_before, std::vector<float>& now) const {
    const size_t labels = now.size();
    const Eigen::Vector3f ray = Ray(x, y);
    const ViewPlane *planes = candidates_.PlanesOf(x, y),
                    *last = candidates_.PlanesOf(from_x, from_y);
    for (size_t j = 0; j < labels; ++j) {
      w_before[j] = before[j] < Candidates::kNever ? last[j].dot(ray) : 0;
    }
    const float jump = JumpBetween(x, y, from_x, from_y);
    const float per_w = jump / (weights_.jump_px * view_.pixel);
    const float least = *std::min_element(before.begin(), before.end());
    for (size_t k = 0; k < labels; ++k) {
      if (now[k] >= Candidates::kNever) continue;
      const float w = planes[k].dot(ray);
      float cheapest = least + jump;
      for (size_t j = 0; j < labels; ++j) {
        cheapest = std::min(cheapest, before[j] + per_w * std::abs(w - w_before[j]));
      }
      now[k] += cheapest - least;
    }
  }

  size_t SumsAt(int x, int y) const {
    return (static_cast<size_t>(y) * static_cast<size_t>(columns_) + static_cast<size_t>(x)) *
           static_cast<size_t>(candidates_.labels());
  }

  const CellView& view_;
  const LabelWeights& weights_;
  std::span<const CellView* const> others_;
  std::span<const CompletedCells* const> completed_;
  const int columns_, rows_;
  const Agreement agreement_;
  Candidates candidates_;
};

}  // namespace

CompletedCells LabelCells(const CellView& view, std::span<const CellView* const> others,
                          std::span<const CompletedCells* const> completed,
                          std::span<const ScenePlane> planes, const Grid<float>& by_outline,
                          const LabelWeights& weights) {
  return Labelling(view, others, completed, planes, by_outline, weights).Solve();
}

}  // namespace dtr::stereo
