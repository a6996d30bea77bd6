// tests/calib/colmap/model_test_support.h -- small models to write and read.
#pragma once
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "calib/sfm_model.h"
#include "dtr/base/random.h"

namespace dtr::colmap::testing {

/// A model with one camera of every lens model, an image for each (names with spaces and UTF-8,
/// one without features) and points seen by all images that have features. Values are arbitrary,
/// so that a lost bit shows.
inline calib::SfmModel ModelWithEveryCamera(std::uint64_t seed) {
  Random random(seed);
  calib::SfmModel model;
  constexpr int kModels = 17, kPoints = 5;
  for (int id = 0; id < kModels; ++id) {
    calib::LensCamera camera;
    camera.model = static_cast<calib::CameraModel>(id);
    camera.width_px = 640 + id;
    camera.height_px = 480 + id;
    const auto count = static_cast<size_t>(calib::ParameterCount(camera.model));
    for (size_t i = 0; i < count; ++i) {
      camera.params.push_back(i < 4 ? random.Uniform(100, 500) : random.Uniform(-0.01, 0.01));
    }
    if (camera.model == calib::CameraModel::kEucm) camera.params[4] = camera.params[5] = 0.7;
    const auto camera_id = static_cast<std::uint32_t>(3 * id + 1);
    model.cameras[camera_id] = camera;
    calib::SfmImage image;
    image.id = static_cast<std::uint32_t>(100 - id);
    image.name = "Größe und Ort/photo " + std::string(1, static_cast<char>('a' + id)) + ".JPG";
    image.camera_id = camera_id;
    image.cam_from_world.rotation =
        Eigen::Quaterniond(random.Normal(), random.Normal(), random.Normal(), random.Normal())
            .normalized();
    image.cam_from_world.translation =
        Eigen::Vector3d(random.Normal(), random.Normal(), 1e6 * random.Normal());
    for (int i = 0; i < (id == 4 ? 0 : kPoints + 2); ++i) {
      calib::SfmFeature feature;
      feature.pixel = {random.Uniform(0, 640), random.Uniform(0, 480)};
      if (i < kPoints) feature.point_id = static_cast<std::uint64_t>(7 * i);
      image.features.push_back(feature);
    }
    model.images.push_back(image);
  }
  for (int i = 0; i < kPoints; ++i) {
    calib::SfmPoint point;
    point.p_in_world = {random.Normal(), 1e-9 * random.Normal(), 4.5e6 + random.Normal()};
    point.rgb = {static_cast<std::uint8_t>(i), 128, 255};
    point.error_px = random.Uniform();
    model.points[static_cast<std::uint64_t>(7 * i)] = point;
  }
  return model;
}

/// rigs.* and frames.* of a model whose cameras all stand alone, as COLMAP 3.12 and later write
/// them: a rig for each camera, a frame for each image. With `binary` as bytes, else as text.
struct RigsAndFrames {
  std::string rigs, frames;
};
inline RigsAndFrames TrivialFrames(const calib::SfmModel& model, bool binary) {
  RigsAndFrames files;
  const auto put = [](std::string& out, const auto& value) {
    out.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  if (binary) put(files.rigs, std::uint64_t{model.cameras.size()});
  for (const auto& [id, camera] : model.cameras) {
    if (!binary) files.rigs += fmt::format("{} 1 CAMERA {}\n", id, id);
    if (!binary) continue;
    for (const std::uint32_t value : {id, 1u, 0u, id}) put(files.rigs, value);
  }
  if (binary) put(files.frames, std::uint64_t{model.images.size()});
  for (const calib::SfmImage& image : model.images) {
    const auto& q = image.cam_from_world.rotation;
    const auto& t = image.cam_from_world.translation;
    if (!binary) {
      files.frames +=
          fmt::format("{} {} {} {} {} {} {} {} {} 1 CAMERA {} {}\n", image.id, image.camera_id,
                      q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z(), image.camera_id, image.id);
      continue;
    }
    for (const std::uint32_t value : {image.id, image.camera_id}) put(files.frames, value);
    for (const double value : {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()}) {
      put(files.frames, value);
    }
    for (const std::uint32_t value : {1u, 0u, image.camera_id}) put(files.frames, value);
    put(files.frames, std::uint64_t{image.id});
  }
  return files;
}

/// Equality bit for bit.
inline void ExpectSame(const calib::SfmModel& a, const calib::SfmModel& b) {
  ASSERT_EQ(a.cameras.size(), b.cameras.size());
  for (auto x = a.cameras.begin(), y = b.cameras.begin(); x != a.cameras.end(); ++x, ++y) {
    EXPECT_EQ(x->first, y->first);
    EXPECT_EQ(x->second.model, y->second.model);
    EXPECT_EQ(x->second.width_px, y->second.width_px);
    EXPECT_EQ(x->second.height_px, y->second.height_px);
    EXPECT_EQ(x->second.params, y->second.params);
  }
  ASSERT_EQ(a.images.size(), b.images.size());
  for (size_t i = 0; i < a.images.size(); ++i) {
    const auto &x = a.images[i], &y = b.images[i];
    EXPECT_EQ(x.id, y.id);
    EXPECT_EQ(x.name, y.name);
    EXPECT_EQ(x.camera_id, y.camera_id);
    EXPECT_EQ(x.cam_from_world.rotation.coeffs(), y.cam_from_world.rotation.coeffs());
    EXPECT_EQ(x.cam_from_world.translation, y.cam_from_world.translation);
    ASSERT_EQ(x.features.size(), y.features.size());
    for (size_t k = 0; k < x.features.size(); ++k) {
      ASSERT_EQ(x.features[k].pixel, y.features[k].pixel);
      ASSERT_EQ(x.features[k].point_id, y.features[k].point_id);
    }
  }
  ASSERT_EQ(a.points.size(), b.points.size());
  for (auto x = a.points.begin(), y = b.points.begin(); x != a.points.end(); ++x, ++y) {
    ASSERT_EQ(x->first, y->first);
    ASSERT_EQ(x->second.p_in_world, y->second.p_in_world);
    ASSERT_EQ(x->second.rgb, y->second.rgb);
    ASSERT_EQ(x->second.error_px, y->second.error_px);
  }
}

}  // namespace dtr::colmap::testing
