#include "datasets/render_truth.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

#include "dtr/base/error.h"
#include "dtr/base/parallel_for.h"
#include "dtr/base/random.h"
#include "dtr/render/geometry.h"
#include "dtr/types/panorama.h"

namespace dtr::datasets {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kMaxSupersampling = 16;
// A surface point is hidden when something is hit before this share of the way to it. Rounding of
// the intersection is about 1e-14 of the way; the thinnest thing is 1e-3 of the longest ray.
constexpr double kAlmostThere = 1 - 1e-9;
// Surfaces seen more obliquely than this (cosine) are textured as if seen at it: the footprint of
// a pixel would grow beyond all bounds.
constexpr double kMinCosine = 0.05;
constexpr int kTextureRadius = 4;       // 9x9 pixels
constexpr double kTextureStdDev = 4.0;  // levels

/// A camera in the world: rays of z-depth 1.
class RayCaster {
 public:
  RayCaster(const PinholeCamera& camera, const Pose& cam_from_world)
      : camera_(camera),
        world_from_cam_(cam_from_world.rotation.conjugate().toRotationMatrix()),
        eye_(cam_from_world.TargetOriginInSource()) {}

  Ray ThroughDirection(const Vector3d& direction_in_cam) const {
    return {eye_, world_from_cam_ * direction_in_cam};
  }
  Ray ThroughPixel(const Vector2d& pixel) const {
    return ThroughDirection(camera_.RayFromPixel(pixel));
  }
  const Vector3d& eye() const { return eye_; }

 private:
  PinholeCamera camera_;
  Eigen::Matrix3d world_from_cam_;
  Vector3d eye_;
};

double SrgbFromLinear(double v) {
  v = std::clamp(v, 0.0, 1.0);
  return 255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055);
}

double DistortedRadius(const RadialLens& lens, double r) {
  return r * (1 + r * r * (lens.k1 + lens.k2 * r * r));
}

double DistortionSlope(const RadialLens& lens, double r) {
  return 1 + r * r * (3 * lens.k1 + 5 * lens.k2 * r * r);
}

/// Largest undistorted radius up to which the lens stays monotone, or infinity: the smallest
/// positive root r^2 of 1 + 3 k1 r^2 + 5 k2 r^4.
double MonotoneRadius(const RadialLens& lens) {
  const double a = 5 * lens.k2, b = 3 * lens.k1;
  if (a == 0) return b < 0 ? std::sqrt(-1 / b) : kNoHit;
  const double discriminant = b * b - 4 * a;
  if (discriminant < 0) return kNoHit;
  const double root = std::sqrt(discriminant);
  double smallest = kNoHit;
  for (const double s : {(-b - root) / (2 * a), (-b + root) / (2 * a)}) {
    if (s > 0) smallest = std::min(smallest, std::sqrt(s));
  }
  return smallest;
}

/// Inverse of DistortedRadius on its monotone part, by Newton kept inside a shrinking bracket.
double UndistortedRadius(const RadialLens& lens, double distorted, double monotone) {
  double low = 0, high = std::isinf(monotone) ? 2 * distorted + 1 : monotone;
  while (std::isinf(monotone) && DistortedRadius(lens, high) < distorted) high *= 2;
  double r = std::min(distorted, high);
  for (int i = 0; i < 60; ++i) {
    const double error = DistortedRadius(lens, r) - distorted;
    (error > 0 ? high : low) = r;
    double next = r - error / DistortionSlope(lens, r);
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (std::abs(next - r) <= 1e-15 * (1 + r)) return next;
    r = next;
  }
  return r;
}

