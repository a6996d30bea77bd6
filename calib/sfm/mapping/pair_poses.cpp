#include "calib/sfm/mapping/pair_poses.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>

#include "calib/sfm/mapping/rotation_averaging.h"
#include "calib/sfm/mapping/so3.h"
#include "calib/sfm/matching/planar_poses.h"
#include "calib/sfm/matching/robust_fit.h"
#include "dtr/base/parallel_for.h"
#include "dtr/base/random.h"

namespace dtr::sfm {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// More matches make the fit no better where it matters: the floor of the covariance.
constexpr size_t kMaxMatches = 400;
constexpr size_t kMinMatches = 8;
constexpr int kFitIterations = 10;
constexpr double kLeastDepth = 0.05;  // of a unit ray; the plane z = 1 is for those before it

struct RayPair {
  Vector3d a, b;
};

std::vector<RayPair> RayPairsOf(const PairGeometry& pair, const Rays& rays) {
  std::vector<RayPair> of;
  const size_t count = pair.matches.size(), step = std::max<size_t>(1, count / kMaxMatches);
  for (size_t i = 0; i < count; i += step) {
    const auto& [feature_a, feature_b] = pair.matches[i];
    const Vector3d &a = rays[pair.image_a][feature_a], &b = rays[pair.image_b][feature_b];
    if (!a.isZero() && !b.isZero()) of.push_back({a, b});
  }
  return of;
}

struct RelativePose {
  Matrix3d rotation = Matrix3d::Identity();
  Vector3d translation = Vector3d::Zero();
  bool turns_only() const { return translation.squaredNorm() < 0.25; }
};

// Normal equations of both fits: a rotation (3 unknowns), or rotation and the direction of the
// translation (5).
struct Fit {
  Eigen::Matrix<double, 5, 5> h = Eigen::Matrix<double, 5, 5>::Zero();
  Eigen::Matrix<double, 5, 1> g = Eigen::Matrix<double, 5, 1>::Zero();
  double cost = 0;
};

Eigen::Matrix<double, 3, 2> TangentOf(const Vector3d& direction) {
  Eigen::Matrix<double, 3, 2> basis;
  basis.col(0) = direction.unitOrthogonal();
  basis.col(1) = direction.cross(basis.col(0));
  return basis;
}

Fit FitAt(const RelativePose& pose, const std::vector<RayPair>& rays, double scale) {
  Fit fit;
  const double scale2 = scale * scale;
  const bool turns_only = pose.turns_only();
  const auto basis = turns_only ? Eigen::Matrix<double, 3, 2>(Eigen::Matrix<double, 3, 2>::Zero())
                                : TangentOf(pose.translation);
  for (const RayPair& ray : rays) {
    const Vector3d p = pose.rotation * ray.a;
    if (turns_only) {
      const Vector3d r = p - ray.b;
      const double weight = 1 / (1 + r.squaredNorm() / scale2);
      fit.cost += scale2 * std::log1p(r.squaredNorm() / scale2);
      fit.h.topLeftCorner<3, 3>() += weight * (Matrix3d::Identity() - p * p.transpose());
      fit.g.head<3>() += weight * p.cross(r);
      continue;
    }
    const Vector3d bt = ray.b.cross(pose.translation), pt = pose.translation.cross(p);
    const double norm = std::sqrt(bt.squaredNorm() + pt.squaredNorm());
    if (norm < 1e-9) continue;
    const double r = ray.b.dot(pt) / norm;
    Eigen::Matrix<double, 5, 1> j;
    j.head<3>() = p.cross(bt) / norm;
    j.tail<2>() = basis.transpose() * p.cross(ray.b) / norm;
    const double weight = 1 / (1 + r * r / scale2);
    fit.cost += scale2 * std::log1p(r * r / scale2);
    fit.h += weight * j * j.transpose();
    fit.g += weight * r * j;
  }
  return fit;
}

RelativePose Moved(const RelativePose& pose, const Eigen::Matrix<double, 5, 1>& step) {
  RelativePose moved{Orthonormal(ExpOf(step.head<3>()) * pose.rotation), pose.translation};
  if (!pose.turns_only()) {
    moved.translation =
        (pose.translation + TangentOf(pose.translation) * step.tail<2>()).normalized();
  }
  return moved;
}

// Levenberg-Marquardt; the matrix at the end gives the covariance.
Fit Refine(RelativePose* pose, const std::vector<RayPair>& rays, double scale) {
  Fit fit = FitAt(*pose, rays, scale);
  double lambda = 1e-4;
  for (int i = 0; i < kFitIterations; ++i) {
    Eigen::Matrix<double, 5, 5> damped = fit.h;
    damped.diagonal() += lambda * fit.h.diagonal();
    damped.diagonal().array() += 1e-9 * static_cast<double>(rays.size());
    const Eigen::Matrix<double, 5, 1> step = -damped.ldlt().solve(fit.g);
    const RelativePose moved = Moved(*pose, step);
    const Fit next = FitAt(moved, rays, scale);
    if (!(next.cost < fit.cost)) {
      lambda *= 10;
      if (lambda > 1e3) break;
      continue;
    }
    const bool settled = fit.cost - next.cost < 1e-5 * fit.cost;
    *pose = moved;
    fit = next;
    lambda = std::max(lambda / 10, 1e-9);
    if (settled) break;
  }
  return fit;
}

// Whether a point lies before both cameras. Of nearly parallel rays neither is known, but at least
// they have the same direction.
bool InFront(const RelativePose& pose, const RayPair& ray, double sigma) {
  const Vector3d turned = pose.rotation * ray.a;
  if (turned.cross(ray.b).norm() < 3 * sigma) return turned.dot(ray.b) > 0;
  return (DepthsOf(pose.rotation, pose.translation, ray.a, ray.b).array() > 0).all();
}

// The relative pose whose points lie in front of both cameras, by the five-point algorithm.
std::optional<RelativePose> FivePoint(const std::vector<RayPair>& rays, double sigma) {
  std::vector<cv::Point2d> a, b;  // on the plane z = 1
  for (const RayPair& ray : rays) {
    if (!(ray.a.z() > kLeastDepth && ray.b.z() > kLeastDepth)) continue;
    a.emplace_back(ray.a.x() / ray.a.z(), ray.a.y() / ray.a.z());
    b.emplace_back(ray.b.x() / ray.b.z(), ray.b.y() / ray.b.z());
  }
  if (a.size() < kMinMatches) return std::nullopt;
  const cv::Mat found =
      cv::findEssentialMat(a, b, cv::Mat::eye(3, 3, CV_64F), cv::RANSAC, 0.999, 2 * sigma);
  if (found.rows < 3 || found.cols != 3) return std::nullopt;
  Matrix3d essential;
  for (int i = 0; i < 9; ++i) essential(i / 3, i % 3) = found.at<double>(i / 3, i % 3);
  if (!essential.allFinite()) return std::nullopt;
  const Eigen::JacobiSVD<Matrix3d> svd(essential, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Matrix3d u = svd.matrixU(), v = svd.matrixV();
  if (u.determinant() < 0) u.col(2) *= -1;
  if (v.determinant() < 0) v.col(2) *= -1;
  Matrix3d w;
  w << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  RelativePose best;
  size_t best_in_front = 0;
  for (const Matrix3d& r :
       {Matrix3d(u * w * v.transpose()), Matrix3d(u * w.transpose() * v.transpose())}) {
    for (const double sign : {1.0, -1.0}) {
      const RelativePose pose{r, sign * u.col(2)};
      size_t in_front = 0;
      for (const RayPair& ray : rays) in_front += InFront(pose, ray, sigma) ? 1 : 0;
      if (in_front > best_in_front) {
        best_in_front = in_front;
        best = pose;
      }
    }
  }
  // Half of the points before the cameras is what chance gives.
  if (10 * best_in_front < 6 * rays.size()) return std::nullopt;
  return best;
}

// The pose that fits the matches best, from a start.
std::optional<MatchedPose> FittedTo(const std::vector<RayPair>& matched, RelativePose pose,
                                    double sigma) {
  const Fit fit = Refine(&pose, matched, 2 * sigma);
  const double per_match = fit.cost / static_cast<double>(matched.size());
  const double variance = std::max(per_match, sigma * sigma);
  // Nothing is less certain than half a radian; so the matrix has an inverse, too.
  Eigen::Matrix<double, 5, 5> information = fit.h / variance;
  information.diagonal().array() += 4;
  const MatchedPose fitted{pose.rotation, pose.translation,
                           information.inverse().topLeftCorner<3, 3>()};
  if (!fitted.covariance.allFinite() || !fitted.b_from_a.allFinite()) return std::nullopt;
  return fitted;
}

double AngleBetween(const Matrix3d& a, const Matrix3d& b) {
  return LogOf(a * b.transpose()).norm();
}

// The other pose of the plane that explains half of the matches and more.
std::optional<MatchedPose> TwinOf(const MatchedPose& pose, const std::vector<RayPair>& matched,
                                  double sigma, int index) {
  constexpr double kLeastShare = 0.5;
  constexpr double kBandSigmas = 3;
  matching::PointPairs points;
  for (const RayPair& ray : matched) {
    if (ray.a.z() > kLeastDepth && ray.b.z() > kLeastDepth) {
      points.Add(ray.a.hnormalized(), ray.b.hnormalized());
    }
  }
  const auto plane = matching::FitHomography(points, kBandSigmas * sigma,
                                             HashOf(static_cast<std::uint64_t>(index)));
  const auto least = kLeastShare * static_cast<double>(matched.size());
  if (!plane || static_cast<double>(plane->inliers.size()) < least) return std::nullopt;
  matching::PointPairs on_plane;
  for (const int i : plane->inliers) {
    on_plane.Add(points.a[static_cast<size_t>(i)], points.b[static_cast<size_t>(i)]);
  }
  const auto both = matching::PosesOfPlane(plane->m, on_plane);
  if (!both) return std::nullopt;
  const bool first_is_other =
      AngleBetween((*both)[0].r, pose.b_from_a) > AngleBetween((*both)[1].r, pose.b_from_a);
  const matching::RelativePose& other = (*both)[first_is_other ? 0 : 1];
  auto twin = FittedTo(matched, {other.r, other.t}, sigma);
  // Poses that the certainty of pairs does not tell apart are one.
  if (!twin || AngleBetween(twin->b_from_a, pose.b_from_a) < 2 * kRotationFloorRad) {
    return std::nullopt;
  }
  return twin;
}

std::optional<RelativeRotation> RotationOf(const PairGeometry& pair, int index, const Rays& rays,
                                           double sigma) {
  const std::vector<RayPair> matched = RayPairsOf(pair, rays);
  if (matched.size() < kMinMatches) return std::nullopt;
  RelativePose pose{pair.b_rotation_a, pair.b_translation_a};
  const bool is_rotation = pose.rotation.allFinite() && pose.translation.allFinite() &&
                           std::abs(pose.rotation.determinant() - 1) < 0.01;
  if (pair.kind == PairKind::kUncalibrated || !is_rotation) {
    const auto start = FivePoint(matched, sigma);
    if (!start) return std::nullopt;
    pose = *start;
  } else if (pair.kind == PairKind::kRotation || pose.turns_only()) {
    pose.translation.setZero();
  } else {
    pose.translation.normalize();
  }
  const auto fitted = FittedTo(matched, pose, sigma);
  if (!fitted) return std::nullopt;
  RelativeRotation rotation{
      {*fitted}, index, pair.image_a, pair.image_b, static_cast<int>(pair.matches.size())};
  if (!pose.turns_only()) rotation.twin = TwinOf(rotation, matched, sigma, index);
  return rotation;
}

}  // namespace

double EpipolarAngle(const Matrix3d& b_from_a, const Vector3d& b_translation_a,
                     const Vector3d& ray_a, const Vector3d& ray_b) {
  const Vector3d pt = b_translation_a.cross(b_from_a * ray_a), bt = ray_b.cross(b_translation_a);
  const double norm = std::sqrt(pt.squaredNorm() + bt.squaredNorm());
  return norm > 0 ? ray_b.dot(pt) / norm : 0;
}

Vector2d DepthsOf(const Matrix3d& b_from_a, const Vector3d& b_translation_a, const Vector3d& ray_a,
                  const Vector3d& ray_b) {
  // depth_b ray_b = depth_a p + t; the cross product with either ray leaves one unknown.
  const Vector3d p = b_from_a * ray_a, normal = ray_b.cross(p);
  const double n2 = std::max(normal.squaredNorm(), 1e-300);
  return {-ray_b.cross(b_translation_a).dot(normal) / n2,
          b_translation_a.cross(p).dot(normal) / n2};
}

Rays RaysOf(const ViewGraph& graph, std::span<const calib::LensCamera> cameras) {
  const int images = static_cast<int>(graph.images.size());
  std::vector<std::vector<char>> matched(graph.images.size());
  for (int i = 0; i < images; ++i) matched[i].resize(graph.images[i].pixels.size());
  for (const PairGeometry& pair : graph.pairs) {
    for (const auto& [a, b] : pair.matches) matched[pair.image_a][a] = matched[pair.image_b][b] = 1;
  }
  Rays rays(graph.images.size());
  ParallelFor(0, images, [&](int i) {
    const GraphImage& image = graph.images[i];
    rays[i].assign(image.pixels.size(), Vector3d::Zero());
    for (size_t f = 0; f < image.pixels.size(); ++f) {
      if (!matched[i][f]) continue;
      if (const auto ray = cameras[image.camera].RayFromPixel(image.pixels[f])) rays[i][f] = *ray;
    }
  });
  return rays;
}

std::vector<std::optional<RelativeRotation>> RelativeRotationsOf(const ViewGraph& graph,
                                                                 const Rays& rays,
                                                                 std::span<const double> sigma_rad,
                                                                 const Progress* progress) {
  std::vector<std::optional<RelativeRotation>> of(graph.pairs.size());
  ParallelFor(0, static_cast<int>(graph.pairs.size()), [&](int i) {
    if (progress != nullptr) progress->ThrowIfInterrupted();
    const PairGeometry& pair = graph.pairs[i];
    of[i] = RotationOf(pair, i, rays, std::max(sigma_rad[pair.image_a], sigma_rad[pair.image_b]));
  });
  return of;
}

}  // namespace dtr::sfm
