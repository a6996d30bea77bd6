#include "calib/colmap/known_poses.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>

#include "calib/colmap/export.h"
#include "calib/colmap/held_out.h"
#include "calib/colmap/model_io.h"
#include "calib/colmap/workspace.h"
#include "dtr/base/error.h"
#include "dtr/base/hash.h"
#include "tests/calib/colmap/fake_colmap.h"
#include "tests/calib/colmap/model_test_support.h"

namespace dtr::colmap {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

// Three photos that only a fake COLMAP will open, of two cameras.
class KnownPosesWithFake : public ::testing::Test {
 protected:
  KnownPosesWithFake() {
    const calib::LensCamera wide = FromPinhole(PinholeCamera(640, 480, 400, 400, 320, 240));
    calib::LensCamera narrow = wide;
    narrow.params[0] = narrow.params[1] = 800;
    for (int i = 0; i < 3; ++i) {
      PosedImage image;
      image.name = std::string(1, static_cast<char>('c' - i)) + ".jpg";  // not in order
      image.camera = i == 1 ? narrow : wide;
      image.cam_from_world.rotation =
          Eigen::AngleAxisd(0.1 * i, Eigen::Vector3d(1, 2, 3).normalized());
      image.cam_from_world.translation = {0.3 * i, 0.1, 0.7};
      posed_.push_back(image);
      WriteFileAtomically(photos_ / image.name, "photo " + image.name);
    }
    // Numbers unlike any order: those the database has must be used.
    fake_.LeaveDatabase({"000002.jpg", "000000.jpg", "000001.jpg"}, {1, 1, 2});
  }

  SfmResult Run() {
    return TriangulateWithPoses(photos_.path(), posed_, workspace_ / "posed", {}, silent_);
  }

  const dtr::testing::TemporaryFolder photos_, workspace_;
  testing::FakeColmap fake_;
  std::vector<PosedImage> posed_;
  SilentProgress silent_;
};

TEST_F(KnownPosesWithFake, PosesAndCamerasComeBackBitForBitInOrderOfNames) {
  const SfmResult result = Run();
  ASSERT_EQ(result.model.images.size(), 3u);
  for (size_t i = 0; i < 3; ++i) {
    const PosedImage& given = posed_[2 - i];
    const calib::SfmImage& image = result.model.images[i];
    EXPECT_EQ(image.name, given.name);
    EXPECT_EQ(image.cam_from_world.rotation.coeffs(), given.cam_from_world.rotation.coeffs());
    EXPECT_EQ(image.cam_from_world.translation, given.cam_from_world.translation);
    EXPECT_EQ(result.model.cameras.at(image.camera_id).params, given.camera.params);
  }
  EXPECT_THAT(result.report.not_registered, ElementsAre("a.jpg", "b.jpg", "c.jpg"));  // no point
  const auto calls = fake_.Calls();
  ASSERT_EQ(calls.size(), 4u);  // an extraction per camera, matching, triangulation
  EXPECT_THAT(calls[0], HasSubstr("--ImageReader.camera_params 400,400,320,240"));
  EXPECT_THAT(calls[1], HasSubstr("--ImageReader.camera_params 800,800,320,240"));
  EXPECT_THAT(calls[3], HasSubstr("--Mapper.ba_refine_focal_length 0"));
  fake_.ForgetCalls();
  testing::ExpectSame(result.model, Run().model);
  EXPECT_THAT(fake_.Calls(), SizeIs(0));
}

TEST_F(KnownPosesWithFake, MovedPoseIsAnError) {
  calib::SfmModel moved;
  moved.cameras[1] = posed_[0].camera;
  calib::SfmImage image;
  image.id = 1;
  image.name = "000002.jpg";  // c.jpg
  image.camera_id = 1;
  image.cam_from_world = posed_[0].cam_from_world;
  image.cam_from_world.translation.x() += 1e-6;
  moved.images.push_back(image);
  WriteModel(fake_ / "output", moved, Format::kBinary);
  EXPECT_THROW(Run(), Error);
}

TEST_F(KnownPosesWithFake, OnePhotoIsAUsageError) {
  posed_.resize(1);
  EXPECT_THROW(Run(), UsageError);
}

// A frozen model of two photos, and held-out ones to be placed in it.
class HeldOutWithFake : public ::testing::Test {
 protected:
  HeldOutWithFake() {
    for (const char* name : {"a.jpg", "b.jpg", "x.jpg", "y.jpg"}) {
      WriteFileAtomically(photos_ / name, std::string("photo ") + name);
    }
    model_.cameras[4] = {calib::LensModel::kSimpleRadial, 640, 480, {512.25, 320, 240, 0.01}};
    model_.points[9] = {{0, 0, 5}, {1, 2, 3}, 0.5};
    for (std::uint32_t i = 0; i < 2; ++i) {
      calib::SfmImage image;
      image.id = i + 1;
      image.name = sources_[i].name;
      image.camera_id = 4;
      image.features.push_back({{320, 240}, 9});
      model_.images.push_back(image);
    }
    fs::create_directories(workspace_ / "sfm");
    WriteFileAtomically(workspace_ / "sfm" / "database.db", "copied, never opened by a fake");
  }

