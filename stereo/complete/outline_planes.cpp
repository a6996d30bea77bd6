#include "stereo/complete/outline_planes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "stereo/complete/agreement.h"

namespace dtr::stereo {
namespace {

constexpr std::array<std::array<int, 2>, 8> kAround = {
    {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {1, -1}, {-1, 1}}};
constexpr float kAreaLevels = 150;   // over the size of an area: what its border may differ more
constexpr size_t kMinCells = 25;     // of an area
constexpr size_t kMaxRim = 200;      // cells of its rim that are asked
constexpr int kNear = 2, kFar = 10;  // cells outside the rim, where the surface beyond is looked up
constexpr float kNearerPx = 2;       // cells of disparity from which on that one is in front
constexpr float kStepPx = 0.25F;     // between planes that are tried, from 2 px on
constexpr float kNearest = 2;        // of the largest measured inverse depth, at most
constexpr float kMaxSteps = 1000;    // of one normal
constexpr float kMinAsked = 0.5F;    // of the rim, for a plane
constexpr float kMuchBetter = 0.8F;  // of the mean contradiction of all planes, at most
constexpr float kSameNormal = 0.97F, kOblique = 0.05F;  // cosines: the same normal, no such plane

bool Measured(const CellView& view, int x, int y) { return view.inverse_depth(x, y) > 0; }

/// Sets of cells that grow together.
class Areas {
 public:
  explicit Areas(size_t cells) : parent_(cells), size_(cells, 1), inner_(cells, 0.0F) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  int Of(int cell) {
    while (At(parent_, cell) != cell) {
      At(parent_, cell) = At(parent_, At(parent_, cell));
      cell = At(parent_, cell);
    }
    return cell;
  }
  /// Joins them unless the difference across their border is much larger than those inside.
  void Join(int a, int b, float levels) {
    a = Of(a), b = Of(b);
    if (a == b || levels > Bound(a) || levels > Bound(b)) return;
    At(parent_, b) = a;
    At(size_, a) += At(size_, b);
    At(inner_, a) = levels;
  }

 private:
  template <typename T>
  static T& At(std::vector<T>& values, int cell) {
    return values[static_cast<size_t>(cell)];
  }
  float Bound(int area) {
    return At(inner_, area) + kAreaLevels / static_cast<float>(At(size_, area));
  }
  std::vector<int> parent_, size_;
  std::vector<float> inner_;
};

struct RimCell {
  int x, y;
  float beyond = 0;  ///< 1/z of the farthest surface measured just outside; 0 where none was
};

/// One area, and what the views say of planes for it.
struct Area {
  std::vector<std::array<int, 2>> cells;
  std::vector<RimCell> rim;
  Eigen::Vector3f middle = Eigen::Vector3f::Zero();  ///< ray, z = 1
};

class OutlineSweep {
 public:
  OutlineSweep(const CellView& view, std::span<const CellView* const> others,
               std::span<const ScenePlane> planes)
      : view_(view),
        areas_(AreasOfOneColour(view)),
        agreement_(view, others, {}, weights_),
        normals_{Eigen::Vector3f::UnitZ()} {
    const auto& w = view.inverse_depth.data();
    nearest_ = *std::max_element(w.begin(), w.end());
    for (const ScenePlane& plane : planes) {
      const Eigen::Vector3f n = (view.cam_from_world.rotation * plane.normal).cast<float>();
      const bool is_new = std::ranges::none_of(
          normals_, [&](const Eigen::Vector3f& m) { return std::abs(m.dot(n)) > kSameNormal; });
      if (is_new) normals_.push_back(n);
    }
  }

  std::vector<Area> Areas() const {
    std::vector<Area> areas(areas_.size());
    for (int y = 0; y < view_.colour.height(); ++y) {
      for (int x = 0; x < view_.colour.width(); ++x) {
        if (AreaOf(x, y) < 0) continue;
        Area& area = areas[static_cast<size_t>(AreaOf(x, y))];
        area.cells.push_back({x, y});
        area.middle += view_.RayOf(x, y);
        if (IsRim(x, y)) area.rim.push_back({x, y, Beyond(x, y)});
      }
    }
    std::erase_if(areas, [](const Area& area) { return area.cells.size() < kMinCells; });
    for (Area& area : areas) area.middle /= static_cast<float>(area.cells.size());
    return areas;
  }

