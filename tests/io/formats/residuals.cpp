#include "tests/io/formats/residuals.h"

#include <algorithm>
#include <cmath>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "dtr/io/image_io.h"

namespace dtr::testing {
namespace {

double Median(std::vector<double> values) {
  if (values.empty()) return std::nan("");
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

struct Features {
  std::vector<Eigen::Vector2d> pixels;
  cv::Mat descriptors;
};

Features DetectFeatures(const std::filesystem::path& file, int width_px) {
  constexpr int kMaxFeatures = 1500;
  ImageRgb8 image = io::ReadImage(file);
  const cv::Mat rgb(image.height(), image.width(), CV_8UC3, image.data().data());
  cv::Mat grey, small;
  cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
  const double scale = double(image.width()) / width_px;
  cv::resize(grey, small, cv::Size(width_px, int(std::lround(image.height() / scale))), 0, 0,
             cv::INTER_AREA);
  std::vector<cv::KeyPoint> keypoints;
  Features features;
  cv::SIFT::create(kMaxFeatures)
      ->detectAndCompute(small, cv::noArray(), keypoints, features.descriptors);
  const double scale_y = double(image.height()) / small.rows;
  for (const cv::KeyPoint& point : keypoints) {
    features.pixels.emplace_back((point.pt.x + 0.5) * scale, (point.pt.y + 0.5) * scale_y);
  }
  return features;
}

Eigen::Matrix3d InverseK(const PinholeCamera& camera) {
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Identity();
  inverse(0, 0) = 1 / camera.fx_px();
  inverse(1, 1) = 1 / camera.fy_px();
  inverse(0, 2) = -camera.cx_px() / camera.fx_px();
  inverse(1, 2) = -camera.cy_px() / camera.fy_px();
  return inverse;
}

// 1/z at a position between four pixel centres; 0 if they are holes or belong to different
// surfaces.
double InverseDepthAt(const DepthImage& depth, const Eigen::Vector2d& pixel) {
  constexpr double kSameSurface = 0.02;
  const double u = pixel.x() - 0.5, v = pixel.y() - 0.5;
  const int x = int(std::floor(u)), y = int(std::floor(v));
  if (!depth.Contains(x, y) || !depth.Contains(x + 1, y + 1)) return 0;
  double sum = 0, nearest = 1e30, farthest = 0;
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      const double z = depth(x + i, y + j);
      if (!(z > 0)) return 0;
      nearest = std::min(nearest, z);
      farthest = std::max(farthest, z);
      sum += (i == 1 ? u - x : 1 - u + x) * (j == 1 ? v - y : 1 - v + y) / z;
    }
  }
  return farthest > nearest * (1 + kSameSurface) ? 0 : sum;
}

}  // namespace

std::vector<PixelPair> MatchImages(const std::filesystem::path& image_a,
                                   const std::filesystem::path& image_b, int width_px) {
  constexpr float kRatio = 0.8f;
  const Features a = DetectFeatures(image_a, width_px), b = DetectFeatures(image_b, width_px);
  cv::BFMatcher matcher;
  std::vector<std::vector<cv::DMatch>> forward;
  std::vector<cv::DMatch> backward;
  matcher.knnMatch(a.descriptors, b.descriptors, forward, 2);
  matcher.match(b.descriptors, a.descriptors, backward);
  std::vector<PixelPair> pairs;
  for (const auto& best : forward) {
    if (best.size() < 2 || !(best[0].distance < kRatio * best[1].distance)) continue;
    if (backward[size_t(best[0].trainIdx)].trainIdx != best[0].queryIdx) continue;
    pairs.push_back({a.pixels[size_t(best[0].queryIdx)], b.pixels[size_t(best[0].trainIdx)]});
  }
  return pairs;
}

double MedianEpipolarPx(const io::NamedCamera& a, const io::NamedCamera& b,
                        const std::vector<PixelPair>& pairs) {
  const Pose b_from_a = b.cam_from_world * a.cam_from_world.Inverse();
  const Eigen::Vector3d& t = b_from_a.translation;
  Eigen::Matrix3d cross;
  cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
  const Eigen::Matrix3d fundamental = InverseK(b.camera).transpose() * cross *
                                      b_from_a.rotation.toRotationMatrix() * InverseK(a.camera);
  std::vector<double> distances_px;
  for (const PixelPair& pair : pairs) {
    const Eigen::Vector3d line_in_b = fundamental * pair.a.homogeneous();
    const Eigen::Vector3d line_in_a = fundamental.transpose() * pair.b.homogeneous();
    const double product = std::abs(pair.b.homogeneous().dot(line_in_b));
    distances_px.push_back(product / line_in_b.head<2>().norm());
    distances_px.push_back(product / line_in_a.head<2>().norm());
  }
  return Median(distances_px);
}

DepthFit CarryDepth(const io::NamedCamera& a, const DepthImage& depth_a, const io::NamedCamera& b,
                    const DepthImage& depth_b) {
  constexpr int kStep = 5;
  constexpr double kVisible = 0.1;
  const Pose b_from_a = b.cam_from_world * a.cam_from_world.Inverse();
  std::vector<double> differences, relative;
  for (int y = 0; y < depth_a.height(); y += kStep) {
    for (int x = 0; x < depth_a.width(); x += kStep) {
      if (DepthImage::IsHole(depth_a(x, y))) continue;
      const Eigen::Vector3d p_in_b =
          b_from_a * a.camera.CamFromPixel({x + 0.5, y + 0.5}, depth_a(x, y), depth_a.kind());
      const auto pixel = b.camera.PixelFromCam(p_in_b);
      if (!pixel || !b.camera.Contains(*pixel)) continue;
      const double inverse_depth = InverseDepthAt(depth_b, *pixel);
      if (inverse_depth == 0) continue;
      const double found =
          depth_b.kind() == DepthKind::kPlaneZ
              ? 1 / inverse_depth
              : b.camera.CamFromPixel(*pixel, 1 / inverse_depth, DepthKind::kRayDistance).z();
      const double difference = std::abs(p_in_b.z() - found);
      if (difference > kVisible * found) continue;
      differences.push_back(difference);
      relative.push_back(difference / found);
    }
  }
  const int samples = int(differences.size());
  return {Median(differences), Median(relative), samples};
}

io::NamedCamera WithShift(io::NamedCamera named, double dx_px, double dy_px) {
  const PinholeCamera& c = named.camera;
  named.camera = PinholeCamera(c.width_px(), c.height_px(), c.fx_px(), c.fy_px(), c.cx_px() + dx_px,
                               c.cy_px() + dy_px);
  return named;
}

io::NamedCamera WithFlippedAxes(io::NamedCamera named) {
  const Pose gl_from_cam{Eigen::Quaterniond(0, 1, 0, 0), Eigen::Vector3d::Zero()};
  named.cam_from_world = gl_from_cam * named.cam_from_world;
  return named;
}

io::NamedCamera WithInvertedPose(io::NamedCamera named) {
  named.cam_from_world = named.cam_from_world.Inverse();
  return named;
}

}  // namespace dtr::testing
