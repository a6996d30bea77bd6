// Hand-worked numbers for every foreign camera format; the real sets are tested in convert_test.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <numbers>

#include "dtr/base/error.h"
#include "dtr/io/formats/llff.h"
#include "dtr/io/formats/pose_from_matrix.h"
#include "dtr/io/formats/text_cameras.h"
#include "dtr/io/formats/transforms_json.h"
#include "tests/support/test_data.h"

namespace dtr::io {
namespace {

using ::testing::HasSubstr;

constexpr double kExact = 1e-12;  // a few operations in double on numbers below 1000

// Not synced to disk: some tests write hundreds of files.
void Write(const std::filesystem::path& file, const std::string& content) {
  std::ofstream(file, std::ios::binary) << content;
}

template <typename Body>
std::string ErrorOf(const Body& body) {
  try {
    body();
  } catch (const Error& e) {
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
    return e.what();
  }
  return "no error";
}

// All prefixes that lose a word or more are rejected. (Losing digits of the last number alone
// leaves a good text: none of these formats has an end mark.)
template <typename Reader>
void ExpectPrefixesRejected(const std::string& good, const Reader& read) {
  testing::TemporaryFolder folder;
  const size_t last_word = good.find_last_of(" \n", good.find_last_not_of(" \n"));
  for (size_t length = 0; length <= last_word; ++length) {
    Write(folder / "t", good.substr(0, length));
    EXPECT_THROW(read(folder / "t"), Error) << length;
  }
}

TEST(CameraFromK, CentreOriginGainsHalfAPixel) {
  Eigen::Matrix3d k;
  k << 525, 0, 319.5, 0, 526, 239.5, 0, 0, 1;
  EXPECT_EQ(CameraFromK(k, 640, 480, PixelOrigin::kCentre, "K"),
            PinholeCamera(640, 480, 525, 526, 320, 240));
  EXPECT_EQ(CameraFromK(2 * k, 640, 480, PixelOrigin::kCorner, "K"),
            PinholeCamera(640, 480, 525, 526, 319.5, 239.5));
}

TEST(CameraFromK, WhatIsNoPinholeIsRejected) {
  const auto with = [](int row, int column, double value) {
    Eigen::Matrix3d k = Eigen::Vector3d(5, 5, 1).asDiagonal();
    k(row, column) = value;
    return ErrorOf([&] { CameraFromK(k, 4, 4, PixelOrigin::kCorner, "K of a"); });
  };
  EXPECT_THAT(with(0, 1, 0.1), HasSubstr("K of a: expected a skew"));
  EXPECT_THAT(with(0, 0, -5), HasSubstr("positive focal"));
  EXPECT_THAT(with(1, 0, 1), HasSubstr("calibration matrix"));
  EXPECT_THAT(with(2, 2, 0), HasSubstr("calibration matrix"));
  EXPECT_THAT(with(0, 2, NAN), HasSubstr("calibration matrix"));
}

TEST(MiddleburyPar, RowsAreWorldToCamera) {
  const std::string good = "1\na.png 10 0 3 0 11 2 0 0 1 0 -1 0 1 0 0 0 0 1 1 2 3\n";
  testing::TemporaryFolder folder;
  Write(folder / "par.txt", good);
  const auto cameras = ReadMiddleburyPar(folder / "par.txt");
  ASSERT_EQ(cameras.size(), 1u);
  EXPECT_EQ(cameras[0].name, "a.png");
  EXPECT_EQ(cameras[0].k(1, 2), 2);
  const Eigen::Vector3d p_in_cam = cameras[0].cam_from_world * Eigen::Vector3d(10, 20, 30);
  EXPECT_LT((p_in_cam - Eigen::Vector3d(-19, 12, 33)).norm(), kExact);
  ExpectPrefixesRejected(good, ReadMiddleburyPar);
  Write(folder / "more.txt", good + "b.png\n");
  EXPECT_THAT(ErrorOf([&] { ReadMiddleburyPar(folder / "more.txt"); }),
              HasSubstr("more.txt:3: expected the end"));
  Write(folder / "huge.txt", "2000000000\n");
  EXPECT_THAT(ErrorOf([&] { ReadMiddleburyPar(folder / "huge.txt"); }), HasSubstr("whole number"));
}

TEST(StrechaCamera, RotationIsCameraToWorldAndTheCentreIsGiven) {
  const std::string good = "10 0 3\n0 11 2\n0 0 1\n0 0 0\n0 -1 0\n1 0 0\n0 0 1\n7 8 9\n640 480\n";
  testing::TemporaryFolder folder;
  Write(folder / "a.camera", good);
  const StrechaCamera camera = ReadStrechaCamera(folder / "a.camera");
  EXPECT_EQ(camera.width_px, 640);
  EXPECT_EQ(camera.height_px, 480);
  const Eigen::Vector3d center = camera.cam_from_world.TargetOriginInSource();
  EXPECT_LT((center - Eigen::Vector3d(7, 8, 9)).norm(), kExact);
  // X_cam = R^T (X - C): one step along world x is one step along -y of the camera.
  const Eigen::Vector3d p_in_cam = camera.cam_from_world * Eigen::Vector3d(8, 8, 9);
  EXPECT_LT((p_in_cam - Eigen::Vector3d(0, -1, 0)).norm(), kExact);
  ExpectPrefixesRejected(good, ReadStrechaCamera);
  std::string distorted = good;
  distorted.replace(distorted.find("0 0 0"), 5, "0 .1 0");
  Write(folder / "d.camera", distorted);
  EXPECT_THAT(ErrorOf([&] { ReadStrechaCamera(folder / "d.camera"); }), HasSubstr("undistort"));
}

TEST(Open3dLog, PosesAreCameraToWorld) {
  const std::string good = "5 5 6\n0 -1 0 7\n1 0 0 8\n0 0 1 9\n0 0 0 1\n";
  testing::TemporaryFolder folder;
  Write(folder / "a.log", good);
  const auto poses = ReadOpen3dLog(folder / "a.log");
  ASSERT_EQ(poses.size(), 1u);
  EXPECT_EQ(poses[0].id, 5);
  const Eigen::Vector3d center = poses[0].cam_from_world.TargetOriginInSource();
  EXPECT_LT((center - Eigen::Vector3d(7, 8, 9)).norm(), kExact);
  ExpectPrefixesRejected(good, ReadOpen3dLog);
  Write(folder / "twice.log", good + good);
  EXPECT_THAT(ErrorOf([&] { ReadOpen3dLog(folder / "twice.log"); }), HasSubstr("twice.log:6"));
}

TEST(WorldFromCamText, ThePoseIsInverted) {
  const std::string good = "0 -1 0 7\n1 0 0 8\n0 0 1 9\n0 0 0 1\n";
  testing::TemporaryFolder folder;
  Write(folder / "pose.txt", good);
  const Eigen::Vector3d center = ReadWorldFromCamText(folder / "pose.txt").TargetOriginInSource();
  EXPECT_LT((center - Eigen::Vector3d(7, 8, 9)).norm(), kExact);
  ExpectPrefixesRejected(good, ReadWorldFromCamText);
  Write(folder / "nan.txt", "nan" + good.substr(1));
  EXPECT_THAT(ErrorOf([&] { ReadWorldFromCamText(folder / "nan.txt"); }),
              HasSubstr("nan.txt:1: expected a 4x4 pose as a finite number, found \"nan\""));
}

// A .npy file of one LLFF row per camera: identity-like axes, centre (7, 8, 9), 40x30 px, f = 50.
std::string LlffFile(size_t rows, double near_z = 1) {
  // Camera looking along world +y: right = x, down = -z, forward = y, so backwards = -y.
  const std::vector<double> row = {0,  1, 0,  7, 30,  //
                                   0,  0, -1, 8, 40,  //
                                   -1, 0, 0,  9, 50, near_z, 5};
  const std::string dictionary =
      "{'descr': '<f8', 'fortran_order': False, 'shape': (" + std::to_string(rows) + ", 17), }\n";
  std::string bytes("\x93NUMPY\x01\0", 8);
  bytes += static_cast<char>(dictionary.size());
  bytes += '\0';
  bytes += dictionary;
  for (size_t i = 0; i < rows * 17; ++i) {
    const auto bits = std::bit_cast<std::uint64_t>(row[i % 17]);
    for (int b = 0; b < 8; ++b) bytes += static_cast<char>(bits >> (8 * b) & 0xff);
  }
  return bytes;
}

TEST(Llff, AxesAreDownRightBackwardsAndIntrinsicsFollowTheImage) {
  testing::TemporaryFolder folder;
  Write(folder / "p.npy", LlffFile(2));
  const LlffCameras cameras = ReadLlff(folder / "p.npy", {{"b.png", 40, 30}, {"a.png", 20, 15}});
  ASSERT_EQ(cameras.list.cameras.size(), 2u);
  EXPECT_EQ(cameras.list.cameras[0].name, "a.png");  // byte order, not the order given
  EXPECT_EQ(cameras.list.cameras[0].camera, PinholeCamera(20, 15, 25, 25, 10, 7.5));
  EXPECT_EQ(cameras.list.cameras[1].camera, PinholeCamera(40, 30, 50, 50, 20, 15));
  EXPECT_EQ(cameras.near_z[0], 1);
  EXPECT_EQ(cameras.far_z[1], 5);
  // 3 to the right (x), 2 up (z), 10 ahead (y).
  const Eigen::Vector3d p_in_cam =
      cameras.list.cameras[0].cam_from_world * Eigen::Vector3d(7 + 3, 8 + 10, 9 + 2);
  EXPECT_LT((p_in_cam - Eigen::Vector3d(3, -2, 10)).norm(), kExact);
}

TEST(Llff, FilesThatDoNotFitTheImagesAreRejected) {
  testing::TemporaryFolder folder;
  Write(folder / "p.npy", LlffFile(1));
  EXPECT_THAT(ErrorOf([&] { ReadLlff(folder / "p.npy", {}); }), HasSubstr("as many rows"));
  EXPECT_THAT(ErrorOf([&] {
                ReadLlff(folder / "p.npy", {{"a.png", 30, 40}});
              }),
              HasSubstr("neither rotated nor cropped"));
  Write(folder / "far.npy", LlffFile(1, 6));
  EXPECT_THAT(ErrorOf([&] {
                ReadLlff(folder / "far.npy", {{"a.png", 40, 30}});
              }),
              HasSubstr("0 < near < far"));
}

const std::string kTransforms = R"({"w": 40, "h": 30, "fl_x": 50, "fl_y": 51, "cx": 21, "cy": 14,
  "frames": [{"file_path": "./images/a", "depth_file_path": "depth/a.png",
  "transform_matrix": [[1,0,0,7],[0,0,-1,8],[0,1,0,9],[0,0,0,1]]}]})";

