// Small faithful captures of every layout.
#include "dtr/io/formats/rgbd_capture.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <fstream>
#include <functional>

#include "dtr/base/error.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/formats/foreign_depth.h"
#include "dtr/io/image_io.h"
#include "tests/io/formats/small_capture.h"
#include "tests/support/test_data.h"

namespace dtr::io {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;
using namespace small_capture;

void WriteDepthMm(const fs::path& file) {
  fs::create_directories(file.parent_path());
  WritePng16(file, Grid<std::uint16_t>(20, 15, 1, 2500));
}

template <typename Matrix>
std::string Rows(const Matrix& m) {
  std::string text;
  for (int y = 0; y < m.rows(); ++y) {
    for (int x = 0; x < m.cols(); ++x) text += fmt::format("{:.17g} ", m(y, x));
    text += '\n';
  }
  return text;
}

Eigen::Matrix4d Transform(const Matrix3d& axes, const Vector3d& centre) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = axes;
  m.topRightCorner<3, 1>() = centre;
  return m;
}

std::string ErrorOf(const fs::path& capture, const std::string& format) {
  try {
    ReadRgbdCapture(capture, format);
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    return error.what();
  }
  return "no error";
}

class Rgbd : public ::testing::Test {
 protected:
  fs::path root() const { return folder_.path(); }

 private:
  testing::TemporaryFolder folder_;
};

std::string PolycamJson(const Frame& frame) {
  std::string text = fmt::format(
      R"({{"fx": {}, "fy": {}, "cx": {}, "cy": {}, "width": 80, "height": 60, "blur_score": 99)",
      kK(0, 0), kK(1, 1), kK(0, 2), kK(1, 2));
  const Eigen::Matrix4d m = Transform(GlAxes(frame), frame.centre);
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 4; ++x) text += fmt::format(", \"t_{}{}\": {:.17g}", y, x, m(y, x));
  }
  return text + "}";
}

TEST_F(Rgbd, Polycam) {
  for (size_t i = 0; i < 3; ++i) {
    const std::string stem = fmt::format("14420085256{}", i);
    // Twice the size that the cameras are of.
    WritePhoto(root() / "keyframes/images" / (stem + ".jpg"), 160, 120);
    WriteDepthMm(root() / "keyframes/depth" / (stem + ".png"));
    Write(root() / "keyframes/cameras" / (stem + ".json"), PolycamJson(Frames()[i]));
  }
  EXPECT_EQ(RgbdFormatOf(root()), "polycam");
  const RgbdCapture capture = ReadRgbdCapture(root(), "polycam");
  ExpectCameras(capture, 0.5, 2);
  EXPECT_EQ(capture.depth_unit_m, 0.001);
  EXPECT_EQ(capture.list.cameras[1].depth_file, "144200852561.png");
  EXPECT_THAT(capture.notes, ::testing::Contains(HasSubstr("no corrected_cameras")));
  ExpectCutsNoticed(root(), root() / "keyframes/cameras/144200852561.json", "polycam");
  // Corrected cameras take the place of the others, a photo that is gone is left out.
  for (size_t i = 0; i < 3; ++i) {
    const std::string stem = fmt::format("14420085256{}", i);
    if (i > 0) WritePhoto(root() / "keyframes/corrected_images" / (stem + ".jpg"));
    Write(root() / "keyframes/corrected_cameras" / (stem + ".json"), PolycamJson(Frames()[i]));
  }
  const RgbdCapture corrected = ReadRgbdCapture(root(), "polycam");
  EXPECT_EQ(corrected.images, root() / "keyframes/corrected_images");
  EXPECT_THAT(corrected.list.cameras, SizeIs(2));
  EXPECT_THAT(corrected.skipped, SizeIs(1));
  EXPECT_THAT(corrected.notes, ::testing::Contains(HasSubstr("1 of 3 frames are left out")));
}