  // The registrator's output: the source model, with the held-out photo in it when `placed`.
  void LeaveRegistered(bool placed) {
    calib::SfmModel model = model_;
    for (size_t i = 0; i < model.images.size(); ++i) {
      model.images[i].name = Workspace::AliasFor("", i, model.images[i].name);
    }
    model.points[9].p_in_world.x() += 1;  // whatever COLMAP does to the sources stays outside
    if (placed) {
      calib::SfmImage image = model.images[0];
      image.id = 3;
      image.name = "held_000000.jpg";
      image.cam_from_world.translation = {1, 2, 3};
      model.images.push_back(image);
    }
    fs::remove_all(fake_ / "output");
    WriteModel(fake_ / "output", model, Format::kBinary);
  }

  HeldOutResult Run() {
    return RegisterHeldOut(photos_.path(), held_out_, model_, sources_, workspace_ / "sfm",
                           workspace_ / "held", {}, silent_);
  }

  const dtr::testing::TemporaryFolder photos_, workspace_;
  testing::FakeColmap fake_;
  const std::vector<SfmImageInput> sources_ = {{"a.jpg", 640, 480, {}, "one"},
                                               {"b.jpg", 640, 480, {}, "one"}};
  std::vector<SfmImageInput> held_out_ = {{"y.jpg", 640, 480, {}, "one"},
                                          {"x.jpg", 640, 480, {}, "one"}};
  calib::SfmModel model_;
  SilentProgress silent_;
};

TEST_F(HeldOutWithFake, PlacedPhotosCarryTheFrozenCameraAndPointIds) {
  fake_.LeaveDatabase({"held_000000.jpg"});
  LeaveRegistered(true);
  const HeldOutResult result = Run();
  ASSERT_EQ(result.images.size(), 2u);
  EXPECT_EQ(result.images[0].name, "x.jpg");
  EXPECT_EQ(result.images[1].name, "y.jpg");
  EXPECT_EQ(result.images[0].cam_from_world.translation, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(result.images[0].camera_id, 4u);
  EXPECT_EQ(result.cameras.at(4).params, model_.cameras.at(4).params);
  EXPECT_EQ(result.images[0].features.at(0).point_id, 9u);
  EXPECT_EQ(result.report.steps.size(), 6u);
}

TEST_F(HeldOutWithFake, EachPhotoIsMatchedWithSourcesAlone) {
  fake_.LeaveDatabase({"held_000000.jpg"});
  LeaveRegistered(true);
  Run();
  for (const std::string name : {"x.jpg", "y.jpg"}) {
    const auto folder = workspace_ / "held" / Sha256(std::as_bytes(std::span(name)));
    EXPECT_EQ(ReadFile(folder / "lists" / "pairs.txt", 1 << 20),
              "held_000000.jpg 000000.jpg\nheld_000000.jpg 000001.jpg\n");
    EXPECT_EQ(fs::read_symlink(folder / "images" / "held_000000.jpg").filename(), name);
  }
  EXPECT_THAT(fake_.Calls(), Each(Not(HasSubstr("mapper"))));
}

TEST_F(HeldOutWithFake, ChangedPhotoIsPlacedAgainAndNoOther) {
  fake_.LeaveDatabase({"held_000000.jpg"});
  LeaveRegistered(true);
  Run();
  fake_.ForgetCalls();
  WriteFileAtomically(photos_ / "y.jpg", "photo Y.jpg");
  Run();
  EXPECT_THAT(fake_.Calls(), SizeIs(3));
}

TEST_F(HeldOutWithFake, PhotoThatDoesNotRegisterIsListed) {
  fake_.LeaveDatabase({"held_000000.jpg"});
  LeaveRegistered(false);
  const HeldOutResult result = Run();
  EXPECT_THAT(result.images, SizeIs(0));
  EXPECT_THAT(result.not_registered, ElementsAre("x.jpg", "y.jpg"));
}

TEST_F(HeldOutWithFake, AbsentSourceDatabaseIsNamed) {
  fs::remove(workspace_ / "sfm" / "database.db");
  EXPECT_THROW(Run(), Error);
}

}  // namespace
}  // namespace dtr::colmap