/// Ray (z = 1; of a fisheye of length 1) of a pixel of the distorted photo.
Vector3d RayOfPhotoPixel(const PinholeCamera& camera, const RadialLens& lens, double monotone,
                         const Vector2d& pixel) {
  const Vector3d distorted = camera.RayFromPixel(pixel);
  if (lens.IsIdeal()) return distorted;
  const double radius = distorted.head<2>().norm();
  if (radius == 0) return distorted;
  if (lens.fisheye) {
    const double angle = UndistortedRadius(lens, radius, monotone);
    const Vector2d across = distorted.head<2>() * (std::sin(angle) / radius);
    return {across.x(), across.y(), std::cos(angle)};
  }
  const double factor = UndistortedRadius(lens, radius, monotone) / radius;
  return {distorted.x() * factor, distorted.y() * factor, 1.0};
}

/// Standard normal for channel c of pixel (x, y): depends on these names only.
double PixelNoise(std::uint64_t seed, int x, int y, int channel) {
  Random random(HashOf(seed, static_cast<std::uint64_t>(x), static_cast<std::uint64_t>(y),
                       static_cast<std::uint64_t>(channel)));
  return random.Normal();
}

/// Scene units per pixel at a hit, as area: oblique surfaces have longer, not wider footprints.
double FootprintAt(const PinholeCamera& camera, const Ray& ray, const Hit& hit) {
  const double cosine = std::abs(hit.normal.dot(ray.direction)) / ray.direction.norm();
  return hit.t / camera.fx_px() / std::sqrt(std::max(cosine, kMinCosine));
}

}  // namespace

void CheckPhotoOptions(const PinholeCamera& camera, const PhotoOptions& options) {
  if (options.supersampling < 1 || options.supersampling > kMaxSupersampling) {
    throw UsageError("supersampling: expected 1 to 16, found " +
                     std::to_string(options.supersampling));
  }
  if (!(options.noise_sigma >= 0 && options.noise_sigma <= 255)) {
    throw UsageError("noise: expected 0 to 255 levels, found " +
                     std::to_string(options.noise_sigma));
  }
  if (!(options.gain > 0) || !std::isfinite(options.gain)) {
    throw UsageError("gain: expected a positive factor, found " + std::to_string(options.gain));
  }
  const RadialLens& lens = options.lens;
  if (!std::isfinite(lens.k1) || !std::isfinite(lens.k2)) {
    throw UsageError("lens distortion: expected finite k1, k2, found " + std::to_string(lens.k1) +
                     ", " + std::to_string(lens.k2));
  }
  const double folds = MonotoneRadius(lens);
  const double limit = lens.fisheye ? std::min(folds, std::numbers::pi) : folds;
  if (std::isinf(limit)) return;
  for (const double x : {0.0, static_cast<double>(camera.width_px())}) {
    for (const double y : {0.0, static_cast<double>(camera.height_px())}) {
      if (camera.RayFromPixel({x, y}).head<2>().norm() >= DistortedRadius(lens, limit)) {
        throw UsageError("lens distortion: k1 " + std::to_string(lens.k1) + ", k2 " +
                         std::to_string(lens.k2) +
                         " fold the image over before its corners; take smaller ones, or a longer "
                         "focal length");
      }
    }
  }
}

Grid<float> RenderLight(const Scene& scene, const PinholeCamera& camera, const Pose& cam_from_world,
                        const PhotoOptions& options) {
  CheckPhotoOptions(camera, options);
  const RayCaster caster(camera, cam_from_world);
  const double monotone = MonotoneRadius(options.lens);
  const int n = options.supersampling;
  Grid<float> light(camera.width_px(), camera.height_px(), 3);
  ParallelFor(0, camera.height_px(), [&](int y) {
    int last = -1;
    for (int x = 0; x < camera.width_px(); ++x) {
      Vector3d sum = Vector3d::Zero();
      for (int k = 0; k < n * n; ++k) {
        const Vector2d pixel(x + (k % n + 0.5) / n, y + (k / n + 0.5) / n);
        const Ray ray =
            caster.ThroughDirection(RayOfPhotoPixel(camera, options.lens, monotone, pixel));
        const std::optional<Hit> hit = scene.Intersect(ray, kNoHit, last);
        if (!hit) continue;
        last = hit->primitive;
        sum += scene.Radiance(*hit, FootprintAt(camera, ray, *hit));
      }
      for (int c = 0; c < 3; ++c) light(x, y, c) = static_cast<float>(sum[c] / (n * n));
    }
  });
  return light;
}