TEST_F(Rgbd, Record3d) {
  std::string poses;
  for (size_t i = 0; i < 3; ++i) {
    WritePhoto(root() / "rgb" / fmt::format("{}.jpg", i));
    fs::create_directories(root() / "depth");
    WriteExr(root() / "depth" / fmt::format("{}.exr", i), Grid<float>(20, 15, 1, 2.5f));
    const Quaterniond q(GlAxes(Frames()[i]));
    const Vector3d c = Frames()[i].centre;
    poses += fmt::format("{}[{:.17g}, {:.17g}, {:.17g}, {:.17g}, {}, {}, {}]", i == 0 ? "" : ", ",
                         q.x(), q.y(), q.z(), q.w(), c.x(), c.y(), c.z());
  }
  Write(
      root() / "metadata.json",
      fmt::format(
          R"({{"w": 80, "h": 60, "fps": 60, "K": [{}, 0, 0, 0, {}, 0, {}, {}, 1], "poses": [{}]}})",
          kK(0, 0), kK(1, 1), kK(0, 2), kK(1, 2), poses));
  EXPECT_EQ(RgbdFormatOf(root()), "record3d");
  const RgbdCapture capture = ReadRgbdCapture(root(), "record3d");
  ExpectCameras(capture, 0.5);
  EXPECT_EQ(capture.depth_unit_m, 1);
  EXPECT_EQ(capture.list.cameras[2].depth_file, "2.exr");
  ExpectCutsNoticed(root(), root() / "metadata.json", "record3d");
}

TEST_F(Rgbd, StrayScanner) {
  std::string odometry = "timestamp, frame, x, y, z, qx, qy, qz, qw\n";
  for (size_t i = 0; i < 3; ++i) {
    WriteDepthMm(root() / "depth" / fmt::format("{:06}.png", 5 * i));
    const Quaterniond q(Frames()[i].world_from_cam);
    const Vector3d c = Frames()[i].centre;
    odometry += fmt::format("{}, {:06}, {}, {}, {}, {:.17g}, {:.17g}, {:.17g}, {:.17g}\n", 0.5 * i,
                            5 * i, c.x(), c.y(), c.z(), q.x(), q.y(), q.z(), q.w());
  }
  Write(root() / "odometry.csv", odometry);
  Write(root() / "camera_matrix.csv",
        fmt::format("{},0.0,{}\n0.0,{},{}\n0.0,0.0,1.0\n", kK(0, 0), kK(0, 2), kK(1, 1), kK(1, 2)));
  Write(root() / "rgb.mp4", "a video");
  EXPECT_EQ(RgbdFormatOf(root()), "stray-scanner");
  EXPECT_THAT(ErrorOf(root(), "stray-scanner"), HasSubstr("ffmpeg -i rgb.mp4"));
  for (size_t i = 0; i < 3; ++i) WritePhoto(root() / "rgb" / fmt::format("{:06}.jpg", 5 * i));
  const RgbdCapture capture = ReadRgbdCapture(root(), "stray-scanner");
  ExpectCameras(capture, 0.5);
  EXPECT_EQ(capture.confidence_line, "");
  EXPECT_EQ(capture.list.cameras[1].depth_file, "000005.png");
  ExpectCutsNoticed(root(), root() / "odometry.csv", "stray-scanner");
  ExpectCutsNoticed(root(), root() / "camera_matrix.csv", "stray-scanner");
  // Intrinsics of the video beside photos of another size that is not a scaled one.
  Write(root() / "camera_matrix.csv", "1400,0,900\n0,1400,100\n0,0,1\n");
  EXPECT_THAT(ErrorOf(root(), "stray-scanner"), HasSubstr("is not near the middle"));
}

// Levels are numbers and no colours: 0, 1 and 2 of 255.
TEST_F(Rgbd, ConfidenceOfStrayScannerIsReadAsItIsStored) {
  WriteDepthMm(root() / "depth/000000.png");
  WritePhoto(root() / "rgb/000000.jpg");
  Write(root() / "odometry.csv", "timestamp,frame,x,y,z,qx,qy,qz,qw\n0,000000,0,0,0,0,0,0,1\n");
  Write(root() / "camera_matrix.csv", "70,0,40\n0,70,30\n0,0,1\n");
  ImageRgb8 levels(20, 15, 3, 2);
  for (int c = 0; c < 3; ++c) levels(4, 3, c) = 0, levels(5, 3, c) = 1;
  fs::create_directories(root() / "confidence");
  WriteImage(root() / "confidence/000000.png", levels);
  const RgbdCapture capture = ReadRgbdCapture(root(), "stray-scanner");
  EXPECT_THAT(capture.confidence_line, HasSubstr("left out, 0.3 % of the pixels of 1 maps"));
  DepthImage depth =
      ReadDepthOfAnySize(capture.depth / "000000.png", DepthKind::kPlaneZ, 0.001, 80, 60);
  LeaveOutLowConfidence(capture.confidence.FileOf("000000.png"), depth);
  EXPECT_TRUE(DepthImage::IsHole(depth(4, 3)));
  EXPECT_FLOAT_EQ(depth(5, 3), 2.5f);
  WriteImage(root() / "confidence/000000.png", ImageRgb8(15, 20, 3, 2));
  EXPECT_THROW(LeaveOutLowConfidence(capture.confidence.FileOf("000000.png"), depth), Error);
}

