// tests/calib/sfm/run/some_graph.h -- two images with features and matches.
#pragma once
#include <Eigen/Geometry>
#include <filesystem>
#include <vector>

#include "calib/sfm/run/store.h"

namespace dtr::sfm::testing {

inline const std::vector<calib::LensCamera> kCameras{
    {calib::CameraModel::kRadial, 640, 480, {500, 320, 240, -0.1, 0.01}}};

inline Features SomeFeatures(float offset) {
  Features features;
  for (int i = 0; i < 20; ++i) {
    const auto at = static_cast<float>(i);
    features.keypoints.push_back({30 * at + offset, 20 * at + 3, 1.5f, 0.1f * at});
    Descriptor descriptor{};
    descriptor[static_cast<size_t>(i)] = static_cast<std::uint8_t>(200 + i);
    features.descriptors.push_back(descriptor);
  }
  return features;
}

// Two images whose 18 common features are seen 5 degrees apart.
inline ViewGraph SomeGraph() {
  ViewGraph graph;
  graph.cameras = kCameras;
  graph.cameras[0].params[0] = 512.5;
  graph.focal_is_known = {true};
  for (const float offset : {1.0f, 45.0f}) {
    GraphImage image{offset < 2 ? "a.jpg" : "b.jpg", 0, {}};
    for (const Keypoint& k : SomeFeatures(offset).keypoints) {
      image.pixels.emplace_back(k.x_px, k.y_px);
    }
    graph.images.push_back(image);
  }
  PairGeometry pair;
  pair.image_b = 1;
  pair.kind = PairKind::kCalibrated;
  pair.b_rotation_a = Eigen::AngleAxisd(0.2, Eigen::Vector3d(1, 2, 3).normalized()).matrix();
  pair.b_translation_a = Eigen::Vector3d(3, -1, 2).normalized();
  for (std::uint32_t i = 0; i < 18; ++i) pair.matches.emplace_back(i, i + 1);
  graph.pairs.push_back(pair);
  return graph;
}

/// The features of both images.
inline void WriteSomeFeatures(const std::filesystem::path& file) {
  FeatureFile::Create(file);
  FeatureFile::Add(file, std::vector<size_t>{1}, std::vector{SomeFeatures(45)});
  FeatureFile::Add(file, std::vector<size_t>{0}, std::vector{SomeFeatures(1)});
}

}  // namespace dtr::sfm::testing