CameraList Transforms(const std::string& text) {
  testing::TemporaryFolder folder;
  Write(folder / "transforms.json", text);
  TransformsPaths paths;
  paths.image_of = [](const std::string& path) { return SizedImage{path + ".png", 20, 15}; };
  return ReadTransformsJson(folder / "transforms.json", paths).list;
}

std::string TransformsWith(const std::string& from, const std::string& to) {
  std::string text = kTransforms;
  return text.replace(text.find(from), from.size(), to);
}

TEST(TransformsJson, PosesAreOpenGlCameraToWorld) {
  const CameraList list = Transforms(kTransforms);
  ASSERT_EQ(list.cameras.size(), 1u);
  EXPECT_EQ(list.cameras[0].name, "images/a.png");
  EXPECT_EQ(list.cameras[0].depth_file, "depth/a.png");
  EXPECT_EQ(list.cameras[0].camera, PinholeCamera(20, 15, 25, 25.5, 10.5, 7));
  // gl axes: right = x, up = z, back = -y, so the camera looks along +y.
  const Eigen::Vector3d p_in_cam =
      list.cameras[0].cam_from_world * Eigen::Vector3d(7 + 3, 8 + 10, 9 + 2);
  EXPECT_LT((p_in_cam - Eigen::Vector3d(3, -2, 10)).norm(), kExact);
}