TEST_F(Rgbd, StrayScannerPhotosMayBeShrunk) {
  Write(root() / "odometry.csv", "timestamp,frame,x,y,z,qx,qy,qz,qw\n0,000000,0,0,0,0,0,0,1\n");
  Write(root() / "camera_matrix.csv", "1400,0,970\n0,1410,715\n0,0,1\n");
  WritePhoto(root() / "rgb/000000.jpg", 96, 72);
  const PinholeCamera camera = ReadRgbdCapture(root(), "stray-scanner").list.cameras[0].camera;
  EXPECT_NEAR(camera.fx_px(), 70, 1e-9);
  EXPECT_NEAR(camera.cy_px(), 35.75, 1e-9);
}

TEST_F(Rgbd, ArkitScenes) {
  std::string trajectory;
  for (size_t i = 0; i < 3; ++i) {
    const std::string stem = fmt::format("47333462_{}.{:03}", 100 + i, 117 * i);
    WritePhoto(root() / "lowres_wide" / (stem + ".png"));
    WriteDepthMm(root() / "lowres_depth" / (stem + ".png"));
    Write(root() / "lowres_wide_intrinsics" / (stem + ".pincam"),
          fmt::format("80 60 {} {} {} {}", kK(0, 0), kK(1, 1), kK(0, 2), kK(1, 2)));
    // cam_from_world as axis times angle.
    const Matrix3d r = Frames()[i].world_from_cam.transpose();
    const Eigen::AngleAxisd turn(r);
    const Vector3d a = turn.angle() * turn.axis(), t = -(r * Frames()[i].centre);
    trajectory += fmt::format("{}.{:03} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g}\n", 100 + i,
                              117 * i, a.x(), a.y(), a.z(), t.x(), t.y(), t.z());
  }
  Write(root() / "lowres_wide.traj", trajectory);
  WritePhoto(root() / "lowres_wide/47333462_100.050.png");  // between poses
  EXPECT_EQ(RgbdFormatOf(root()), "arkitscenes");
  const RgbdCapture capture = ReadRgbdCapture(root(), "arkitscenes");
  ExpectCameras(capture, 0.5);
  EXPECT_THAT(capture.skipped, SizeIs(1));
  EXPECT_EQ(capture.list.cameras[0].depth_file, "47333462_100.000.png");
  ExpectCutsNoticed(root(), root() / "lowres_wide.traj", "arkitscenes");
  ExpectCutsNoticed(root(), root() / "lowres_wide_intrinsics/47333462_101.117.pincam",
                    "arkitscenes");
}

TEST_F(Rgbd, ScanNet) {
  for (size_t i = 0; i < 3; ++i) {
    const std::string stem = std::to_string(10 * i);
    WritePhoto(root() / "color" / (stem + ".jpg"));
    WriteDepthMm(root() / "depth" / (stem + ".png"));
    Write(root() / "pose" / (stem + ".txt"),
          Rows(Transform(Frames()[i].world_from_cam, Frames()[i].centre)));
  }
  WritePhoto(root() / "color/30.jpg");
  Write(root() / "pose/30.txt",
        "-inf -inf -inf -inf\n-inf -inf -inf -inf\n-inf -inf -inf -inf\n"
        "-inf -inf -inf -inf\n");
  // The matrix is of the scanner's photos, 1296x968; these are 80x60 (another shape by 0.4 %).
  Eigen::Matrix4d k = Eigen::Matrix4d::Identity();
  k.topLeftCorner<3, 3>() = kK;
  k.row(0) *= 1296.0 / 80, k.row(1) *= 968.0 / 60;
  // Pixels are counted from the centre of the first.
  k(0, 2) += 0.5 * 1296 / 80 - 0.5, k(1, 2) += 0.5 * 968 / 60 - 0.5;
  Write(root() / "intrinsic/intrinsic_color.txt", Rows(k));
  Eigen::Matrix4d d = k;
  d.row(0) *= 640.0 / 1296, d.row(1) *= 480.0 / 968;
  d(2, 2) = 1;
  Write(root() / "intrinsic/intrinsic_depth.txt", Rows(d));
  EXPECT_EQ(RgbdFormatOf(root()), "scannet");
  const RgbdCapture capture = ReadRgbdCapture(root(), "scannet");
  ExpectCameras(capture, 0);
  EXPECT_THAT(capture.skipped, SizeIs(1));
  ExpectCutsNoticed(root(), root() / "pose/20.txt", "scannet");
  ExpectCutsNoticed(root(), root() / "intrinsic/intrinsic_color.txt", "scannet");
  // A depth camera that sees something else.
  d(0, 2) += 12;
  Write(root() / "intrinsic/intrinsic_depth.txt", Rows(d));
  EXPECT_THAT(ErrorOf(root(), "scannet"), HasSubstr("depth maps are of another camera"));
}

