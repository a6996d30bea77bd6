#include "dtr/render/hole_planes.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "dtr/base/random.h"

namespace dtr {
namespace {

constexpr int kMostPlanes = 8, kTrials = 600, kFits = 5;
constexpr double kMostSamples = 6000;
constexpr double kLeastShare = 0.01;   // of the samples, for a plane
constexpr double kCloser = 0.6;        // from one fit to the next
constexpr double kReach = 0.4;         // of the longer side, from a triple's first position
constexpr double kLeastArea = 0.0004;  // of all, of a triple's triangle

struct Sample {
  Eigen::Vector3d position;  ///< x, y, 1
  double inverse_depth;
};

std::vector<Sample> SamplesOf(const Grid<double>& inverse_depth) {
  const double count = static_cast<double>(inverse_depth.width()) * inverse_depth.height();
  const int step = std::max(1, static_cast<int>(std::ceil(std::sqrt(count / kMostSamples))));
  std::vector<Sample> samples;
  for (int y = step / 2; y < inverse_depth.height(); y += step) {
    for (int x = step / 2; x < inverse_depth.width(); x += step) {
      if (inverse_depth(x, y) > 0) samples.push_back({{x + 0.5, y + 0.5, 1}, inverse_depth(x, y)});
    }
  }
  return samples;
}

bool LiesOn(const PicturePlane& plane, const Sample& sample, double tolerance) {
  return std::abs(plane.dot(sample.position) - sample.inverse_depth) <= tolerance;
}

std::ptrdiff_t Support(const PicturePlane& plane, const std::vector<Sample>& samples,
                       double tolerance) {
  return std::count_if(samples.begin(), samples.end(),
                       [&](const Sample& sample) { return LiesOn(plane, sample, tolerance); });
}

/// Least squares over what lies on the plane already, closer and closer.
PicturePlane Fitted(PicturePlane plane, const std::vector<Sample>& samples, double tolerance) {
  for (int i = 0; i < kFits; ++i, tolerance *= kCloser) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const Sample& sample : samples) {
      if (!LiesOn(plane, sample, tolerance)) continue;
      normal += sample.position * sample.position.transpose();
      right += sample.inverse_depth * sample.position;
    }
    const PicturePlane next = normal.ldlt().solve(right);
    if (!next.allFinite()) break;
    plane = next;
  }
  return plane;
}

/// The plane of most support among those through random triples; support 0: none was found.
struct Found {
  PicturePlane plane = PicturePlane::Zero();
  std::ptrdiff_t support = 0;
};
Found BestOfTriples(const std::vector<Sample>& samples, double reach, double least_area,
                    double tolerance, Random& random) {
  Found best;
  const auto pick = [&]() -> const Sample& {
    return samples[static_cast<size_t>(random.Index(static_cast<int>(samples.size())))];
  };
  for (int trial = 0; trial < kTrials; ++trial) {
    const Sample &a = pick(), &b = pick(), &c = pick();
    if ((b.position - a.position).norm() > reach || (c.position - a.position).norm() > reach) {
      continue;
    }
    Eigen::Matrix3d positions;
    positions << a.position.transpose(), b.position.transpose(), c.position.transpose();
    if (std::abs(positions.determinant()) < 2 * least_area) continue;
    const PicturePlane plane =
        positions.inverse() * Eigen::Vector3d(a.inverse_depth, b.inverse_depth, c.inverse_depth);
    const std::ptrdiff_t support = Support(plane, samples, tolerance);
    if (support > best.support) best = {plane, support};
  }
  return best;
}

}  // namespace

std::vector<PicturePlane> FindPlanes(const Grid<double>& inverse_depth, double tolerance) {
  std::vector<Sample> samples = SamplesOf(inverse_depth);
  const auto least =
      static_cast<std::ptrdiff_t>(kLeastShare * static_cast<double>(samples.size())) + 3;
  const double reach = kReach * std::max(inverse_depth.width(), inverse_depth.height());
  const double least_area = kLeastArea * inverse_depth.width() * inverse_depth.height();
  Random random(1);
  std::vector<PicturePlane> planes;
  while (static_cast<int>(planes.size()) < kMostPlanes &&
         static_cast<std::ptrdiff_t>(samples.size()) >= least) {
    const Found best = BestOfTriples(samples, reach, least_area, tolerance, random);
    if (best.support < least) break;
    planes.push_back(Fitted(best.plane, samples, tolerance));
    // What lies near it would only give the same plane again.
    std::erase_if(samples, [&](const Sample& sample) {
      return LiesOn(planes.back(), sample, 2 * tolerance);
    });
  }
  return planes;
}

}  // namespace dtr