  /// Empty where none stands out.
  std::optional<ViewPlane> BestPlane(const Area& area) const {
    std::optional<ViewPlane> best_plane;
    float best = 1, sum = 0, tried = 0;
    for (const Eigen::Vector3f& normal : normals_) {
      if (std::abs(normal.dot(area.middle.normalized())) < kOblique) continue;
      const float last = kNearest * nearest_;
      const float step = std::max(kStepPx * view_.pixel, last / kMaxSteps);
      for (float w = 2 * view_.pixel; w < last; w += step) {
        const ViewPlane plane = normal * (w / normal.dot(area.middle));
        const auto contradiction = Contradiction(area, plane);
        if (!contradiction) continue;
        sum += *contradiction, ++tried;
        if (*contradiction < best) best = *contradiction, best_plane = plane;
      }
    }
    if (best * tried > kMuchBetter * sum) return std::nullopt;
    return best_plane;
  }

 private:
  int AreaOf(int x, int y) const {
    return areas_[static_cast<size_t>(y) * static_cast<size_t>(view_.colour.width()) +
                  static_cast<size_t>(x)];
  }
  bool Outside(int x, int y, int area) const {
    return view_.usable.Contains(x, y) && AreaOf(x, y) != area;
  }

  bool IsRim(int x, int y) const {
    return std::any_of(kAround.begin(), kAround.begin() + 4, [&](const auto& step) {
      return Outside(x + step[0], y + step[1], AreaOf(x, y));
    });
  }

  float Beyond(int x, int y) const {
    float beyond = 0;
    const int area = AreaOf(x, y);
    for (const auto& [dx, dy] : kAround) {
      if (!Outside(x + dx, y + dy, area)) continue;
      for (int d = kNear; d <= kFar && Outside(x + d * dx, y + d * dy, area); ++d) {
        const float w = view_.inverse_depth(x + d * dx, y + d * dy);
        if (w > 0) beyond = beyond > 0 ? std::min(beyond, w) : w;
      }
    }
    return beyond;
  }

  /// Mean over the rim; empty where most of it says nothing.
  std::optional<float> Contradiction(const Area& area, const ViewPlane& plane) const {
    const size_t step = area.rim.size() / kMaxRim + 1;
    float sum = 0, count = 0, asked = 0;
    for (size_t i = 0; i < area.rim.size(); i += step, ++asked) {
      const RimCell& cell = area.rim[i];
      const float w = plane.dot(view_.RayOf(cell.x, cell.y));
      if (cell.beyond > w + kNearerPx * view_.pixel) continue;
      const auto here = w > 0 ? agreement_.ContradictionAt(cell.x, cell.y, w) : 1;
      if (here) sum += *here, ++count;
    }
    if (count < kMinAsked * asked || count == 0) return std::nullopt;
    return sum / count;
  }

  const CellView& view_;
  std::vector<int> areas_;
  AgreementWeights weights_;
  Agreement agreement_;
  std::vector<Eigen::Vector3f> normals_;  ///< before the camera
  float nearest_ = 0;
};

}  // namespace

std::vector<int> AreasOfOneColour(const CellView& view) {
  struct Border {
    float levels;
    int a, b;
  };
  const int columns = view.colour.width(), rows = view.colour.height();
  const auto open = [&](int x, int y) { return view.usable(x, y) && !Measured(view, x, y); };
  std::vector<Border> borders;
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      if (!open(x, y)) continue;
      for (const auto& [u, v] : {std::array{x + 1, y}, {x, y + 1}}) {
        if (u >= columns || v >= rows || !open(u, v)) continue;
        borders.push_back({view.Difference(x, y, u, v), y * columns + x, v * columns + u});
      }
    }
  }
  std::ranges::stable_sort(borders, {}, &Border::levels);
  Areas areas(static_cast<size_t>(columns) * static_cast<size_t>(rows));
  for (const Border& border : borders) areas.Join(border.a, border.b, border.levels);
  std::vector<int> area(static_cast<size_t>(columns) * static_cast<size_t>(rows), -1);
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      const int cell = y * columns + x;
      if (open(x, y)) area[static_cast<size_t>(cell)] = areas.Of(cell);
    }
  }
  return area;
}

Grid<float> OutlinePlanes(const CellView& view, std::span<const CellView* const> others,
                          std::span<const ScenePlane> planes) {
  Grid<float> found(view.colour.width(), view.colour.height(), 3);
  const OutlineSweep sweep(view, others, planes);
  for (const Area& area : sweep.Areas()) {
    const auto plane = sweep.BestPlane(area);
    if (!plane) continue;
    for (const auto& [x, y] : area.cells) {
      for (int c = 0; c < 3; ++c) found(x, y, c) = (*plane)[c];
    }
  }
  return found;
}

}  // namespace dtr::stereo
