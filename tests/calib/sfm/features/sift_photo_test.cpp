// Features of rendered photos with exact cameras: matches must lie on the true epipolar lines.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "calib/sfm/features/sift.h"
#include "dtr/io/image_io.h"
#include "dtr/types/luma.h"
#include "tests/support/test_data.h"

namespace dtr::sfm::testing {
namespace {

Features FeaturesOf(const std::filesystem::path& file, int max_features) {
  const ImageRgb8 image = io::ReadImage(file);
  std::vector<float> grey;
  for (size_t i = 0; i < image.data().size(); i += 3) {
    grey.push_back(static_cast<float>(Luma(&image.data()[i])) / (255 * 256));
  }
  SiftOptions options;
  options.max_features = max_features;
  return DetectSift(std::span<const float>(grey), image.width(), image.height(), {}, options);
}

struct Camera {
  Eigen::Matrix3d k = Eigen::Matrix3d::Identity();
  Eigen::Matrix4d cam_from_world;
};

Camera CameraOf(const nlohmann::json& view) {
  Camera camera;
  camera.k(0, 0) = view["fx"];
  camera.k(1, 1) = view["fy"];
  camera.k(0, 2) = view["cx"];
  camera.k(1, 2) = view["cy"];
  for (int r = 0; r < 4; ++r) {
    for (int c = 0; c < 4; ++c) camera.cam_from_world(r, c) = view["cam_from_world"][r][c];
  }
  return camera;
}

Eigen::Matrix3d Fundamental(const Camera& a, const Camera& b) {
  const Eigen::Matrix4d b_from_a = b.cam_from_world * a.cam_from_world.inverse();
  const Eigen::Vector3d t = b_from_a.topRightCorner<3, 1>();
  Eigen::Matrix3d cross;
  cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
  return b.k.inverse().transpose() * cross * b_from_a.topLeftCorner<3, 3>() * a.k.inverse();
}

/// Nearest and second nearest descriptor: index, or none where the ratio is above 0.8.
int Nearest(const Descriptor& of, const std::vector<Descriptor>& among) {
  int best = 1 << 30, second = best, index = -1;
  for (size_t i = 0; i < among.size(); ++i) {
    int sum = 0;
    for (size_t k = 0; k < of.size(); ++k) sum += (of[k] - among[i][k]) * (of[k] - among[i][k]);
    if (sum < best) index = static_cast<int>(i);
    second = std::min(second, std::max(best, sum));
    best = std::min(best, sum);
  }
  return best < 0.64 * second ? index : -1;
}

// The 4000 largest features of each: 0.13 px; smaller ones are located better.
TEST(SiftOfPhotos, MatchesLieOnTheTrueEpipolarLines) {
  const auto folder = dtr::testing::DataFolder() / "plaza";
  DTR_REQUIRE_DATA(folder / "cameras.json");
  const auto views = nlohmann::json::parse(std::ifstream(folder / "cameras.json"))["views"];
  std::array<Camera, 2> cameras{CameraOf(views[0]), CameraOf(views[1])};
  std::array<Features, 2> features;
  for (size_t i = 0; i < 2; ++i) {
    features[i] = FeaturesOf(folder / "images" / views[i]["name"].get<std::string>(), 4000);
  }
  ASSERT_EQ(features[0].keypoints.size(), 4000u);
  const Eigen::Matrix3d f = Fundamental(cameras[0], cameras[1]);
  std::vector<double> distances;
  for (size_t i = 0; i < features[0].keypoints.size(); ++i) {
    const int j = Nearest(features[0].descriptors[i], features[1].descriptors);
    if (j < 0) continue;
    const Keypoint &p = features[0].keypoints[i],
                   &q = features[1].keypoints[static_cast<size_t>(j)];
    const Eigen::Vector3d a(p.x_px, p.y_px, 1), b(q.x_px, q.y_px, 1);
    const Eigen::Vector3d in_b = f * a, in_a = f.transpose() * b;
    distances.push_back(std::abs(b.dot(in_b)) /
                        std::hypot(in_b.head<2>().norm(), in_a.head<2>().norm()));
  }
  ASSERT_GT(distances.size(), 300u);
  std::sort(distances.begin(), distances.end());
  const double median = distances[distances.size() / 2];
  const auto near = std::lower_bound(distances.begin(), distances.end(), 2.0) - distances.begin();
  RecordProperty("median_px", std::to_string(median));
  EXPECT_LT(median, 0.15);
  EXPECT_GT(static_cast<double>(near), 0.9 * static_cast<double>(distances.size()));
}

// Nine of this photo's extrema are reached from two pixels.
TEST(SiftOfPhotos, NoFeatureIsThereTwice) {
  const auto file = dtr::testing::DataFolder() / "plaza" / "images" / "0003.jpg";
  DTR_REQUIRE_DATA(file);
  const Features features = FeaturesOf(file, 20000);
  ASSERT_GT(features.keypoints.size(), 8000u);
  for (size_t i = 1; i < features.keypoints.size(); ++i) {
    const Keypoint &a = features.keypoints[i - 1], &b = features.keypoints[i];
    EXPECT_NE(std::memcmp(&a, &b, sizeof(a)), 0) << a.x_px << ", " << a.y_px;
  }
}

}  // namespace
}  // namespace dtr::sfm::testing
