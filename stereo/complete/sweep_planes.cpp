// SweepScenePlanes of scene_planes.h.
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "dtr/base/parallel_for.h"
#include "dtr/base/random.h"
#include "stereo/complete/agreement.h"
#include "stereo/complete/scene_planes.h"

namespace dtr::stereo {
namespace {

constexpr size_t kMaxPlaces = 6000;
constexpr size_t kNormals = 3;  // known ones, beside the level one
constexpr int kOffsets = 160;
constexpr double kNearestShare = 20;    // of the nearest measured surface's inverse depth, at most
constexpr float kUnexplained = 12;      // levels: cost of a place that no plane explains
constexpr float kMinContrast = 2;       // levels, between neighbouring cells
constexpr double kMinExplained = 0.02;  // of the places, for a plane
constexpr int kRefinements = 8;
constexpr double kFirstTurn = 0.02, kFirstShift = 0.02;  // radians, of the offset
constexpr double kCloser = 0.7;                          // from one refinement to the next
constexpr double kParallel = 0.97, kUpright = 0.3;       // cosines, between normals
constexpr double kHeldLevel = 0.05;  // of a wall's say, for how the cameras are held

/// A cell without depth.
struct Place {
  size_t view;
  int x, y;
};

/// Where cells next to each other differ: elsewhere every plane agrees.
bool HasTexture(const CellView& view, int x, int y) {
  float most = 0;
  for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
    if (!view.usable.Contains(x + dx, y + dy) || !view.usable(x + dx, y + dy)) continue;
    most = std::max(most, view.Difference(x, y, x + dx, y + dy));
  }
  return most >= kMinContrast;
}

class Sweep {
 public:
  Sweep(std::span<const Neighbourhood> views) : views_(views) {
    for (const Neighbourhood& around : views) {
      agreements_.emplace_back(*around.view, around.others, std::span<const Grid<float>* const>(),
                               weights_);
    }
    weights_.no_view = kUnexplained, weights_.one_view = kUnexplained;
    std::vector<Place> all;
    for (size_t v = 0; v < views.size(); ++v) {
      const CellView& view = *views[v].view;
      for (int y = 0; y < view.usable.height(); ++y) {
        for (int x = 0; x < view.usable.width(); ++x) {
          if (view.usable(x, y) && !(view.inverse_depth(x, y) > 0) && HasTexture(view, x, y)) {
            all.push_back({v, x, y});
          }
        }
      }
    }
    const size_t step = all.size() / kMaxPlaces + 1;
    for (size_t i = 0; i < all.size(); ++i) {
      if (HashBits(i) % step == 0) places_.push_back(all[i]);
    }
    unexplained_.assign(places_.size(), kUnexplained);
  }

  size_t places() const { return places_.size(); }

  /// By how much the plane lowers the costs of all places.
  double GainOf(const ScenePlane& plane) const {
    std::vector<std::optional<ViewPlane>> before;
    for (const Neighbourhood& around : views_) {
      before.push_back(plane.Before(around.view->cam_from_world));
    }
    double gain = 0;
    for (size_t i = 0; i < places_.size(); ++i) {
      const Place& p = places_[i];
      if (before[p.view]) gain += std::max(0.0F, unexplained_[i] - CostAt(p, *before[p.view]));
    }
    return gain;
  }

  void Explain(const ScenePlane& plane) {
    for (size_t i = 0; i < places_.size(); ++i) {
      const auto before = plane.Before(views_[places_[i].view].view->cam_from_world);
      if (before) unexplained_[i] = std::min(unexplained_[i], CostAt(places_[i], *before));
    }
  }

  /// The plane of most gain, and that.
  std::pair<ScenePlane, double> Best(const std::vector<ScenePlane>& planes) const {
    std::vector<double> gains(planes.size());
    ParallelFor(0, static_cast<int>(planes.size()), [&](int i) {
      gains[static_cast<size_t>(i)] = GainOf(planes[static_cast<size_t>(i)]);
    });
    const auto best = std::max_element(gains.begin(), gains.end()) - gains.begin();
    return {planes[static_cast<size_t>(best)], gains[static_cast<size_t>(best)]};
  }

 private:
  float CostAt(const Place& p, const ViewPlane& plane) const {
    const CellView& view = *views_[p.view].view;
    const float w = plane.dot(view.RayOf(p.x, p.y));
    return w > 0 ? agreements_[p.view].CostAt(p.x, p.y, w) : kUnexplained;
  }

