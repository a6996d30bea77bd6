#include "stereo/neighbours.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "stereo/scene_index.h"

namespace dtr::stereo {
namespace {

using Eigen::Vector3d;

/// A view with fewer observations, or a pair with fewer shared points, is not evaluated by them.
constexpr size_t kMinObservations = 12;
constexpr size_t kMinShared = 4;
/// Best triangulation angle for rectified matching of block windows, and how fast it gets worse.
/// MVSNet has 5 deg with widths 1 and 10; a wider rise serves dense captures of a few degrees.
constexpr double kBestAngleDeg = 7.0;
constexpr double kSmallAngleWidthDeg = 4.0;
constexpr double kLargeAngleWidthDeg = 10.0;
/// Centres seen from the points under a smaller angle than this count as one centre: half of a
/// baseline of 1e-4 of the depth, of which the longest lenses still make a pixel of disparity.
constexpr double kSameCentreAngleDeg = 0.003;
/// Without any points: rays on this grid, at depths these multiples of the guessed distance.
constexpr int kRayGrid = 8;
constexpr double kDepthMultiples[] = {0.6, 1.0, 2.0};
/// Parallel viewing directions have no common point; guess this many median camera spacings.
constexpr double kSpacingsToScene = 10.0;

double Degrees(double rad) { return rad * 180.0 / std::numbers::pi; }

double AngleWeight(double angle_deg) {
  const double width = angle_deg < kBestAngleDeg ? kSmallAngleWidthDeg : kLargeAngleWidthDeg;
  const double off = (angle_deg - kBestAngleDeg) / width;
  return std::exp(-0.5 * off * off);
}

struct PairScore {
  double score = 0;
  double median_angle_deg = 0;
};

/// Scores a pair on points both views (are taken to) see. Empty when there are too few.
std::optional<PairScore> ScorePair(const StereoView& a, const StereoView& b,
                                   const std::vector<Vector3d>& points) {
  const Vector3d centre_a = a.cam_from_world.TargetOriginInSource();
  const Vector3d centre_b = b.cam_from_world.TargetOriginInSource();
  std::vector<double> angles_deg;
  double score = 0;
  for (const Vector3d& p : points) {
    const auto pixel_b = b.camera.PixelFromCam(b.cam_from_world * p);
    if (!pixel_b || !b.camera.Contains(*pixel_b)) continue;
    const Vector3d to_a = centre_a - p, to_b = centre_b - p;
    const double angle_deg = Degrees(std::atan2(to_a.cross(to_b).norm(), to_a.dot(to_b)));
    const double scale_a = a.camera.fx_px() / to_a.norm();
    const double scale_b = b.camera.fx_px() / to_b.norm();
    const double ratio = std::min(scale_a, scale_b) / std::max(scale_a, scale_b);
    score += AngleWeight(angle_deg) * ratio * ratio;
    angles_deg.push_back(angle_deg);
  }
  if (angles_deg.size() < kMinShared) return std::nullopt;
  return PairScore{score, Quantile(std::move(angles_deg), 0.5)};
}

double MedianSpacing(std::span<const StereoView> views) {
  std::vector<double> nearest;
  for (size_t i = 0; i < views.size(); ++i) {
    double best = std::numeric_limits<double>::infinity();
    for (size_t j = 0; j < views.size(); ++j) {
      const double distance = (views[i].cam_from_world.TargetOriginInSource() -
                               views[j].cam_from_world.TargetOriginInSource())
                                  .norm();
      if (j != i && distance > 0) best = std::min(best, distance);
    }
    if (std::isfinite(best)) nearest.push_back(best);
  }
  return nearest.empty() ? 1.0 : Quantile(std::move(nearest), 0.5);
}

/// Depth in `view` of the point nearest to all optical axes (least squares); empty where the axes
/// are so parallel that the point is badly determined, or behind the view.
std::optional<double> ConvergenceDepth(const StereoView& view, std::span<const StereoView> views) {
  constexpr double kParallel = 1e-3;  // smallest over largest eigenvalue: axes within ~2 deg
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Vector3d right = Vector3d::Zero();
  const Vector3d origin = view.cam_from_world.TargetOriginInSource();
  for (const StereoView& v : views) {
    const Vector3d axis = v.cam_from_world.rotation.conjugate() * Vector3d::UnitZ();
    const Eigen::Matrix3d off_axis = Eigen::Matrix3d::Identity() - axis * axis.transpose();
    normal += off_axis;
    right += off_axis * (v.cam_from_world.TargetOriginInSource() - origin);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(normal);
  if (eigen.eigenvalues()(0) < kParallel * eigen.eigenvalues()(2)) return std::nullopt;
  const Vector3d from_centre = normal.ldlt().solve(right);
  const double z = (view.cam_from_world.rotation * from_centre).z();
  return z > 0 ? std::optional(z) : std::nullopt;
}

/// Points that stand in for observations: of the scene where it has any in sight, else invented.
std::vector<Vector3d> StandInPoints(const StereoView& view, std::span<const StereoView> views,
                                    const SparseScene& scene) {
  std::vector<Vector3d> points;
  for (const int i : PointsInFrustum(view, scene)) {
    points.push_back(scene.points[static_cast<size_t>(i)].p_in_world);
  }
  if (points.size() >= kMinObservations) return points;
  points.clear();
  const double depth =
      ConvergenceDepth(view, views).value_or(kSpacingsToScene * MedianSpacing(views));
  const Pose world_from_cam = view.cam_from_world.Inverse();
  for (const double multiple : kDepthMultiples) {
    for (int j = 0; j < kRayGrid; ++j) {
      for (int i = 0; i < kRayGrid; ++i) {
        const Eigen::Vector2d pixel((i + 0.5) / kRayGrid * view.camera.width_px(),
                                    (j + 0.5) / kRayGrid * view.camera.height_px());
        points.push_back(world_from_cam *
                         view.camera.CamFromPixel(pixel, multiple * depth, DepthKind::kPlaneZ));
      }
    }
  }
  return points;
}

/// Points observed by both; all of a's where b has too few observations to tell.
std::vector<Vector3d> SharedPoints(const SparseScene& scene, const std::vector<int>& a,
                                   const std::vector<int>& b) {
  std::vector<int> shared;
  if (b.size() < kMinObservations) {
    shared = a;
  } else {
    std::set_intersection(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(shared));
  }
  std::vector<Vector3d> points;
  points.reserve(shared.size());
  for (const int i : shared) points.push_back(scene.points[static_cast<size_t>(i)].p_in_world);
  return points;
}

/// (-score, index): sorts best first, then by index.
using Ranking = std::vector<std::pair<double, int>>;

std::vector<int> Best(Ranking ranking, int count) {
  std::sort(ranking.begin(), ranking.end());
  std::vector<int> best;
  for (const auto& [score, view] : ranking) {
    if (static_cast<int>(best.size()) >= count) break;
    best.push_back(view);
  }
  return best;
}

}  // namespace

std::vector<ViewNeighbours> ChooseNeighbours(std::span<const StereoView> views,
                                             const SparseScene& scene,
                                             const NeighbourOptions& options) {
  const std::vector<std::vector<int>> observed = PointsOfViews(scene, views.size());
  std::vector<ViewNeighbours> result(views.size());
  for (size_t a = 0; a < views.size(); ++a) {
    const bool by_points = observed[a].size() >= kMinObservations;
    result[a].evidence =
        by_points ? NeighbourEvidence::kSharedPoints : NeighbourEvidence::kGeometry;
    const std::vector<Vector3d> stand_in =
        by_points ? std::vector<Vector3d>{} : StandInPoints(views[a], views, scene);
    Ranking wide, narrow;
    for (size_t b = 0; b < views.size(); ++b) {
      if (b == a) continue;
      const auto score = ScorePair(
          views[a], views[b], by_points ? SharedPoints(scene, observed[a], observed[b]) : stand_in);
      result[a].strangers += !score;
      if (!score || score->median_angle_deg < kSameCentreAngleDeg) continue;
      if (score->median_angle_deg >= options.min_angle_deg) {
        wide.emplace_back(-score->score, static_cast<int>(b));
      } else {
        narrow.emplace_back(-score->score * score->median_angle_deg, static_cast<int>(b));
      }
    }
    result[a].views = Best(wide.empty() ? std::move(narrow) : std::move(wide), options.count);
  }
  return result;
}

}  // namespace dtr::stereo
