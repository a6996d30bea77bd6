// tests/calib/sfm/features/blob_scene.h -- images that can be drawn exactly under any map.
#pragma once
#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "calib/sfm/features/sift.h"
#include "dtr/base/random.h"

namespace dtr::sfm::testing {

/// A grey image, values 0 to 1.
struct Grey {
  int width = 0, height = 0;
  std::vector<float> values;

  Grey(int w, int h, float value = 0)
      : width(w), height(h), values(static_cast<size_t>(w) * static_cast<size_t>(h), value) {}
  float& at(int x, int y) {
    return values[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
  }
};

inline Features Detect(const Grey& image, const SiftOptions& options = {},
                       const std::vector<std::uint8_t>& mask = {}) {
  return DetectSift(std::span<const float>(image.values), image.width, image.height, mask, options);
}

/// A similarity of the plane: rotation, then scale, then translation.
struct Similarity {
  double angle_rad = 0, scale = 1;
  Eigen::Vector2d shift_px = Eigen::Vector2d::Zero();

  Eigen::Vector2d operator()(const Eigen::Vector2d& p) const {
    const double c = scale * std::cos(angle_rad), s = scale * std::sin(angle_rad);
    return {c * p.x() - s * p.y() + shift_px.x(), s * p.x() + c * p.y() + shift_px.y()};
  }
};

/// Round Gaussian blobs on grey, whose images under similarities are such blobs too.
class BlobScene {
 public:
  struct Blob {
    Eigen::Vector2d centre_px;  // centre of the first pixel at 0.5
    double sigma_px, height;
  };

  explicit BlobScene(std::vector<Blob> blobs) : blobs_(std::move(blobs)) {}

  /// Crowded enough that most features are made by several blobs.
  static BlobScene Random(int width, int height, int count, std::uint64_t seed) {
    dtr::Random random(seed);
    std::vector<Blob> blobs;
    for (int i = 0; i < count; ++i) {
      Blob blob;
      blob.centre_px = {random.Uniform(0, width), random.Uniform(0, height)};
      blob.sigma_px = 1.2 * std::exp2(random.Uniform(0, 3));
      blob.height = random.Uniform(-0.2, 0.2);
      blobs.push_back(blob);
    }
    return BlobScene(blobs);
  }

  Grey Draw(int width, int height, const Similarity& map = {}) const {
    Grey image(width, height, 0.5f);
    for (const Blob& blob : blobs_) {
      const Eigen::Vector2d c = map(blob.centre_px);
      const double sigma = blob.sigma_px * map.scale, reach = 5 * sigma;
      const int x0 = std::max(0, static_cast<int>(c.x() - reach));
      const int x1 = std::min(width, static_cast<int>(c.x() + reach) + 1);
      const int y0 = std::max(0, static_cast<int>(c.y() - reach));
      const int y1 = std::min(height, static_cast<int>(c.y() + reach) + 1);
      for (int y = y0; y < y1; ++y) {
        for (int x = x0; x < x1; ++x) {
          const double r2 = (Eigen::Vector2d(x + 0.5, y + 0.5) - c).squaredNorm();
          image.at(x, y) += static_cast<float>(blob.height * std::exp(-0.5 * r2 / (sigma * sigma)));
        }
      }
    }
    for (float& v : image.values) v = std::clamp(v, 0.0f, 1.0f);
    return image;
  }

 private:
  std::vector<Blob> blobs_;
};

inline int SquaredDistance(const Descriptor& a, const Descriptor& b) {
  int sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return sum;
}

/// How the features of one image are found again in another whose map is known.
struct Repetition {
  int inside = 0;     ///< features of the first image that lie in the second
  int found = 0;      ///< of them with a feature within 1 px there, and 20 % of the scale
  int oriented = 0;   ///< and within 0.1 rad of the orientation
  int nearest = 0;    ///< and whose descriptor is the nearest of all
  double rms_px = 0;  ///< of the positions of those found
  Eigen::Vector2d mean_px{0, 0};  ///< difference of positions
};

/// `angle` maps orientations; `margin_px`: features nearer to a border do not count.
inline Repetition Repeat(const Features& a, const Features& b, int width, int height,
                         double margin_px, double scale,
                         const std::function<Eigen::Vector2d(const Eigen::Vector2d&)>& map,
                         const std::function<double(double)>& angle) {
  Repetition r;
  double squares = 0;
  for (size_t i = 0; i < a.keypoints.size(); ++i) {
    const Keypoint& k = a.keypoints[i];
    const Eigen::Vector2d there = map({k.x_px, k.y_px});
    const double margin = std::max(margin_px, 6.0 * k.scale_px * scale);
    if (there.x() < margin || there.y() < margin || there.x() > width - margin ||
        there.y() > height - margin) {
      continue;
    }
    ++r.inside;
    double best = 1, best_oriented = 1;
    Eigen::Vector2d difference(0, 0);
    size_t match = b.keypoints.size();
    for (size_t j = 0; j < b.keypoints.size(); ++j) {
      const Keypoint& q = b.keypoints[j];
      const Eigen::Vector2d d = Eigen::Vector2d(q.x_px, q.y_px) - there;
      const double distance = d.norm();
      if (distance >= 1 || std::abs(std::log(q.scale_px / (k.scale_px * scale))) > 0.2) continue;
      if (distance < best) {
        best = distance;
        difference = d;
      }
      const double turn =
          std::remainder(q.orientation_rad - angle(k.orientation_rad), 2 * EIGEN_PI);
      if (std::abs(turn) < 0.1 && distance < best_oriented) {
        best_oriented = distance;
        match = j;
      }
    }
    if (best < 1) {
      ++r.found;
      squares += best * best;
      r.mean_px += difference;
    }
    if (match == b.keypoints.size()) continue;
    ++r.oriented;
    const int own = SquaredDistance(a.descriptors[i], b.descriptors[match]);
    r.nearest += std::all_of(b.descriptors.begin(), b.descriptors.end(), [&](const Descriptor& d) {
      return own <= SquaredDistance(a.descriptors[i], d);
    });
  }
  r.rms_px = std::sqrt(squares / std::max(r.found, 1));
  r.mean_px /= std::max(r.found, 1);
  return r;
}

}  // namespace dtr::sfm::testing
