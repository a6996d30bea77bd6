#include "dtr/render/hole_planes.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "dtr/base/random.h"
#include "dtr/render/plane_support.h"

namespace dtr {
namespace {

constexpr int kMaxPlanes = 8, kTrials = 600, kFits = 5, kDraws = 8;
constexpr double kMaxSamples = 6000;
constexpr double kMinShare = 0.01;   // of the samples, for a plane
constexpr double kCloser = 0.6;      // from one fit to the next
constexpr double kReach = 0.4;       // of the longer side, from a triple's first position
constexpr double kMinArea = 0.0004;  // of all, of a triple's triangle

/// Samples, and where each lies among all positions that may have one.
struct PlacedSamples : PlaneSamples {
  std::vector<int> positions;  ///< of the samples
  std::vector<int> sample_at;  ///< by position; -1: none

  void Add(double sample_x, double sample_y, double w, int position) {
    sample_at[static_cast<size_t>(position)] = static_cast<int>(x.size());
    x.push_back(sample_x);
    y.push_back(sample_y);
    inverse_depth.push_back(w);
    positions.push_back(position);
  }
};

PlacedSamples SamplesOf(const Grid<double>& inverse_depth) {
  const double count = static_cast<double>(inverse_depth.width()) * inverse_depth.height();
  const int step = std::max(1, static_cast<int>(std::ceil(std::sqrt(count / kMaxSamples))));
  PlacedSamples samples;
  for (int y = step / 2; y < inverse_depth.height(); y += step) {
    for (int x = step / 2; x < inverse_depth.width(); x += step) {
      const auto position = static_cast<int>(samples.sample_at.size());
      samples.sample_at.push_back(-1);
      if (inverse_depth(x, y) > 0) samples.Add(x + 0.5, y + 0.5, inverse_depth(x, y), position);
    }
  }
  return samples;
}

Eigen::Vector3d PositionOf(const PlaneSamples& samples, size_t i) {
  return {samples.x[i], samples.y[i], 1};
}

bool LiesOn(const ImagePlane& plane, const PlaneSamples& samples, size_t i, double tolerance) {
  return std::abs(plane.dot(PositionOf(samples, i)) - samples.inverse_depth[i]) <= tolerance;
}

/// What does not lie within `tolerance` of the plane.
PlacedSamples Without(const ImagePlane& plane, const PlacedSamples& samples, double tolerance) {
  PlacedSamples left;
  left.sample_at.assign(samples.sample_at.size(), -1);
  for (size_t i = 0; i < samples.size(); ++i) {
    if (LiesOn(plane, samples, i, tolerance)) continue;
    left.Add(samples.x[i], samples.y[i], samples.inverse_depth[i], samples.positions[i]);
  }
  return left;
}

/// Least squares over what lies on the plane already, closer and closer.
ImagePlane Fitted(ImagePlane plane, const PlaneSamples& samples, double tolerance) {
  for (int i = 0; i < kFits; ++i, tolerance *= kCloser) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (size_t k = 0; k < samples.size(); ++k) {
      if (!LiesOn(plane, samples, k, tolerance)) continue;
      const Eigen::Vector3d position = PositionOf(samples, k);
      normal += position * position.transpose();
      right += samples.inverse_depth[k] * position;
    }
    const ImagePlane next = normal.ldlt().solve(right);
    if (!next.allFinite()) break;
    plane = next;
  }
  return plane;
}

/// The plane of most support among those through random triples; support 0: none was found.
struct Found {
  ImagePlane plane = ImagePlane::Zero();
  size_t support = 0;
};
Found BestOfTriples(const PlacedSamples& samples, double reach, double min_area, double tolerance,
                    Random& random) {
  Found best;
  // Positions are drawn, not numbers of samples, and as many whatever is there: one sample more or
  // less, as two renderers may have it, changes no other draw.
  const auto pick = [&]() -> int {
    int found = -1;
    for (int draw = 0; draw < kDraws; ++draw) {
      const int position = random.Index(static_cast<int>(samples.sample_at.size()));
      if (found < 0) found = samples.sample_at[static_cast<size_t>(position)];
    }
    return found;
  };
  for (int trial = 0; trial < kTrials; ++trial) {
    const int picked[3] = {pick(), pick(), pick()};
    if (*std::min_element(picked, picked + 3) < 0) continue;
    const auto i = static_cast<size_t>(picked[0]), j = static_cast<size_t>(picked[1]),
               k = static_cast<size_t>(picked[2]);
    const Eigen::Vector3d a = PositionOf(samples, i), b = PositionOf(samples, j),
                          c = PositionOf(samples, k);
    if ((b - a).norm() > reach || (c - a).norm() > reach) continue;
    Eigen::Matrix3d positions;
    positions << a.transpose(), b.transpose(), c.transpose();
    if (std::abs(positions.determinant()) < 2 * min_area) continue;
    const std::vector<double>& w = samples.inverse_depth;
    const ImagePlane plane = positions.inverse() * Eigen::Vector3d(w[i], w[j], w[k]);
    const size_t support = PlaneSupport(samples, plane.x(), plane.y(), plane.z(), tolerance);
    if (support > best.support) best = {plane, support};
  }
  return best;
}

}  // namespace

std::vector<ImagePlane> FindPlanes(const Grid<double>& inverse_depth, double tolerance) {
  PlacedSamples samples = SamplesOf(inverse_depth);
  const auto least = static_cast<size_t>(kMinShare * static_cast<double>(samples.size())) + 3;
  const double reach = kReach * std::max(inverse_depth.width(), inverse_depth.height());
  const double min_area = kMinArea * inverse_depth.width() * inverse_depth.height();
  Random random(1);
  std::vector<ImagePlane> planes;
  while (static_cast<int>(planes.size()) < kMaxPlanes && samples.size() >= least) {
    const Found best = BestOfTriples(samples, reach, min_area, tolerance, random);
    if (best.support < least) break;
    planes.push_back(Fitted(best.plane, samples, tolerance));
    // What lies near it would only give the same plane again.
    samples = Without(planes.back(), samples, 2 * tolerance);
  }
  return planes;
}

}  // namespace dtr