TEST(TransformsJson, AnAngleAloneGivesTheFocalLength) {
  const std::string text =
      TransformsWith(R"("w": 40, "h": 30, "fl_x": 50, "fl_y": 51, "cx": 21, "cy": 14)",
                     "\"camera_angle_x\": " + std::to_string(std::numbers::pi / 2));
  const PinholeCamera camera = Transforms(text).cameras[0].camera;
  EXPECT_NEAR(camera.fx_px(), 10, 1e-5);  // 20 / 2 / tan(45 degrees); six digits of pi above
  EXPECT_EQ(camera.fy_px(), camera.fx_px());
  EXPECT_EQ(camera.cx_px(), 10);
  EXPECT_EQ(camera.cy_px(), 7.5);
}

TEST(TransformsJson, AFocalLengthBeyondAllNumbersIsRejected) {
  const auto with = [](const std::string& fields) {
    return ErrorOf([&] {
      Transforms(TransformsWith(R"("w": 40, "h": 30, "fl_x": 50, "fl_y": 51, "cx": 21, "cy": 14)",
                                fields));
    });
  };
  EXPECT_THAT(with(R"("camera_angle_x": 1e-320)"), HasSubstr("expected an angle of view"));
  EXPECT_THAT(with(R"("w": 4, "h": 3, "fl_x": 1e308)"),
              HasSubstr("a focal length of 1e+308 px cannot be"));
  EXPECT_THAT(with(R"("w": 400, "h": 300, "fl_x": 5e-324)"),
              HasSubstr("a focal length of 4.94066e-324 px cannot be"));
}