TEST_F(Rgbd, Tum) {
  std::string rgb = "# color images\n# timestamp filename\n", depth = "# depth maps\n",
              poses = "# pose\n";
  for (size_t i = 0; i < 3; ++i) {
    const double time = 1305031102.175304 + 0.25 * static_cast<double>(i);
    WritePhoto(root() / "rgb" / fmt::format("{:.6f}.png", time));
    WriteDepthMm(root() / "depth" / fmt::format("{:.6f}.png", time - 0.012));
    rgb += fmt::format("{:.6f} rgb/{:.6f}.png\n", time, time);
    depth += fmt::format("{:.6f} depth/{:.6f}.png\n", time - 0.012, time - 0.012);
    const Quaterniond q(Frames()[i].world_from_cam);
    const Vector3d c = Frames()[i].centre;
    // Around the photo's time; the pose there lies between the two.
    for (const double side : {-1.0, 1.0}) {
      const Quaterniond turned = q * Quaterniond(Eigen::AngleAxisd(side * 0.01, Vector3d::UnitX()));
      poses += fmt::format("{:.6f} {:.9f} {:.9f} {:.9f} {:.12f} {:.12f} {:.12f} {:.12f}\n",
                           time + side * 0.004, c.x() + side * 0.01, c.y(), c.z(), turned.x(),
                           turned.y(), turned.z(), turned.w());
    }
  }
  WritePhoto(root() / "rgb/late.png");
  rgb += "1305031110.0 rgb/late.png\n";
  Write(root() / "rgb.txt", rgb);
  Write(root() / "depth.txt", depth);
  Write(root() / "groundtruth.txt", poses);
  EXPECT_EQ(RgbdFormatOf(root()), "tum");
  EXPECT_THAT(ErrorOf(root(), "tum"), HasSubstr("camera-intrinsics.txt"));
  Write(root() / "camera-intrinsics.txt", Rows(kK));
  const RgbdCapture capture = ReadRgbdCapture(root(), "tum");
  ExpectCameras(capture, 0);
  EXPECT_EQ(capture.depth_unit_m, 1.0 / 5000);
  EXPECT_EQ(capture.list.cameras[0].depth_file, "depth/1305031102.163304.png");
  EXPECT_THAT(capture.skipped, SizeIs(1));
  ExpectCutsNoticed(root(), root() / "groundtruth.txt", "tum");
}

TEST_F(Rgbd, TumCamerasOfTheBenchmarkHaveTheirPublishedDistortion) {
  const fs::path folder = root() / "rgbd_dataset_freiburg1_desk";
  WritePhoto(folder / "rgb/a.png", 640, 480);
  Write(folder / "rgb.txt", "1 rgb/a.png\n");
  Write(folder / "groundtruth.txt", "1 0 0 0 0 0 0 1\n");
  const RgbdCapture capture = ReadRgbdCapture(folder, "tum");
  ASSERT_TRUE(capture.list.cameras[0].distortion);
  EXPECT_EQ(capture.list.cameras[0].distortion->model, "FULL_OPENCV");
  EXPECT_EQ(capture.list.cameras[0].distortion->params,
            (std::vector<double>{517.3, 516.5, 319.1, 255.8, 0.2624, -0.9531, -0.0054, 0.0026,
                                 1.1633, 0, 0, 0}));
  EXPECT_THAT(capture.notes, ::testing::Contains(HasSubstr("1 of 1 photos have no depth map")));
}

