#include "calib/sfm/mapping/points.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/models/lens_formula.h"
#include "dtr/base/order_statistics.h"
#include "dtr/base/parallel_for.h"

namespace dtr::sfm {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kMaxHypotheses = 24;
constexpr int kChunk = 256;

struct WorldRay {
  Vector3d centre, direction;
};

// The point nearest to the rays in angle: squared distances over squared depths, reweighted.
std::optional<Vector3d> Nearest(const std::vector<WorldRay>& rays, const std::vector<int>& chosen) {
  Vector3d point = Vector3d::Zero();
  for (int iteration = 0; iteration < 3; ++iteration) {
    Matrix3d a = Matrix3d::Zero();
    Vector3d b = Vector3d::Zero();
    for (const int i : chosen) {
      const Vector3d& v = rays[i].direction;
      const double depth2 = iteration == 0 ? 1 : (point - rays[i].centre).squaredNorm();
      const Matrix3d m = (Matrix3d::Identity() - v * v.transpose()) / std::max(depth2, 1e-12);
      a += m;
      b += m * rays[i].centre;
    }
    point = a.ldlt().solve(b);
    if (!point.allFinite()) return std::nullopt;
  }
  return point;
}

struct Agreement {
  std::vector<int> agree;
  double sum_px = 0;
};

// What one track needs again and again.
class TrackFit {
 public:
  TrackFit(const ViewGraph& graph, const MapCameras& cameras, const Track& track, double max_error)
      : graph_(graph), cameras_(cameras), max_error_(max_error) {
    for (const TrackFeature& f : track) {
      const Vector3d& ray = cameras.rays[f.image][f.feature];
      if (!cameras.placed[f.image] || ray.isZero()) continue;
      const Pose& pose = cameras.cam_from_world[f.image];
      seen_.push_back(f);
      rays_.push_back({pose.TargetOriginInSource(), pose.rotation.conjugate() * ray});
    }
  }

  std::optional<MapPoint> Fit() const {
    if (seen_.size() < 2) return std::nullopt;
    std::vector<int> all(seen_.size());
    for (size_t i = 0; i < all.size(); ++i) all[i] = static_cast<int>(i);
    auto point = Nearest(rays_, all);
    Agreement best;
    if (point) best = AgreementOf(*point);
    if (best.agree.size() < seen_.size() && seen_.size() > 2) {
      const Agreement consensus = Consensus();
      if (consensus.agree.size() > best.agree.size()) best = consensus;
    }
    if (best.agree.size() < 2) return std::nullopt;
    if (best.agree.size() < seen_.size()) {
      point = Nearest(rays_, best.agree);
      if (!point) return std::nullopt;
      best = AgreementOf(*point);
      if (best.agree.size() < 2) return std::nullopt;
    }
    MapPoint found{*point, 0, {}};
    for (const int i : best.agree) found.seen.push_back(seen_[i]);
    return found;
  }

 private:
  Agreement AgreementOf(const Vector3d& point) const {
    Agreement of;
    for (size_t i = 0; i < seen_.size(); ++i) {
      const double error = ReprojectionErrorPx(graph_, cameras_, seen_[i], point);
      const int camera = graph_.images[seen_[i].image].camera;
      if (!(error <= LimitPx(max_error_, cameras_.lenses[camera]))) continue;
      of.agree.push_back(static_cast<int>(i));
      of.sum_px += error;
    }
    return of;
  }

  // Pairs of rays in a fixed order, the far ones first.
  Agreement Consensus() const {
    Agreement best;
    const auto count = static_cast<int>(seen_.size());
    int tried = 0;
    for (int gap = count - 1; gap > 0 && tried < kMaxHypotheses; --gap) {
      for (int i = 0; i + gap < count && tried < kMaxHypotheses; ++i, ++tried) {
        const auto point = Nearest(rays_, {i, i + gap});
        if (!point) continue;
        Agreement of = AgreementOf(*point);
        const bool more = of.agree.size() > best.agree.size();
        if (more || (of.agree.size() == best.agree.size() && of.sum_px < best.sum_px)) {
          best = std::move(of);
        }
      }
    }
    return best;
  }

  const ViewGraph& graph_;
  const MapCameras& cameras_;
  double max_error_;
  Track seen_;
  std::vector<WorldRay> rays_;
};

}  // namespace

double LimitPx(double per_1000_px, const calib::LensCamera& lens) {
  return per_1000_px * std::max(1.0, std::max(lens.width_px, lens.height_px) / 1000.0);
}

double ReprojectionErrorPx(const ViewGraph& graph, const MapCameras& cameras,
                           const TrackFeature& feature, const Vector3d& p_in_world) {
  const GraphImage& image = graph.images[feature.image];
  const calib::LensCamera& lens = cameras.lenses[image.camera];
  const Vector3d p_in_cam = cameras.cam_from_world[feature.image] * p_in_world;
  Eigen::Vector2d pixel;
  if (!calib::FormulaOf(lens.model, lens.params.data()).Project(p_in_cam.data(), pixel.data())) {
    return std::numeric_limits<double>::infinity();
  }
  const double error = (pixel - image.pixels[feature.feature]).norm();
  return std::isfinite(error) ? error : std::numeric_limits<double>::infinity();
}

