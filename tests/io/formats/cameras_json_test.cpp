#include "dtr/io/formats/cameras_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/random.h"
#include "dtr/io/formats/pose_from_matrix.h"
#include "tests/support/test_data.h"

namespace dtr::io {
namespace {

using ::testing::HasSubstr;

const std::string kOneCamera = R"({"views": [{"name": "a.jpg", "depth": "a.exr",
  "width": 4, "height": 3, "fx": 5, "fy": 6, "cx": 2, "cy": 1.5,
  "cam_from_world": [[0,-1,0,1],[1,0,0,2],[0,0,1,3],[0,0,0,1]]}]})";

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

std::string ErrorOf(const std::string& text) {
  try {
    ParseCamerasJson(text, "list.json");
  } catch (const Error& e) {
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
    return e.what();
  }
  return "no error";
}

Eigen::Quaterniond RandomRotation(Random& random) {
  return Eigen::Quaterniond(random.Normal(), random.Normal(), random.Normal(), random.Normal())
      .normalized();
}

CameraList RandomList(int count, std::uint64_t seed) {
  Random random(seed);
  CameraList list;
  for (int i = 0; i < count; ++i) {
    NamedCamera named;
    named.name = "cam" + std::to_string(i) + "/photo.jpg";
    named.camera = PinholeCamera(640, 480, 500 + random.Uniform(), 501, 320.25, 240 - i);
    named.cam_from_world = {RandomRotation(random),
                            {random.Normal(), random.Normal(), random.Normal()}};
    list.cameras.push_back(named);
  }
  return list;
}

TEST(CamerasJson, HandWrittenCameraIsReadNumberByNumber) {
  const CameraList list = ParseCamerasJson(kOneCamera, "list.json");
  ASSERT_EQ(list.cameras.size(), 1u);
  const NamedCamera& named = list.cameras[0];
  EXPECT_EQ(list.unit, LengthUnit::kUnknown);
  EXPECT_EQ(list.world_origin, Eigen::Vector3d::Zero());
  EXPECT_EQ(named.name, "a.jpg");
  EXPECT_EQ(named.depth_file, "a.exr");
  EXPECT_EQ(named.mask_file, "");
  EXPECT_EQ(named.depth_kind, DepthKind::kPlaneZ);
  EXPECT_EQ(named.camera, PinholeCamera(4, 3, 5, 6, 2, 1.5));
  // Rows act on the point: x' = -y + 1, y' = x + 2, z' = z + 3.
  const Eigen::Vector3d p_in_cam = named.cam_from_world * Eigen::Vector3d(10, 20, 30);
  constexpr double kExact = 1e-13;  // one rotation in double
  EXPECT_LT((p_in_cam - Eigen::Vector3d(-19, 12, 33)).norm(), kExact);
}

TEST(CamerasJson, EveryFieldSurvivesWritingAndReading) {
  CameraList list = RandomList(5, 1);
  list.unit = LengthUnit::kMetre;
  list.world_origin = {5e5, 4.5e6, 100};
  list.cameras[1].depth_file = "d/1.exr";
  list.cameras[1].depth_kind = DepthKind::kRayDistance;
  list.cameras[2].mask_file = "2.png";
  testing::TemporaryFolder folder;
  WriteCamerasJson(folder / "cameras.json", list);
  const CameraList back = ReadCamerasJson(folder / "cameras.json");
  EXPECT_EQ(back.unit, list.unit);
  EXPECT_EQ(back.world_origin, list.world_origin);
  ASSERT_EQ(back.cameras.size(), list.cameras.size());
  constexpr double kRounding = 5e-15;  // quaternion to matrix and back: a dozen roundings of 2e-16
  for (size_t i = 0; i < list.cameras.size(); ++i) {
    EXPECT_EQ(back.cameras[i].name, list.cameras[i].name);
    EXPECT_EQ(back.cameras[i].depth_file, list.cameras[i].depth_file);
    EXPECT_EQ(back.cameras[i].mask_file, list.cameras[i].mask_file);
    EXPECT_EQ(back.cameras[i].depth_kind, list.cameras[i].depth_kind);
    EXPECT_EQ(back.cameras[i].camera, list.cameras[i].camera);
    EXPECT_LT((MatrixFromPose(back.cameras[i].cam_from_world) -
               MatrixFromPose(list.cameras[i].cam_from_world))
                  .cwiseAbs()
                  .maxCoeff(),
              kRounding);
  }
}