TEST(TransformsJson, WhatWouldBeReadWronglyIsRejected) {
  const auto with = [](const std::string& from, const std::string& to) {
    return ErrorOf([&] { Transforms(TransformsWith(from, to)); });
  };
  EXPECT_THAT(with("\"w\"", "\"camera_model\": \"EQUIRECTANGULAR\", \"w\""),
              HasSubstr("camera_model: cannot be used"));
  EXPECT_THAT(with("\"w\"", "\"camera_model\": \"OPENCV\", \"is_fisheye\": true, \"w\""),
              HasSubstr("is_fisheye conflicts with camera_model OPENCV"));
  EXPECT_THAT(with("\"w\"", "\"k4\": 0.1, \"w\""), HasSubstr("FULL_OPENCV"));
  EXPECT_THAT(with("\"w\"", "\"s1\": 0.1, \"w\""), HasSubstr("prism"));
  EXPECT_THAT(with("\"w\"", "\"is_fisheye\": true, \"p1\": 0.1, \"w\""),
              HasSubstr("has k1 to k4 only"));
  EXPECT_THAT(with("\"w\": 40,", ""), HasSubstr("w and h together"));
  EXPECT_THAT(with("\"fl_x\": 50,", ""), HasSubstr("camera_angle_x"));
  EXPECT_THAT(with("./images", "../images"), HasSubstr("leaves its folder"));
  EXPECT_THAT(with("[0,1,0,9]", "[0,-1,0,9]"), HasSubstr("mirroring"));
  EXPECT_THAT(with("[0,1,0,9]", "[0,2,0,9]"), HasSubstr("rotation matrix"));
  EXPECT_THAT(with("\"h\": 30", "\"h\": 60"), HasSubstr("neither rotated nor cropped"));
  EXPECT_THAT(ErrorOf([&] { Transforms("{\"frames\": [3]}"); }), HasSubstr("expected an object"));
}

std::optional<Distortion> DistortionWith(const std::string& fields) {
  return Transforms(TransformsWith("\"w\"", fields + ", \"w\"")).cameras.at(0).distortion;
}

TEST(TransformsJson, DistortionComesWithItsModel) {
  const std::vector<double> pinhole = {25, 25.5, 10.5, 7};  // at the image's size
  const auto with = [&](std::vector<double> more) {
    more.insert(more.begin(), pinhole.begin(), pinhole.end());
    return more;
  };
  EXPECT_EQ(DistortionWith(R"("k1": 0, "k2": 0.0, "p1": 0)"), std::nullopt);
  EXPECT_EQ(DistortionWith(R"("k1": 0.05)"), (Distortion{"OPENCV", with({0.05, 0, 0, 0})}));
  EXPECT_EQ(DistortionWith(R"("k1": 0.05, "p2": 0.01, "k3": 0.2)"),
            (Distortion{"FULL_OPENCV", with({0.05, 0, 0, 0.01, 0.2, 0, 0, 0})}));
  EXPECT_EQ(DistortionWith(R"("camera_model": "FULL_OPENCV", "k4": 0.3)"),
            (Distortion{"FULL_OPENCV", with({0, 0, 0, 0, 0, 0.3, 0, 0})}));
  const Distortion fisheye{"OPENCV_FISHEYE", with({0.1, 0, 0, 0.4})};
  EXPECT_EQ(DistortionWith(R"("camera_model": "OPENCV_FISHEYE", "k1": 0.1, "k4": 0.4)"), fisheye);
  EXPECT_EQ(DistortionWith(R"("is_fisheye": 1, "k1": 0.1, "k4": 0.4)"), fisheye);
}

TEST(TransformsJson, AFlagThatIsFalseIsNoFisheye) {
  for (const char* flag : {"0", "0.0", "false", "null"}) {
    EXPECT_EQ(DistortionWith(std::string(R"("is_fisheye": )") + flag), std::nullopt) << flag;
  }
}