TEST_F(Rgbd, Open3d) {
  std::string log;
  for (size_t i = 0; i < 3; ++i) {
    WritePhoto(root() / "color" / fmt::format("{:05}.jpg", 6 * i));
    WriteDepthMm(root() / "depth" / fmt::format("{:05}.png", 6 * i));
    log += fmt::format("{} {} {}\n", 6 * i, 6 * i, 6 * i + 1) +
           Rows(Transform(Frames()[i].world_from_cam, Frames()[i].centre));
  }
  Write(root() / "trajectory.log", log);
  Write(root() / "camera_intrinsic.json",
        fmt::format(
            R"({{"width": 80, "height": 60, "intrinsic_matrix": [{}, 0, 0, 0, {}, 0, {}, {}, 1]}})",
            kK(0, 0), kK(1, 1), kK(0, 2), kK(1, 2)));
  EXPECT_EQ(RgbdFormatOf(root()), "open3d");
  const RgbdCapture capture = ReadRgbdCapture(root(), "open3d");
  ExpectCameras(capture, 0);
  EXPECT_EQ(capture.list.cameras[2].depth_file, "00012.png");
  ExpectCutsNoticed(root(), root() / "trajectory.log", "open3d");
  ExpectCutsNoticed(root(), root() / "camera_intrinsic.json", "open3d");
}

TEST_F(Rgbd, SevenScenes) {
  for (size_t i = 0; i < 3; ++i) {
    const std::string stem = fmt::format("frame-{:06}", 25 * i);
    WritePhoto(root() / (stem + ".color.png"));
    WriteDepthMm(root() / (stem + ".depth.png"));
    Write(root() / (stem + ".pose.txt"),
          Rows(Transform(Frames()[i].world_from_cam, Frames()[i].centre)));
  }
  Write(root() / "camera-intrinsics.txt", Rows(kK));
  EXPECT_EQ(RgbdFormatOf(root()), "7scenes");
  const RgbdCapture capture = ReadRgbdCapture(root(), "7scenes");
  ExpectCameras(capture, 0);
  EXPECT_EQ(capture.list.cameras[1].depth_file, "frame-000025.depth.png");
  ExpectCutsNoticed(root(), root() / "frame-000025.pose.txt", "7scenes");
  // A pose that is no rotation.
  Write(root() / "frame-000025.pose.txt", "1 0 0 0 0 2 0 0 0 0 1 0 0 0 0 1\n");
  EXPECT_THAT(ErrorOf(root(), "7scenes"), HasSubstr("frame-000025.pose.txt"));
}

TEST(RgbdReal, SevenScenesRedKitchen) {
  const fs::path folder = testing::DataFolder() / "7scenes_redkitchen";
  DTR_REQUIRE_DATA(folder);
  ASSERT_EQ(RgbdFormatOf(folder), "7scenes");
  const RgbdCapture capture = ReadRgbdCapture(folder, "7scenes");
  ASSERT_THAT(capture.list.cameras, SizeIs(16));
  EXPECT_THAT(capture.skipped, SizeIs(0));
  EXPECT_EQ(capture.list.cameras[3].name, "frame-000075.color.jpg");
  EXPECT_EQ(capture.list.cameras[3].depth_file, "frame-000075.depth.png");
  EXPECT_EQ(capture.list.cameras[3].camera, PinholeCamera(640, 480, 585, 585, 320.5, 240.5));
}

TEST(RgbdReal, LivingRoomOfOpen3d) {
  const fs::path folder = testing::DataFolder() / "livingroom_clean_rgbd";
  DTR_REQUIRE_DATA(folder);
  ASSERT_EQ(RgbdFormatOf(folder), "open3d");
  const RgbdCapture capture = ReadRgbdCapture(folder, "open3d");
  ASSERT_THAT(capture.list.cameras, SizeIs(16));
  EXPECT_EQ(capture.list.cameras[1].name, "00126.jpg");
  EXPECT_EQ(capture.list.cameras[1].depth_file, "00126.png");
  EXPECT_EQ(capture.list.cameras[1].camera, PinholeCamera(640, 480, 525, 525, 320, 240));
  EXPECT_THAT(capture.notes, ::testing::Contains(HasSubstr("Open3D's default")));
}

TEST_F(Rgbd, OtherFoldersAreNoCaptures) {
  EXPECT_EQ(RgbdFormatOf(root()), "");
  Write(root() / "cameras.txt", "# COLMAP");
  EXPECT_EQ(RgbdFormatOf(root()), "");
  EXPECT_EQ(RgbdFormatOf(root() / "nothing"), "");
}

TEST_F(Rgbd, ACaptureWithoutAPhotoIsAnError) {
  Write(root() / "keyframes/cameras/1.json", PolycamJson(Frames()[0]));
  EXPECT_THAT(ErrorOf(root(), "polycam"), HasSubstr("none is left"));
}

}  // namespace
}  // namespace dtr::io
