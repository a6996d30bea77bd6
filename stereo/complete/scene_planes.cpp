#include "stereo/complete/scene_planes.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "dtr/base/parallel_for.h"
#include "dtr/base/random.h"

namespace dtr::stereo {
namespace {

constexpr size_t kMaxSamples = 40000;
constexpr int kTrials = 400, kFits = 3;
constexpr double kWithinPx = 1;      // of disparity, from the plane, in cells
constexpr double kMinCosine = 0.8;   // between normals
constexpr double kMinShare = 0.004;  // of the samples, for a plane

struct Sample {
  Eigen::Vector3d point, normal;
  double tolerance;  ///< distance that is kWithinPx
};

std::vector<Sample> SamplesOf(std::span<const CellView> views) {
  size_t measured = 0;
  for (const CellView& view : views) {
    for (const float w : view.inverse_depth.data()) measured += w > 0;
  }
  const size_t step = measured / kMaxSamples + 1;
  std::vector<Sample> samples;
  size_t at = 0;
  for (const CellView& view : views) {
    const Pose world_from_cam = view.cam_from_world.Inverse();
    for (int y = 0; y < view.inverse_depth.height(); ++y) {
      for (int x = 0; x < view.inverse_depth.width(); ++x) {
        const float w = view.inverse_depth(x, y);
        if (!(w > 0) || HashBits(at++) % step != 0) continue;
        const Eigen::Vector3d ray = view.RayOf(x, y).cast<double>();
        const double z = 1 / static_cast<double>(w);
        const Eigen::Vector3d normal = view.PlaneAt(x, y).cast<double>();
        if (!(normal.norm() > 0)) continue;
        // A step of inverse depth moves a point along its ray; across the plane, by the cosine.
        const Eigen::Vector3d unit = normal.normalized();
        const double along = kWithinPx * static_cast<double>(view.pixel) * z * z;
        samples.push_back({world_from_cam * (ray * z), world_from_cam.rotation * unit,
                           along * std::abs(unit.dot(ray))});
      }
    }
  }
  return samples;
}

bool LiesOn(const ScenePlane& plane, const Sample& sample) {
  return std::abs(plane.normal.dot(sample.point) - plane.offset) <= sample.tolerance &&
         std::abs(plane.normal.dot(sample.normal)) >= kMinCosine;
}

double SupportOf(const ScenePlane& plane, const std::vector<Sample>& samples) {
  double support = 0;
  for (const Sample& sample : samples) support += LiesOn(plane, sample);
  return support;
}

ScenePlane Fitted(ScenePlane plane, const std::vector<Sample>& samples) {
  for (int fit = 0; fit < kFits; ++fit) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    double weights = 0;
    const auto weight = [](const Sample& s) { return 1 / (s.tolerance * s.tolerance); };
    for (const Sample& s : samples) {
      if (LiesOn(plane, s)) mean += weight(s) * s.point, weights += weight(s);
    }
    if (!(weights > 0)) return plane;
    mean /= weights;
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const Sample& s : samples) {
      if (!LiesOn(plane, s)) continue;
      const Eigen::Vector3d off = s.point - mean;
      spread += weight(s) / weights * off * off.transpose();
    }
    const Eigen::Vector3d normal =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(0);
    if (!normal.allFinite()) return plane;
    plane = {normal, normal.dot(mean)};
  }
  return plane;
}

}  // namespace

std::optional<ViewPlane> ScenePlane::Before(const Pose& cam_from_world) const {
  const Eigen::Vector3d turned = cam_from_world.rotation * normal;
  const double distance = offset + turned.dot(cam_from_world.translation);
  const ViewPlane plane = (turned / distance).cast<float>();
  if (!plane.allFinite()) return std::nullopt;
  return plane;
}

std::vector<ScenePlane> FindScenePlanes(std::span<const CellView> views, int most) {
  std::vector<Sample> samples = SamplesOf(views);
  const double least = kMinShare * static_cast<double>(samples.size()) + 3;
  std::vector<ScenePlane> planes;
  for (int k = 0; k < most; ++k) {
    if (static_cast<double>(samples.size()) <= least) break;
    std::vector<ScenePlane> tried(kTrials);
    std::vector<double> support(kTrials);
    ParallelFor(0, kTrials, [&](int trial) {
      const auto t = static_cast<size_t>(trial);
      const Sample& s = samples[HashOf(1, static_cast<std::uint64_t>(k), t) % samples.size()];
      tried[t] = {s.normal, s.normal.dot(s.point)};
      support[t] = SupportOf(tried[t], samples);
    });
    const auto best = std::max_element(support.begin(), support.end()) - support.begin();
    const ScenePlane plane = Fitted(tried[static_cast<size_t>(best)], samples);
    const size_t before = samples.size();
    std::erase_if(samples, [&](const Sample& s) { return LiesOn(plane, s); });
    if (static_cast<double>(before - samples.size()) < least) break;
    planes.push_back(plane);
  }
  return planes;
}

}  // namespace dtr::stereo
