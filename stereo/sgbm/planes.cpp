#include "stereo/sgbm/planes.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "dtr/base/random.h"

namespace dtr::stereo {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Draws per plane. A plane of 4 % of the pixels, whose three samples lie near each other and so on
/// the same plane half of the time, is met by 400 draws with probability 1 - (1 - 0.01)^400 = 98 %.
constexpr int kDraws = 400;
/// The second and third sample lie within this share of the image's width of the first.
constexpr double kSampleReach = 0.15;
constexpr int kRefits = 3;
/// Pixels this many times the tolerance from a plane found are not offered again.
constexpr double kRemoveFactor = 2.0;

struct Pixel {
  int x, y;
  Vector3d ray;
  double inverse_depth;
  double tolerance;
};

std::vector<Pixel> PixelsWithDepth(const DepthImage& depth, const PinholeCamera& camera,
                                   const Vector3d& steps) {
  std::vector<Pixel> pixels;
  for (int y = 0; y < depth.height(); ++y) {
    for (int x = 0; x < depth.width(); ++x) {
      if (DepthImage::IsHole(depth(x, y))) continue;
      const Vector3d ray = camera.RayFromPixel({x + 0.5, y + 0.5});
      pixels.push_back({x, y, ray, 1.0 / depth(x, y), steps.dot(ray)});
    }
  }
  return pixels;
}

bool On(const Pixel& p, const Vector3d& n, double factor = 1.0) {
  return std::abs(n.dot(p.ray) - p.inverse_depth) <= factor * p.tolerance;
}

int Support(const std::vector<Pixel>& pixels, const Vector3d& n) {
  return static_cast<int>(
      std::count_if(pixels.begin(), pixels.end(), [&](const Pixel& p) { return On(p, n); }));
}

Vector3d FitToInliers(const std::vector<Pixel>& pixels, const Vector3d& n) {
  Matrix3d normal = Matrix3d::Zero();
  Vector3d right = Vector3d::Zero();
  for (const Pixel& p : pixels) {
    if (!On(p, n)) continue;
    const double weight = 1.0 / (p.tolerance * p.tolerance);
    normal += weight * p.ray * p.ray.transpose();
    right += weight * p.inverse_depth * p.ray;
  }
  const Vector3d fitted = normal.ldlt().solve(right);
  return fitted.allFinite() ? fitted : n;
}

Vector3d BestDraw(const std::vector<Pixel>& pixels, int width, Random* random) {
  const int reach = std::max(2, static_cast<int>(kSampleReach * width));
  Vector3d best = Vector3d::Zero();
  int best_support = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    std::array<const Pixel*, 3> sample{};
    Matrix3d rays;
    Vector3d inverse_depths;
    bool near = true;
    for (int k = 0; k < 3; ++k) {
      // Pixels are in rows: a neighbour in the list some rows away is a neighbour in the image.
      const Pixel* p = &pixels[static_cast<size_t>(random->Index(static_cast<int>(pixels.size())))];
      for (int retry = 0; k > 0 && retry < 20; ++retry) {
        if (std::max(std::abs(p->x - sample[0]->x), std::abs(p->y - sample[0]->y)) <= reach) break;
        p = &pixels[static_cast<size_t>(random->Index(static_cast<int>(pixels.size())))];
      }
      near = near && (k == 0 || (std::abs(p->x - sample[0]->x) <= reach &&
                                 std::abs(p->y - sample[0]->y) <= reach));
      sample[static_cast<size_t>(k)] = p;
      rays.row(k) = p->ray;
      inverse_depths(k) = p->inverse_depth;
    }
    if (!near) continue;
    const Vector3d n = rays.partialPivLu().solve(inverse_depths);
    if (!n.allFinite()) continue;
    const int support = Support(pixels, n);
    if (support > best_support) best_support = support, best = n;
  }
  return best;
}

}  // namespace

std::vector<Vector3d> DominantPlanes(const DepthImage& depth, const PinholeCamera& camera,
                                     const Vector3d& steps, const PlaneOptions& options) {
  std::vector<Pixel> pixels = PixelsWithDepth(depth, camera, steps);
  const int needed =
      std::max(3, static_cast<int>(options.min_share * static_cast<double>(pixels.size())));
  Random random(options.seed);
  std::vector<Vector3d> planes;
  while (static_cast<int>(planes.size()) < options.max_planes &&
         static_cast<int>(pixels.size()) >= needed) {
    Vector3d n = BestDraw(pixels, depth.width(), &random);
    for (int k = 0; k < kRefits; ++k) n = FitToInliers(pixels, n);
    if (Support(pixels, n) < needed) break;
    planes.push_back(n);
    std::erase_if(pixels, [&](const Pixel& p) { return On(p, n, kRemoveFactor); });
  }
  return planes;
}

}  // namespace dtr::stereo