Grid<float> RenderPanoramaLight(const Scene& scene, int width_px, const Pose& cam_from_world,
                                const PhotoOptions& options) {
  if (width_px < 2 || width_px % 2 != 0) {
    throw std::invalid_argument("RenderPanoramaLight: the width must be even");
  }
  // Its size at the equator is that of a pixel: a sphere around a pinhole camera of that focal
  // length.
  const double focal_px = width_px / (2 * std::numbers::pi);
  const PinholeCamera scale(width_px, width_px / 2, focal_px, focal_px, 0, 0);
  PhotoOptions without_lens = options;
  without_lens.lens = {};
  CheckPhotoOptions(scale, without_lens);
  const Panorama panorama{static_cast<double>(width_px), width_px / 2.0, 0, 0};
  const RayCaster caster(scale, cam_from_world);
  const int n = options.supersampling;
  Grid<float> light(width_px, width_px / 2, 3);
  ParallelFor(0, light.height(), [&](int y) {
    int last = -1;
    for (int x = 0; x < width_px; ++x) {
      Vector3d sum = Vector3d::Zero();
      for (int k = 0; k < n * n; ++k) {
        const Vector2d pixel(x + (k % n + 0.5) / n, y + (k / n + 0.5) / n);
        const Ray ray = caster.ThroughDirection(panorama.DirectionFromPixel(pixel));
        const std::optional<Hit> hit = scene.Intersect(ray, kNoHit, last);
        if (!hit) continue;
        last = hit->primitive;
        sum += scene.Radiance(*hit, FootprintAt(scale, ray, *hit));
      }
      for (int c = 0; c < 3; ++c) light(x, y, c) = static_cast<float>(sum[c] / (n * n));
    }
  });
  return light;
}

ImageRgb8 Develop(const Grid<float>& light, const PhotoOptions& options) {
  ImageRgb8 photo(light.width(), light.height(), 3);
  ParallelFor(0, light.height(), [&](int y) {
    for (int x = 0; x < light.width(); ++x) {
      for (int c = 0; c < 3; ++c) {
        double level = SrgbFromLinear(options.gain * light(x, y, c));
        if (options.noise_sigma > 0) {
          level += options.noise_sigma * PixelNoise(options.seed, x, y, c);
        }
        photo(x, y, c) = static_cast<std::uint8_t>(std::clamp(std::floor(level + 0.5), 0.0, 255.0));
      }
    }
  });
  return photo;
}

ImageRgb8 RenderPhoto(const Scene& scene, const PinholeCamera& camera, const Pose& cam_from_world,
                      const PhotoOptions& options) {
  return Develop(RenderLight(scene, camera, cam_from_world, options), options);
}

DepthImage RenderDepth(const Scene& scene, const PinholeCamera& camera, const Pose& cam_from_world,
                       double scale) {
  const RayCaster caster(camera, cam_from_world);
  DepthImage depth(camera.width_px(), camera.height_px());
  ParallelFor(0, camera.height_px(), [&](int y) {
    for (int x = 0; x < camera.width_px(); ++x) {
      const std::optional<Hit> hit = scene.Intersect(caster.ThroughPixel({x + 0.5, y + 0.5}));
      if (hit) depth(x, y) = static_cast<float>(hit->t * scale);
    }
  });
  return depth;
}

