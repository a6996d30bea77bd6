// tests/calib/sfm/mapping/synthetic_graph.h -- graphs of exact scenes, with noise, wrong matches
// and wrong pairs.
#pragma once
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "calib/sfm/view_graph.h"
#include "calib/sfm_model.h"
#include "dtr/base/random.h"
#include "dtr/types/pose.h"

namespace dtr::sfm::testing {

/// A surface point; seen from where its normal points to (0: from everywhere).
struct ScenePoint {
  Eigen::Vector3d p = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
};

struct Scene {
  std::vector<calib::LensCamera> lenses;
  std::vector<int> lens_of;  ///< per image; empty: the first
  std::vector<Pose> cam_from_world;
  std::vector<ScenePoint> points;
  size_t images() const { return cam_from_world.size(); }
  int Lens(size_t image) const { return lens_of.empty() ? 0 : lens_of[image]; }
};

struct GraphSpec {
  double noise_px = 0.4;
  double match_share = 0.7;     ///< of what two photos have in common
  double outlier_share = 0.03;  ///< of matches
  PairKind kind = PairKind::kCalibrated;
  int min_matches = 15;
  double min_facing = 0.25;  ///< cosine of a surface's normal and the direction it is seen from
};

inline calib::LensCamera Lens(double focal_px = 700, double k1 = 0) {
  return {calib::CameraModel::kRadial, 960, 640, {focal_px, 480, 320, k1, 0}};
}

inline Pose LookAt(const Eigen::Vector3d& centre, const Eigen::Vector3d& target) {
  const Eigen::Vector3d z = (target - centre).normalized();
  const Eigen::Vector3d x = Eigen::Vector3d(0, 1, 0).cross(z).normalized();
  Eigen::Matrix3d rotation;
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  Pose pose;
  pose.rotation = Eigen::Quaterniond(rotation).normalized();
  pose.translation = -(pose.rotation * centre);
  return pose;
}

/// Photos and features: feature k of an image shows point `shows[image][k]`.
struct Seen {
  ViewGraph graph;
  std::vector<std::vector<int>> shows;
};

inline Seen Photograph(const Scene& scene, const GraphSpec& spec, Random* random) {
  Seen seen;
  seen.graph.cameras = scene.lenses;
  seen.graph.focal_is_known.assign(scene.lenses.size(), true);
  for (size_t i = 0; i < scene.images(); ++i) {
    const calib::LensCamera& lens = scene.lenses[scene.Lens(i)];
    GraphImage image{"p" + std::to_string(1000 + i) + ".jpg", scene.Lens(i), {}};
    seen.shows.emplace_back();
    const Eigen::Vector3d centre = scene.cam_from_world[i].TargetOriginInSource();
    for (size_t p = 0; p < scene.points.size(); ++p) {
      const ScenePoint& point = scene.points[p];
      const Eigen::Vector3d towards = (centre - point.p).normalized();
      if (!point.normal.isZero() && point.normal.dot(towards) < spec.min_facing) continue;
      const auto pixel = lens.PixelFromCam(scene.cam_from_world[i] * point.p);
      if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() > lens.width_px ||
          pixel->y() > lens.height_px) {
        continue;
      }
      const double dx = random->Normal(), dy = random->Normal();
      image.pixels.push_back(*pixel + spec.noise_px * Eigen::Vector2d(dx, dy));
      seen.shows.back().push_back(static_cast<int>(p));
    }
    seen.graph.images.push_back(std::move(image));
  }
  return seen;
}

inline PairGeometry Pair(int a, int b, PairKind kind = PairKind::kCalibrated) {
  PairGeometry pair;
  pair.image_a = a;
  pair.image_b = b;
  pair.kind = kind;
  return pair;
}

/// The pair (a, b) as if image b stood at `b_from_a` and its features showed points `of_b`.
inline PairGeometry MatchPair(const Seen& seen, int a, int b, const std::vector<int>& of_b,
                              const Pose& b_from_a, const GraphSpec& spec, Random* random) {
  PairGeometry pair = Pair(a, b, spec.kind);
  pair.b_rotation_a = b_from_a.rotation.toRotationMatrix();
  pair.b_translation_a = b_from_a.translation;
  if (pair.b_translation_a.norm() > 1e-9) pair.b_translation_a.normalize();
  const std::vector<int>& of_a = seen.shows[a];
  std::vector<int> feature_of;
  for (size_t k = 0; k < of_b.size(); ++k) {
    if (of_b[k] < 0) continue;
    feature_of.resize(std::max(feature_of.size(), static_cast<size_t>(of_b[k]) + 1), -1);
    feature_of[of_b[k]] = static_cast<int>(k);
  }
  for (size_t k = 0; k < of_a.size(); ++k) {
    const bool in_b = of_a[k] < static_cast<int>(feature_of.size()) && feature_of[of_a[k]] >= 0;
    if (!in_b || random->Uniform() > spec.match_share) continue;
    int feature = feature_of[of_a[k]];
    if (random->Uniform() < spec.outlier_share)
      feature = random->Index(static_cast<int>(of_b.size()));
    pair.matches.emplace_back(static_cast<std::uint32_t>(k), static_cast<std::uint32_t>(feature));
  }
  if (spec.kind == PairKind::kRotation) pair.b_translation_a.setZero();
  return pair;
}