TEST(CamerasJson, EveryTruncatedPrefixIsRejected) {
  for (size_t length = 0; length < kOneCamera.size(); ++length) {
    EXPECT_THROW(ParseCamerasJson(kOneCamera.substr(0, length), "list.json"), Error) << length;
  }
}

TEST(CamerasJson, WrongFieldsAreNamedInOneLine) {
  const auto with = [](const std::string& from, const std::string& to) {
    return ErrorOf(Replaced(kOneCamera, from, to));
  };
  EXPECT_THAT(with("\"fx\": 5", "\"fx\": -5"), HasSubstr("list.json: views[0] (a.jpg).fx"));
  EXPECT_THAT(with("\"fx\": 5", "\"fx\": 1e999"), HasSubstr("list.json: "));
  EXPECT_THAT(with("\"fx\": 5", "\"fx\": null"), HasSubstr("expected a number"));
  EXPECT_THAT(with("\"width\": 4", "\"width\": 1e9"), HasSubstr("width"));
  EXPECT_THAT(with("\"width\": 4", "\"width\": 4.5"), HasSubstr("whole number"));
  EXPECT_THAT(with("\"width\": 4", "\"width\": 0"), HasSubstr("width"));
  EXPECT_THAT(with("\"cy\": 1.5,", ""), HasSubstr("\"cy\""));
  EXPECT_THAT(with("a.jpg", "../a.jpg"), HasSubstr("leaves its folder"));
  EXPECT_THAT(with("a.jpg", "/a.jpg"), HasSubstr("is absolute"));
  EXPECT_THAT(with("a.jpg", ""), HasSubstr("is empty"));
  EXPECT_THAT(with("a.jpg", "a\\nb"), HasSubstr("control characters"));
  EXPECT_THAT(with("a.exr", "x/../../a.exr"), HasSubstr(".depth"));
  EXPECT_THAT(with("[0,0,0,1]]", "[0,0,1,1]]"), HasSubstr("last row"));
  EXPECT_THAT(with("[0,0,0,1]]", "[0,0,0]]"), HasSubstr("cam_from_world[3]"));
  EXPECT_THAT(with("[0,0,1,3]", "[0,0,-1,3]"), HasSubstr("mirroring"));
  EXPECT_THAT(with("[0,0,1,3]", "[0,0,1.001,3]"), HasSubstr("rotation matrix"));
  EXPECT_THAT(with("\"views\"", "\"unit\": \"feet\", \"views\""), HasSubstr("unit"));
  EXPECT_THAT(with("\"views\"", "\"world_origin\": [1, 2], \"views\""), HasSubstr("world_origin"));
  EXPECT_THAT(with("\"name\"", "\"depth_kind\": \"x\", \"name\""), HasSubstr("depth_kind"));
  EXPECT_THAT(ErrorOf(R"({"views": []})"), HasSubstr("at least one camera"));
  EXPECT_THAT(ErrorOf("[]"), HasSubstr("expected an object"));
}

TEST(CamerasJson, TheSameNameTwiceIsRejected) {
  std::string twice = kOneCamera;
  const size_t begin = twice.find("[{") + 1, end = twice.rfind("]}");
  twice.insert(end, ", " + twice.substr(begin, end - begin));
  EXPECT_THAT(ErrorOf(twice), HasSubstr("unique names"));
}

TEST(CamerasJson, DeeplyNestedTextIsRejectedWithoutExhaustingTheStack) {
  EXPECT_THAT(ErrorOf(std::string(1000000, '[')), HasSubstr("list.json: "));
}

