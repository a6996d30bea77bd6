// Cameras and rigs of other calibration programs: points are where these programs put them.
#include "calib/files/rig_files.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/temporary_folder.h"
#include "tests/support/message_of.h"
#include "tests/support/test_data.h"
#include "tests/support/truncation.h"

namespace dtr::calib {
namespace {

using dtr::testing::MessageOf;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kPx = 1e-9;

// The programs count pixels from the centre of the first one; we from its corner.
void ExpectPixel(const LensCamera& camera, const Eigen::Vector3d& p, double u, double v) {
  const auto pixel = camera.PixelFromCam(p);
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x(), u + 0.5, kPx);
  EXPECT_NEAR(pixel->y(), v + 0.5, kPx);
}

const Eigen::Vector3d kPoint(0.3, -0.2, 0.8);

CameraFile Read(const char* name, const std::string& text) {
  const TemporaryFolder folder;
  WriteFileAtomically(folder.path() / name, text);
  return ReadCamerasOf(folder.path() / name);
}

std::string Chain(const std::string& model, const std::string& intrinsics,
                  const std::string& distortion, const std::string& terms) {
  return fmt::format(
      "cam0:\n  cam_overlaps: [1]\n  camera_model: {}\n  distortion_coeffs: {}\n  "
      "distortion_model: {}\n  intrinsics: {}\n  resolution: [640, 480]\n  rostopic: /cam0\n",
      model, terms, distortion, intrinsics);
}

TEST(RigFiles, KalibrPutsPointsWhereItsModelsDo) {
  const double x = kPoint.x() / kPoint.z(), y = kPoint.y() / kPoint.z(), r2 = x * x + y * y;
  {  // radtan: OpenCV's k1 k2 p1 p2
    const auto file = Read("a.yaml", Chain("pinhole", "[500, 510, 319.5, 241]", "radtan",
                                           "[-0.2, 0.05, 0.002, -0.003]"));
    ASSERT_EQ(file.cameras.size(), 1u);
    const double radial = 1 - 0.2 * r2 + 0.05 * r2 * r2;
    ExpectPixel(file.cameras[0].camera, kPoint,
                500 * (x * radial + 2 * 0.002 * x * y - 0.003 * (r2 + 2 * x * x)) + 319.5,
                510 * (y * radial + 0.002 * (r2 + 2 * y * y) - 2 * 0.003 * x * y) + 241);
    EXPECT_TRUE(file.metric);
  }
  {  // equidistant
    const auto file = Read("a.yaml", Chain("pinhole", "[500, 510, 319.5, 241]", "equidistant",
                                           "[0.1, 0.02, -0.01, 0.004]"));
    const double r = std::sqrt(r2), a = std::atan(r), s = a * a;
    const double d =
        a * (1 + 0.1 * s + 0.02 * s * s - 0.01 * s * s * s + 0.004 * s * s * s * s) / r;
    ExpectPixel(file.cameras[0].camera, kPoint, 500 * x * d + 319.5, 510 * y * d + 241);
  }
  {  // fov, with the list as PyYAML's blocks
    const auto file =
        Read("a.yaml", Chain("pinhole", "[500, 510, 319.5, 241]", "fov", "\n  - 0.9\n"));
    const double r = std::sqrt(r2), d = std::atan(2 * r * std::tan(0.45)) / (0.9 * r);
    ExpectPixel(file.cameras[0].camera, kPoint, 500 * x * d + 319.5, 510 * y * d + 241);
  }
  {  // eucm: alpha beta fu fv pu pv
    const auto file =
        Read("a.yaml", Chain("eucm", "[0.6, 1.1, 500, 510, 319.5, 241]", "none", "[]"));
    const double d = 0.6 * std::sqrt(1.1 * r2 + 1) + 0.4;
    ExpectPixel(file.cameras[0].camera, kPoint, 500 * x / d + 319.5, 510 * y / d + 241);
  }
}

// T_cn_cnm1 takes a point of the camera before to camera n.
TEST(RigFiles, KalibrChainsItsCameras) {
  std::string text = Chain("pinhole", "[500, 510, 319.5, 241]", "radtan", "[0, 0, 0, 0]");
  for (const int n : {1, 2}) {
    std::string next = Chain("pinhole", "[500, 510, 319.5, 241]", "radtan", "[0, 0, 0, 0]");
    next.replace(next.find("cam0:"), 5, fmt::format("cam{}:", n));
    text += next +
            "  T_cn_cnm1:\n  - [0, -1, 0, -0.1]\n  - [1, 0, 0, 0.02]\n  - [0, 0, 1, 0]\n  - "
            "[0, 0, 0, 1]\n  timeshift_cam_imu: 0.001\n";
  }
  const auto file = Read("chain.yaml", text);
  ASSERT_EQ(file.cameras.size(), 3u);
  EXPECT_EQ(file.cameras[2].name, "cam2");
  const auto step = [](const Eigen::Vector3d& p) {
    return Eigen::Vector3d(-p.y() - 0.1, p.x() + 0.02, p.z());
  };
  EXPECT_LT((file.cameras[0].cam_from_rig * kPoint - kPoint).norm(), 1e-12);
  EXPECT_LT((file.cameras[1].cam_from_rig * kPoint - step(kPoint)).norm(), 1e-12);
  EXPECT_LT((file.cameras[2].cam_from_rig * kPoint - step(step(kPoint))).norm(), 1e-12);
}

std::string Mrcal(const std::string& model, const std::string& intrinsics) {
  return "# a camera model\n{\n    'lensmodel':  '" + model +
         "',\n\n    # intrinsics are fx,fy,cx,cy,distortion0,distortion1,....\n    'intrinsics': "
         "[ " +
         intrinsics +
         ",],\n\n    'valid_intrinsics_region': [\n    [ 1, 2 ],\n    ],\n\n    # extrinsics are "
         "rt_fromref\n    'extrinsics': [ 0, 0, 1.5707963267948966, 1, 2, 3,],\n\n    "
         "'imagersize': "
         "[ 640, 480,],\n    'icam_intrinsics': 0,\n}\n";
}

TEST(RigFiles, MrcalPutsPointsWhereItsModelsDo) {
  const auto file = Read("left.cameramodel", Mrcal("LENSMODEL_OPENCV8",
                                                   "500, 510, 319.5, 241, -0.2, 0.05, 0.002, "
                                                   "-0.003, 0.01, 0.03, -0.02, 0.004"));
  ASSERT_EQ(file.cameras.size(), 1u);
  EXPECT_EQ(file.cameras[0].name, "left");
  const double x = kPoint.x() / kPoint.z(), y = kPoint.y() / kPoint.z(), r2 = x * x + y * y;
  const double radial = (1 - 0.2 * r2 + 0.05 * r2 * r2 + 0.01 * r2 * r2 * r2) /
                        (1 + 0.03 * r2 - 0.02 * r2 * r2 + 0.004 * r2 * r2 * r2);
  ExpectPixel(file.cameras[0].camera, kPoint,
              500 * (x * radial + 2 * 0.002 * x * y - 0.003 * (r2 + 2 * x * x)) + 319.5,
              510 * (y * radial + 0.002 * (r2 + 2 * y * y) - 2 * 0.003 * x * y) + 241);
  // A quarter turn about z, then the translation.
  const Eigen::Vector3d moved(-kPoint.y() + 1, kPoint.x() + 2, kPoint.z() + 3);
  EXPECT_LT((file.cameras[0].cam_from_rig * kPoint - moved).norm(), 1e-12);
  const auto pinhole =
      Read("a.cameramodel", Mrcal("LENSMODEL_PINHOLE", "500, 510, 319.5, 241")).cameras[0].camera;
  ExpectPixel(pinhole, kPoint, 500 * x + 319.5, 510 * y + 241);
}

TEST(RigFiles, AStereoPairOfOpenCvIsARig) {
  const auto file = Read(
      "stereo.yml",
      "%YAML:1.0\n---\nM1: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 500., 0., "
      "319.5, 0., 510., 241., 0., 0., 1. ]\nD1: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: "
      "d\n "
      "  data: [ 0.1, 0., 0., 0., 0. ]\nM2: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   "
      "data: [ 400., 0., 300., 0., 400., 200., 0., 0., 1. ]\nD2: !!opencv-matrix\n   rows: 1\n   "
      "cols: 4\n   dt: d\n   data: [ 0., 0., 0., 0. ]\nR: !!opencv-matrix\n   rows: 3\n   cols: "
      "3\n "
      "  dt: d\n   data: [ 0., -1., 0., 1., 0., 0., 0., 0., 1. ]\nT: !!opencv-matrix\n   rows: 3\n "
      "  cols: 1\n   dt: d\n   data: [ -0.1, 0.02, 0. ]\nimage_width: 640\nimage_height: 480\n");
  ASSERT_EQ(file.cameras.size(), 2u);
  EXPECT_EQ(file.cameras[1].name, "right");
  EXPECT_FALSE(file.metric);
  const Eigen::Vector3d p = file.cameras[1].cam_from_rig * kPoint;
  EXPECT_LT((p - Eigen::Vector3d(0.1, 0.32, 0.8)).norm(), 1e-12);
  ExpectPixel(file.cameras[1].camera, p, 400 * 0.1 / 0.8 + 300, 400 * 0.32 / 0.8 + 200);
}

TEST(RigFiles, SettingsOfOrbSlamAreRead) {
  const std::string base =
      "%YAML:1.0\n---\nCamera.type: \"KannalaBrandt8\"\nCamera.width: 640\nCamera.height: "
      "480\nCamera1.fx: 500.0\nCamera1.fy: 510.0\nCamera1.cx: 319.5\nCamera1.cy: "
      "241.0\nCamera1.k1: "
      "0.1\nCamera1.k2: 0.02\nCamera1.k3: -0.01\nCamera1.k4: 0.004\n";
  const auto one = Read("a.yaml", base);
  ASSERT_EQ(one.cameras.size(), 1u);
  EXPECT_EQ(one.cameras[0].camera.params,
            (std::vector<double>{500, 510, 320, 241.5, 0.1, 0.02, -0.01, 0.004}));
  const auto pair =
      Read("a.yaml",
           base +
               "Camera2.fx: 500.0\nCamera2.fy: 510.0\nCamera2.cx: 319.5\nCamera2.cy: 241.0\n"
               "Stereo.T_c1_c2: !!opencv-matrix\n  rows: 4\n  cols: 4\n  dt: f\n  data: [1, 0, 0, "
               "0.11, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n");
  ASSERT_EQ(pair.cameras.size(), 2u);
  EXPECT_LT((pair.cameras[1].cam_from_rig * Eigen::Vector3d(0.11, 0, 0)).norm(), 1e-12);
}

TEST(RigFiles, ModelsThatOursDoNotContainAreNamed) {
  const auto says = [](const std::string& text) {
    return MessageOf<Error>([&] { Read("a.yaml", text); });
  };
  EXPECT_THAT(says(Chain("omni", "[1, 500, 510, 319.5, 241]", "radtan", "[0, 0, 0, 0]")),
              AllOf(HasSubstr("cam0"), HasSubstr("omni with distortion_model radtan")));
  EXPECT_THAT(says(Chain("ds", "[0, 0.5, 500, 510, 319.5, 241]", "none", "[]")),
              HasSubstr("ds with distortion_model none"));
  EXPECT_THAT(says(Mrcal("LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=30_Ny=18_fov_x_deg=150",
                         "500, 510, 319.5, 241")),
              AllOf(HasSubstr("LENSMODEL_SPLINED"), HasSubstr("fit LENSMODEL_OPENCV8")));
  EXPECT_THAT(says(Chain("pinhole", "[3, 3, 319.5, 241]", "radtan", "[0, 0, 0, 0]")),
              HasSubstr("a focal length of 3 px cannot be"));
  EXPECT_THAT(says(Chain("pinhole", "[500, nan, 319.5, 241]", "radtan", "[0, 0, 0, 0]")),
              HasSubstr("expected finite numbers, found 'nan'"));
  EXPECT_THAT(says("M1: [500, 0, 320, 0, 500, 240, 0, 0, 1]\nM2: [500, 0, 320, 0, 500, 240, 0, 0, "
                   "1]\nimage_width: 640\nimage_height: 480\n"),
              HasSubstr("expected R and T"));
}

TEST(RigFiles, EveryPrefixOfAModelIsAnError) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "a.cameramodel";
  std::string text = Mrcal("LENSMODEL_PINHOLE", "500, 510, 319.5, 241");
  text.pop_back();
  WriteFileAtomically(file, text);
  dtr::testing::ExpectEveryPrefixIsAnError(file, 1, [&] { ReadCamerasOf(file); });
}

TEST(RigFiles, FilesOfTheFieldCaseAreRead) {
  const auto folder = dtr::testing::DataFolder() / "field/lens_files";
  DTR_REQUIRE_DATA(folder);
  for (const char* name : {"kalibr-camchain.yaml", "orbslam.yaml", "K_D.yml", "mtx.xml"}) {
    const CameraFile file = ReadCamerasOf(folder / name);
    ASSERT_EQ(file.cameras.size(), 1u) << name;
    const std::vector<double>& p = file.cameras[0].camera.params;
    EXPECT_EQ(std::vector<double>(p.begin(), p.begin() + 6),
              (std::vector<double>{420, 420, 240, 180, 0.0015, 0.0004}))
        << name;
  }
}

}  // namespace
}  // namespace dtr::calib