TransformsFile FileOf(const std::string& text, const std::vector<std::string>& photos) {
  testing::TemporaryFolder folder;
  Write(folder / "transforms.json", text);
  TransformsPaths paths;
  paths.image_of = [&](const std::string& path) -> std::optional<SizedImage> {
    for (const std::string& photo : photos) {
      if (photo == path) return SizedImage{path, 20, 15};
    }
    return std::nullopt;
  };
  return ReadTransformsJson(folder / "transforms.json", paths);
}

const std::string kThree =
    R"({"fl_x": 50, "w": 20, "h": 15, "aabb_scale": 16, "applied_transform": [], "frames": [
  {"file_path": "./a.jpg", "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,0]]},
  {"file_path": "b.jpg", "transform_matrix": [[1,0,0,1],[0,1,0,0],[0,0,1,0]], "sharpness": 3},
  {"file_path": "c.jpg", "transform_matrix": [[1,0,0,2],[0,1,0,0],[0,0,1,0]]}])";

TEST(TransformsJson, FramesWithoutAPhotoAreListed) {
  const TransformsFile file = FileOf(kThree + "}", {"a.jpg", "c.jpg"});
  EXPECT_EQ(file.list.cameras.size(), 2u);
  ASSERT_EQ(file.missing.size(), 1u);
  EXPECT_EQ(file.missing[0].frame, 1u);
  EXPECT_EQ(file.missing[0].path, "b.jpg");
  EXPECT_EQ(file.held_out, std::nullopt);
}

TEST(TransformsJson, WhatIsNotUsedIsNamed) {
  const TransformsFile file = FileOf(kThree + "}", {"a.jpg", "b.jpg", "c.jpg"});
  ASSERT_EQ(file.notes.size(), 1u);
  EXPECT_THAT(file.notes[0],
              HasSubstr("fields that are not used: aabb_scale, applied_transform, sharpness"));
}

TEST(TransformsJson, ListsOfNamesSayWhatIsHeldOut) {
  const TransformsFile file = FileOf(
      kThree + R"(, "train_filenames": ["a.jpg", "./gone.jpg"], "test_filenames": ["./b.jpg"],
                          "val_filenames": ["a.jpg"]})",
      {"a.jpg", "b.jpg", "c.jpg"});
  EXPECT_EQ(file.held_out, (std::set<std::string>{"b.jpg"}));
  ASSERT_EQ(file.notes.size(), 3u);
  EXPECT_THAT(file.notes[0], HasSubstr("1 frames are in none"));
  EXPECT_THAT(file.notes[1], HasSubstr("those of no frame, first gone.jpg"));
}

TEST(TransformsJson, DepthUnitsOfTheFileAreRead) {
  EXPECT_EQ(FileOf(kThree + R"(, "depth_unit_scale_factor": 0.001})", {"a.jpg"}).depth_unit, 0.001);
  EXPECT_EQ(FileOf(kThree + R"(, "integer_depth_scale": 0.01})", {"a.jpg"}).depth_unit, 0.01);
  EXPECT_THAT(ErrorOf([&] { FileOf(kThree + R"(, "integer_depth_scale": 0})", {"a.jpg"}); }),
              HasSubstr("positive depth unit"));
}

TEST(TransformsJson, OfATurnedPhotoTheShapeSaysWhichPixelsAreMeant) {
  testing::TemporaryFolder folder;
  const auto camera = [&](int width, int height) {
    Write(folder / "transforms.json",
          TransformsWith("\"w\": 40, \"h\": 30",
                         "\"w\": " + std::to_string(width) + ", \"h\": " + std::to_string(height)));
    TransformsPaths paths;
    paths.image_of = [](const std::string& path) { return SizedImage{path, 20, 15, 6}; };
    return ReadTransformsJson(folder / "transforms.json", paths).list.cameras.at(0).camera;
  };
  EXPECT_EQ(camera(40, 30).width_px(), 20);
  EXPECT_EQ(camera(30, 40).width_px(), 15);
  EXPECT_EQ(camera(30, 40).height_px(), 20);
}

TEST(TransformsJson, EveryTruncatedPrefixIsRejected) {
  for (size_t length = 0; length < kTransforms.size(); ++length) {
    EXPECT_THROW(Transforms(kTransforms.substr(0, length)), Error) << length;
  }
}

}  // namespace
}  // namespace dtr::io
