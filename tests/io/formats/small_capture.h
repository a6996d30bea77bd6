// tests/io/formats/small_capture.h -- what small captures of every layout show. What is expected of
// their cameras is worked out by the formulas of the programs that write them, not by ours.
#pragma once
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/io/formats/rgbd_capture.h"
#include "dtr/io/image_io.h"

namespace dtr::io::small_capture {

namespace fs = std::filesystem;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kResidualPx = 1e-3;  // half a pixel is 500 times it

/// What a program knows of a frame: the axes of its camera in the world, and its centre.
struct Frame {
  Matrix3d world_from_cam;  ///< x right, y down, z forward
  Vector3d centre;
};

inline std::vector<Frame> Frames() {
  std::vector<Frame> frames;
  for (int i = 0; i < 3; ++i) {
    const Quaterniond turn = Eigen::AngleAxisd(0.3 + 0.1 * i, Vector3d(0.2, 1, -0.3).normalized()) *
                             Eigen::AngleAxisd(0.2 * i, Vector3d::UnitZ());
    frames.push_back({turn.toRotationMatrix(), {0.4 * i, -0.2 + 0.1 * i, 0.7}});
  }
  return frames;
}

/// The same axes as ARKit has them: x right, y up, z back.
inline Matrix3d GlAxes(const Frame& frame) {
  return frame.world_from_cam * Vector3d(1, -1, -1).asDiagonal();
}

inline const Matrix3d kK = [] {  // of images of 80x60
  Matrix3d k;
  k << 70, 0, 40.7, 0, 71, 29.4, 0, 0, 1;
  return k;
}();

/// Where such a camera sees a point of the world, centres of pixels at whole numbers + `first`.
inline Vector2d Seen(const Frame& frame, const Vector3d& p, double first) {
  const Vector3d q = kK * (frame.world_from_cam.transpose() * (p - frame.centre));
  // Ours has the centre of the first pixel at 0.5, 0.5.
  return Vector2d(q.x() / q.z(), q.y() / q.z()).array() + 0.5 - first;
}

inline void Write(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

inline void WritePhoto(const fs::path& file, int width = 80, int height = 60) {
  fs::create_directories(file.parent_path());
  WriteImage(file, ImageRgb8(width, height, 3, 90));
}

/// All cameras see points as their program says; pixels of the photos, which are `scale` times
/// 80x60.
inline void ExpectCameras(const RgbdCapture& capture, double first, double scale = 1) {
  EXPECT_EQ(capture.list.unit, LengthUnit::kMetre);
  const std::vector<Frame> frames = Frames();
  ASSERT_THAT(capture.list.cameras, ::testing::SizeIs(frames.size()));
  for (size_t i = 0; i < frames.size(); ++i) {
    const NamedCamera& named = capture.list.cameras[i];
    for (const Vector3d& in_cam :
         {Vector3d(0.1, -0.2, 2), Vector3d(-0.7, 0.4, 3), Vector3d(0.5, 0.3, 1.5)}) {
      const Vector3d p = frames[i].centre + frames[i].world_from_cam * in_cam;
      const auto pixel = named.camera.PixelFromCam(named.cam_from_world * p);
      ASSERT_TRUE(pixel);
      EXPECT_LT((*pixel - scale * Seen(frames[i], p, first)).norm(), kResidualPx) << named.name;
    }
  }
}

/// Cuts a file of a capture after every fifth byte but those of its last word; each cut must be an
/// Error, or leave fewer cameras.
inline void ExpectCutsNoticed(const fs::path& capture, const fs::path& file,
                              const std::string& format) {
  std::ifstream in(file, std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(in)), {});
  const size_t all = ReadRgbdCapture(capture, format).list.cameras.size();
  const size_t last_word = whole.find_last_of(" ,\n:[", whole.find_last_not_of(" \n]}"));
  for (size_t bytes = 0; bytes < last_word; bytes += 5) {
    Write(file, whole.substr(0, bytes));
    size_t cameras = 0;
    try {
      cameras = ReadRgbdCapture(capture, format).list.cameras.size();
    } catch (const Error&) {
    }
    EXPECT_LT(cameras, all) << file << " cut after " << bytes;
  }
  Write(file, whole);
  EXPECT_EQ(ReadRgbdCapture(capture, format).list.cameras.size(), all);
}

}  // namespace dtr::io::small_capture