Mask VisibilityMask(const Scene& scene, const PinholeCamera& camera, const Pose& cam_from_world,
                    const std::vector<Pose>& others, int min_others) {
  const RayCaster caster(camera, cam_from_world);
  // Near cameras first: they most likely see the same, and min_others ends the search.
  std::vector<Pose> by_distance = others;
  std::stable_sort(by_distance.begin(), by_distance.end(), [&](const Pose& a, const Pose& b) {
    return (a.TargetOriginInSource() - caster.eye()).squaredNorm() <
           (b.TargetOriginInSource() - caster.eye()).squaredNorm();
  });
  Mask mask(camera.width_px(), camera.height_px());
  ParallelFor(0, camera.height_px(), [&](int y) {
    for (int x = 0; x < camera.width_px(); ++x) {
      const std::optional<Hit> hit = scene.Intersect(caster.ThroughPixel({x + 0.5, y + 0.5}));
      if (!hit) continue;
      int seen = 0;
      for (const Pose& other : by_distance) {
        if (seen >= min_others) break;
        const auto pixel = camera.PixelFromCam(other * hit->p_in_world);
        if (!pixel || !camera.Contains(*pixel)) continue;
        const Vector3d eye = other.TargetOriginInSource();
        const Ray ray{eye, hit->p_in_world - eye};
        if (hit->normal.dot(ray.direction) >= 0) continue;
        if (!scene.IsBlocked(ray, 0, kAlmostThere)) ++seen;
      }
      if (seen >= min_others) mask(x, y) = 255;
    }
  });
  return mask;
}

Mask TextureMask(const ImageRgb8& photo) {
  const int width = photo.width(), height = photo.height();
  // Sums of luma and its square over [0, x) x [0, y), in whole thousandths of a level: exact.
  Grid<std::int64_t> sums(width + 1, height + 1, 2);
  for (int y = 0; y < height; ++y) {
    std::int64_t row = 0, row2 = 0;
    for (int x = 0; x < width; ++x) {
      const std::int64_t luma = 299 * photo(x, y, 0) + 587 * photo(x, y, 1) + 114 * photo(x, y, 2);
      row += luma;
      row2 += luma * luma;
      sums(x + 1, y + 1, 0) = sums(x + 1, y, 0) + row;
      sums(x + 1, y + 1, 1) = sums(x + 1, y, 1) + row2;
    }
  }
  Mask mask(width, height);
  for (int y = 0; y < height; ++y) {
    const int y0 = std::max(0, y - kTextureRadius), y1 = std::min(height, y + kTextureRadius + 1);
    for (int x = 0; x < width; ++x) {
      const int x0 = std::max(0, x - kTextureRadius), x1 = std::min(width, x + kTextureRadius + 1);
      const auto sum = [&](int c) {
        return static_cast<double>(sums(x1, y1, c) - sums(x0, y1, c) - sums(x1, y0, c) +
                                   sums(x0, y0, c));
      };
      const double count = static_cast<double>((x1 - x0) * (y1 - y0));
      const double mean = sum(0) / count;
      const double variance = sum(1) / count - mean * mean;
      if (variance >= 1e6 * kTextureStdDev * kTextureStdDev) mask(x, y) = 255;
    }
  }
  return mask;
}

DtrSet RenderTruthSet(const Scene& scene, const PinholeCamera& camera,
                      const std::vector<Pose>& cams_from_world, const PhotoOptions& options) {
  DtrSet set;
  set.unit = LengthUnit::kMetre;
  set.frames.resize(1);
  for (size_t i = 0; i < cams_from_world.size(); ++i) {
    PhotoOptions of_view = options;
    of_view.seed = HashOf(options.seed, i);
    View view;
    char id[32];
    std::snprintf(id, sizeof id, "%04zu", i);
    view.id = id;
    view.name = view.id + ".jpg";
    view.camera = camera;
    view.cam_from_world = cams_from_world[i];
    view.image = RenderPhoto(scene, camera, cams_from_world[i], of_view);
    view.depth = RenderDepth(scene, camera, cams_from_world[i]);
    double near = kNoHit, far = 0;
    for (const float z : view.depth.grid().data()) {
      if (DepthImage::IsHole(z)) continue;
      near = std::min<double>(near, z);
      far = std::max<double>(far, z);
    }
    if (far > 0) {
      view.near_z = near;
      // A map of one depth still needs a range.
      view.far_z = far > near ? far : near * 1.001;
    }
    set.frames[0].views.push_back(std::move(view));
  }
  FinishGeometry(set);
  return set;
}

}  // namespace dtr::datasets