double LargestAngle(const MapCameras& cameras, const Track& seen, const Vector3d& p_in_world) {
  std::vector<Vector3d> rays;
  for (const TrackFeature& f : seen) {
    const Vector3d centre = cameras.cam_from_world[f.image].TargetOriginInSource();
    rays.push_back((p_in_world - centre).normalized());
  }
  double smallest = 1;
  for (size_t i = 0; i < rays.size(); ++i) {
    for (size_t k = i + 1; k < rays.size(); ++k)
      smallest = std::min(smallest, rays[i].dot(rays[k]));
  }
  return std::acos(std::max(-1.0, smallest));
}

std::vector<MapPoint> PointsOf(const ViewGraph& graph, const MapCameras& cameras,
                               std::span<const Track> tracks, std::span<const int> chosen,
                               const PointOptions& options) {
  std::vector<std::optional<MapPoint>> found(chosen.size());
  const auto count = static_cast<int>(chosen.size());
  ParallelFor(0, (count + kChunk - 1) / kChunk, [&](int chunk) {
    for (int i = chunk * kChunk; i < std::min(count, (chunk + 1) * kChunk); ++i) {
      found[i] = TrackFit(graph, cameras, tracks[chosen[i]], options.max_error).Fit();
      if (!found[i]) continue;
      found[i]->track = chosen[i];
      if (LargestAngle(cameras, found[i]->seen, found[i]->p_in_world) < options.min_angle_rad) {
        found[i].reset();
      }
    }
  });
  std::vector<MapPoint> points;
  for (auto& point : found) {
    if (point) points.push_back(std::move(*point));
  }
  return points;
}

void FilterPoints(const ViewGraph& graph, const MapCameras& cameras, const PointOptions& options,
                  std::vector<MapPoint>* points) {
  for (MapPoint& point : *points) {
    std::erase_if(point.seen, [&](const TrackFeature& f) {
      const calib::LensCamera& lens = cameras.lenses[graph.images[f.image].camera];
      return !cameras.placed[f.image] ||
             !(ReprojectionErrorPx(graph, cameras, f, point.p_in_world) <=
               LimitPx(options.max_error, lens));
    });
  }
  std::erase_if(*points, [&](const MapPoint& point) {
    return point.seen.size() < 2 ||
           LargestAngle(cameras, point.seen, point.p_in_world) < options.min_angle_rad;
  });
}

void DropOutliers(const ViewGraph& graph, const MapCameras& cameras,
                  std::vector<MapPoint>* points) {
  constexpr double kMedians = 4.25, kLeastPx = 1;
  std::vector<std::vector<double>> errors(graph.images.size());
  for (const MapPoint& point : *points) {
    for (const TrackFeature& f : point.seen) {
      errors[f.image].push_back(ReprojectionErrorPx(graph, cameras, f, point.p_in_world));
    }
  }
  std::vector<double> limits_px;
  for (size_t i = 0; i < errors.size(); ++i) {
    const double least_px = LimitPx(kLeastPx, cameras.lenses[graph.images[i].camera]);
    limits_px.push_back(errors[i].empty() ? least_px
                                          : std::max(least_px, kMedians * UpperMedian(errors[i])));
  }
  for (MapPoint& point : *points) {
    std::erase_if(point.seen, [&](const TrackFeature& f) {
      return !(ReprojectionErrorPx(graph, cameras, f, point.p_in_world) <= limits_px[f.image]);
    });
  }
  std::erase_if(*points, [](const MapPoint& point) { return point.seen.size() < 2; });
}

calib::Bundle BundleOfMap(const ViewGraph& graph, const MapCameras& cameras,
                          std::span<const MapPoint> points, std::vector<int>* image_of) {
  calib::Bundle bundle;
  bundle.lenses = cameras.lenses;
  image_of->clear();
  std::vector<int> index(graph.images.size(), -1);
  for (size_t i = 0; i < graph.images.size(); ++i) {
    if (!cameras.placed[i]) continue;
    index[i] = static_cast<int>(image_of->size());
    image_of->push_back(static_cast<int>(i));
    bundle.images.push_back(
        {graph.images[i].name, graph.images[i].camera, cameras.cam_from_world[i]});
  }
  for (const MapPoint& point : points) {
    for (const TrackFeature& f : point.seen) {
      bundle.observations.push_back({index[f.image], static_cast<int>(bundle.points.size()),
                                     graph.images[f.image].pixels[f.feature]});
    }
    bundle.points.push_back(point.p_in_world.homogeneous());
  }
  return bundle;
}

void TakeFromBundle(const calib::Bundle& bundle, std::span<const int> image_of, MapCameras* cameras,
                    std::vector<MapPoint>* points) {
  cameras->lenses = bundle.lenses;
  for (size_t i = 0; i < image_of.size(); ++i) {
    cameras->cam_from_world[image_of[i]] = bundle.images[i].cam_from_world;
  }
  for (size_t p = 0; p < points->size(); ++p) {
    (*points)[p].p_in_world = bundle.points[p].hnormalized();
  }
}

std::vector<int> PointCounts(size_t images, std::span<const MapPoint> points) {
  std::vector<int> counts(images);
  for (const MapPoint& point : points) {
    for (const TrackFeature& f : point.seen) ++counts[f.image];
  }
  return counts;
}

}  // namespace dtr::sfm