inline void SortPairs(ViewGraph* graph) {
  std::sort(graph->pairs.begin(), graph->pairs.end(), [](const auto& x, const auto& y) {
    return std::pair(x.image_a, x.image_b) < std::pair(y.image_a, y.image_b);
  });
}

/// All pairs with enough in common.
inline Seen GraphOf(const Scene& scene, const GraphSpec& spec = {}, std::uint64_t seed = 1) {
  Random random(seed);
  Seen seen = Photograph(scene, spec, &random);
  const int images = static_cast<int>(scene.images());
  for (int a = 0; a < images; ++a) {
    for (int b = a + 1; b < images; ++b) {
      PairGeometry pair =
          MatchPair(seen, a, b, seen.shows[b],
                    scene.cam_from_world[b] * scene.cam_from_world[a].Inverse(), spec, &random);
      if (static_cast<int>(pair.matches.size()) >= spec.min_matches) {
        seen.graph.pairs.push_back(std::move(pair));
      }
    }
  }
  return seen;
}

/// Points on a ball of radius 2 about the origin, with normals.
inline std::vector<ScenePoint> Ball(int count, std::uint64_t seed = 3) {
  Random random(seed);
  std::vector<ScenePoint> points;
  for (int i = 0; i < count; ++i) {
    const double x = random.Normal(), y = random.Normal();
    const Eigen::Vector3d n = Eigen::Vector3d(x, y, random.Normal()).normalized();
    points.push_back({random.Uniform(1.4, 2) * n, n});
  }
  return points;
}

/// Points of a box given by its corners, without normals.
inline std::vector<ScenePoint> Box(int count, const Eigen::Vector3d& low,
                                   const Eigen::Vector3d& high, std::uint64_t seed = 4) {
  Random random(seed);
  std::vector<ScenePoint> points;
  for (int i = 0; i < count; ++i) {
    const double x = random.Uniform(low.x(), high.x()), y = random.Uniform(low.y(), high.y());
    points.push_back({{x, y, random.Uniform(low.z(), high.z())}, Eigen::Vector3d::Zero()});
  }
  return points;
}

inline Scene Ring(int images, int points = 900) {
  Scene scene{{Lens()}, {}, {}, Ball(points)};
  for (int i = 0; i < images; ++i) {
    const double a = 2 * std::numbers::pi * i / images;
    scene.cam_from_world.push_back(
        LookAt({4.6 * std::cos(a), 0.6 * std::sin(3 * a), 4.6 * std::sin(a)}, {0, 0, 0}));
  }
  return scene;
}

/// Against the truth, after the similarity that aligns rotations first, which a straight path
/// determines too.
struct MapErrors {
  double position_share = 0;  ///< RMS, of the cameras' RMS distance from their mean
  double rotation_deg = 0;    ///< median
};

inline MapErrors Compare(const calib::SfmModel& model, const Scene& scene) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  std::vector<Eigen::Vector3d> found, truth;
  for (const calib::SfmImage& image : model.images) {
    const Pose& exact = scene.cam_from_world[image.id - 1];
    sum += (exact.rotation.conjugate() * image.cam_from_world.rotation).toRotationMatrix();
    found.push_back(image.cam_from_world.TargetOriginInSource());
    truth.push_back(exact.TargetOriginInSource());
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d turn = svd.matrixU() * svd.matrixV().transpose();
  if (turn.determinant() < 0) turn = -turn;
  const auto count = static_cast<double>(found.size());
  Eigen::Vector3d mean_found = Eigen::Vector3d::Zero(), mean_truth = mean_found;
  for (size_t i = 0; i < found.size(); ++i) {
    mean_found += turn * found[i] / count;
    mean_truth += truth[i] / count;
  }
  double cross = 0, square = 0, spread = 0, error = 0;
  for (size_t i = 0; i < found.size(); ++i) {
    const Eigen::Vector3d f = turn * found[i] - mean_found, t = truth[i] - mean_truth;
    cross += f.dot(t);
    square += f.squaredNorm();
    spread += t.squaredNorm();
  }
  std::vector<double> angles;
  for (size_t i = 0; i < found.size(); ++i) {
    const Eigen::Vector3d f = turn * found[i] - mean_found, t = truth[i] - mean_truth;
    error += (cross / square * f - t).squaredNorm();
    const Pose& exact = scene.cam_from_world[model.images[i].id - 1];
    const Eigen::Matrix3d r = model.images[i].cam_from_world.rotation.toRotationMatrix();
    angles.push_back(
        Eigen::AngleAxisd(exact.rotation.toRotationMatrix() * turn * r.transpose()).angle() * 180 /
        std::numbers::pi);
  }
  std::sort(angles.begin(), angles.end());
  return {std::sqrt(error / spread), angles[angles.size() / 2]};
}

}  // namespace dtr::sfm::testing