TEST(CamerasJson, AMatrixSlightlyOffARotationKeepsItsCameraCentre) {
  // 3e-7 off in one entry and 4.5e6 from zero: keeping t instead of C would move the camera 1 unit.
  Random random(2);
  const Eigen::Matrix3d exact = RandomRotation(random).toRotationMatrix();
  Eigen::Matrix3d rounded = exact;
  rounded(0, 1) += 3e-7;
  const Eigen::Vector3d center(5e5, 4.5e6, 100);
  const Pose pose = PoseFromMatrix(rounded, -(rounded * center), kRotationTolerance, "test");
  constexpr double kCenter = 1e-8;  // ten times the spacing of doubles at 4.5e6
  EXPECT_LT((pose.TargetOriginInSource() - center).norm(), kCenter);
  EXPECT_NEAR(pose.rotation.norm(), 1, 1e-15);
}

TEST(RecentreWorld, FarCamerasMoveToTheOriginWithTheirRelativePosesKept) {
  CameraList near = RandomList(16, 3);
  CameraList far = near;
  const Eigen::Vector3d offset(5e5, 4.5e6, 100);
  for (NamedCamera& named : far.cameras) {
    const auto rotation = named.cam_from_world.rotation.cast<long double>().normalized();
    named.cam_from_world.translation = (named.cam_from_world.translation.cast<long double>() -
                                        rotation.toRotationMatrix() * offset.cast<long double>())
                                           .cast<double>();
  }
  const CameraList back = RecentreWorld(far);
  EXPECT_LT((back.world_origin - offset).norm(), 5);  // the centroid, rounded
  // Storing far poses loses half the spacing of doubles there, 4.7e-10; worst seen: 2.9e-10.
  constexpr double kRelative = 1e-9;
  for (size_t i = 0; i < near.cameras.size(); ++i) {
    EXPECT_LT(back.cameras[i].cam_from_world.TargetOriginInSource().norm(), 10);
    const Pose expected = near.cameras[i].cam_from_world * near.cameras[0].cam_from_world.Inverse();
    const Pose found = back.cameras[i].cam_from_world * back.cameras[0].cam_from_world.Inverse();
    EXPECT_LT((found.translation - expected.translation).cwiseAbs().maxCoeff(), kRelative) << i;
    EXPECT_LT(found.rotation.angularDistance(expected.rotation), kRelative) << i;
  }
}

TEST(RecentreWorld, MovesWithoutLossWhenTheOriginIsAlreadyApart) {
  CameraList list = RandomList(8, 4);
  list.world_origin = {5e5, 4.5e6, 100};
  const CameraList back = RecentreWorld(list);
  EXPECT_EQ(back.world_origin, list.world_origin);
  for (size_t i = 0; i < list.cameras.size(); ++i) {
    EXPECT_EQ(back.cameras[i].cam_from_world.translation,
              list.cameras[i].cam_from_world.translation);
  }
}

TEST(RecentreWorld, WorksAtAnyScale) {
  for (const double scale : {1e-6, 1.0, 1e6}) {
    CameraList list = RandomList(8, 5);
    for (NamedCamera& named : list.cameras) {
      named.cam_from_world.translation +=
          named.cam_from_world.rotation * Eigen::Vector3d(0, -1e5, 0);
      named.cam_from_world.translation *= scale;
    }
    const CameraList back = RecentreWorld(list);
    for (const NamedCamera& named : back.cameras) {
      EXPECT_LT(named.cam_from_world.TargetOriginInSource().norm(), 10 * scale);
    }
  }
}

TEST(CamerasJson, PlazaIsReadAsItsDescriptionSays) {
  const auto file = testing::DataFolder() / "plaza/cameras.json";
  DTR_REQUIRE_DATA(file);
  const CameraList list = ReadCamerasJson(file);
  ASSERT_EQ(list.cameras.size(), 16u);
  EXPECT_NEAR(list.cameras[7].camera.fx_px(), 746.6666667, 1e-6);
  EXPECT_EQ(list.cameras[7].depth_file, "0007.exr");
  // A 60 degree arc around the square, cameras above the ground (z up): no axis is swapped.
  for (const NamedCamera& named : list.cameras) {
    EXPECT_GT(named.cam_from_world.TargetOriginInSource().z(), 0);
  }
}

}  // namespace
}  // namespace dtr::io