  std::span<const Neighbourhood> views_;
  AgreementWeights weights_;
  std::vector<Agreement> agreements_;
  std::vector<Place> places_;
  std::vector<float> unexplained_;
};

/// Upwards, as cameras are held, and across the walls among the known planes.
Eigen::Vector3d LevelNormal(std::span<const Neighbourhood> views,
                            std::span<const ScenePlane> known) {
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (const Neighbourhood& around : views) {
    up -= around.view->cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitY();
  }
  up.normalize();
  Eigen::Matrix3d walls = kHeldLevel * (Eigen::Matrix3d::Identity() - up * up.transpose());
  for (const ScenePlane& plane : known) {
    if (std::abs(plane.normal.dot(up)) < kUpright) walls += plane.normal * plane.normal.transpose();
  }
  const Eigen::Vector3d level =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(walls).eigenvectors().col(0);
  return level.dot(up) < 0 ? Eigen::Vector3d(-level) : level;
}

/// Offsets at even steps of inverse distance from the cameras' middle, to either side.
std::vector<ScenePlane> Parallel(const Eigen::Vector3d& normal,
                                 std::span<const Neighbourhood> views) {
  double middle = 0;
  float nearest = 0;
  for (const Neighbourhood& around : views) {
    middle += normal.dot(around.view->cam_from_world.TargetOriginInSource()) /
              static_cast<double>(views.size());
    const auto& w = around.view->inverse_depth.data();
    nearest = std::max(nearest, *std::max_element(w.begin(), w.end()));
  }
  std::vector<ScenePlane> planes;
  if (!(nearest > 0)) return planes;
  for (int k = 1; k <= kOffsets; ++k) {
    const double distance = kOffsets / (k * kNearestShare * static_cast<double>(nearest));
    for (const double side : {-1.0, 1.0}) planes.push_back({normal, middle + side * distance});
  }
  return planes;
}

/// Turned and shifted to where it gains most, closer and closer; and its gain.
std::pair<ScenePlane, double> Refined(const Sweep& sweep, ScenePlane plane) {
  double turn = kFirstTurn, shift = kFirstShift * std::abs(plane.offset), gain = 0;
  for (int step = 0; step < kRefinements; ++step, turn *= kCloser, shift *= kCloser) {
    const Eigen::Vector3d u = plane.normal.unitOrthogonal(), v = plane.normal.cross(u);
    const Eigen::Vector3d anchor = plane.normal * plane.offset;
    std::vector<ScenePlane> around = {plane};
    for (const double sign : {-1.0, 1.0}) {
      for (const Eigen::Vector3d& axis : {u, v}) {
        const Eigen::Vector3d normal = (plane.normal + sign * turn * axis).normalized();
        around.push_back({normal, normal.dot(anchor)});
      }
      around.push_back({plane.normal, plane.offset + sign * shift});
    }
    std::tie(plane, gain) = sweep.Best(around);
  }
  return {plane, gain};
}

}  // namespace

std::vector<ScenePlane> SweepScenePlanes(std::span<const Neighbourhood> views,
                                         std::span<const ScenePlane> known, int most) {
  Sweep sweep(views);
  if (sweep.places() == 0) return {};
  std::vector<Eigen::Vector3d> normals = {LevelNormal(views, known)};
  for (const ScenePlane& plane : known) {
    const bool is_new = std::none_of(normals.begin(), normals.end(), [&](const auto& n) {
      return std::abs(n.dot(plane.normal)) > kParallel;
    });
    if (is_new && normals.size() <= kNormals) normals.push_back(plane.normal);
  }
  std::vector<ScenePlane> tried;
  for (const Eigen::Vector3d& normal : normals) {
    const auto parallel = Parallel(normal, views);
    tried.insert(tried.end(), parallel.begin(), parallel.end());
  }
  std::vector<ScenePlane> found;
  for (int k = 0; k < most && !tried.empty(); ++k) {
    const auto [best, gain] = Refined(sweep, sweep.Best(tried).first);
    if (gain < kMinExplained * kUnexplained * static_cast<double>(sweep.places())) break;
    sweep.Explain(best);
    found.push_back(best);
  }
  return found;
}

}  // namespace dtr::stereo
