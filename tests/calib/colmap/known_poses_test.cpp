#include "calib/sfm/run/known_poses.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>

#include "calib/colmap/export.h"
#include "calib/colmap/model_io.h"
#include "calib/colmap/steps.h"
#include "calib/sfm/run/held_out.h"
#include "calib/sfm/run/view_pyramids.h"
#include "calib/sfm/run/workspace.h"
#include "dtr/base/error.h"
#include "dtr/base/hash.h"
#include "dtr/base/random.h"
#include "dtr/io/image_io.h"
#include "tests/calib/colmap/fake_colmap.h"
#include "tests/calib/colmap/model_test_support.h"
#include "tests/support/noted_lines.h"

namespace dtr::colmap {
namespace {

using namespace sfm;

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

const SfmOptions kByColmap{.colmap = &kSteps, .engine = SfmEngine::kColmap};

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
    return TriangulateWithPoses(photos_.path(), posed_, workspace_ / "posed", kByColmap, silent_);
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

TEST_F(KnownPosesWithFake, PhotosWithoutAnythingInCommonAreSaidToBeSo) {
  fake_.Fail("point_triangulator", "exit 134");
  try {
    Run();
    FAIL() << "nothing was thrown";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("no two of the 3 have any in common"));
  }
  fake_.LeaveDatabase({"000002.jpg", "000000.jpg", "000001.jpg"}, {1, 1, 2}, {{0, 1, 40}});
  dtr::testing::TemporaryFolder other;
  try {
    TriangulateWithPoses(photos_.path(), posed_, other / "posed", kByColmap, silent_);
    FAIL() << "nothing was thrown";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("point_triangulator"));
  }
}

TEST_F(KnownPosesWithFake, CameraModelsThatColmapDoesNotKnowAreRejectedBeforeAnyWork) {
  posed_[0].camera.model = calib::CameraModel::kEucm;
  posed_[0].camera.params = {400, 400, 320, 240, 0.5, 1};
  EXPECT_THAT([&] { Run(); },
              ::testing::ThrowsMessage<Error>(
                  AllOf(HasSubstr("c.jpg: its camera model EUCM"), HasSubstr("`sfm` auto"))));
  EXPECT_FALSE(fs::exists(workspace_ / "posed"));
}

TEST_F(KnownPosesWithFake, OnePhotoIsAUsageError) {
  posed_.resize(1);
  EXPECT_THROW(Run(), UsageError);
}

TEST_F(KnownPosesWithFake, PairsThatCannotOverlapAreNotMatchedAndSaidOnce) {
  // b.jpg turns its back on the others, from behind them.
  posed_[1].cam_from_world = {Eigen::Quaterniond(0, 0, 1, 0), {0, 0, -9}};
  dtr::testing::NotedLines notes;
  TriangulateWithPoses(photos_.path(), posed_, workspace_ / "posed", kByColmap, notes);
  EXPECT_THAT(notes.lines, ElementsAre("2 of 3 pairs of photos left out of matching: their cameras "
                                       "cannot see the same thing"));
  std::string matching;
  for (const std::string& call : fake_.Calls()) {
    EXPECT_THAT(call, Not(HasSubstr("exhaustive_matcher")));
    if (call.starts_with("matches_importer")) matching = call;
  }
  const std::string flag = "--match_list_path ";
  const size_t at = matching.find(flag);
  ASSERT_NE(at, std::string::npos);
  const std::string file = matching.substr(at + flag.size());
  EXPECT_EQ(ReadFile(file.substr(0, file.find(' ')), 1000), "000000.jpg 000002.jpg\n");
}

TEST_F(KnownPosesWithFake, PairsThatMayOverlapAreAllMatched) {
  dtr::testing::NotedLines notes;
  TriangulateWithPoses(photos_.path(), posed_, workspace_ / "posed", kByColmap, notes);
  EXPECT_THAT(notes.lines, SizeIs(0));
  EXPECT_THAT(fake_.Calls()[2], HasSubstr("exhaustive_matcher"));
}

PosedImage At(const Eigen::Vector3d& centre, double yaw_deg, const PinholeCamera& camera) {
  PosedImage image;
  image.camera = FromPinhole(camera);
  image.cam_from_world.rotation =
      Eigen::AngleAxisd(yaw_deg * std::numbers::pi / 180, Eigen::Vector3d::UnitY());
  image.cam_from_world.translation = -(image.cam_from_world.rotation * centre);
  return image;
}

TEST(CannotOverlap, HandWorkedCases) {
  // 90 degrees wide; 95.5 with the margin.
  const PinholeCamera camera(200, 200, 100, 100, 100, 100);
  const PosedImage ahead = At({0, 0, 0}, 0, camera);
  EXPECT_FALSE(CannotOverlap(ahead, ahead));
  EXPECT_FALSE(CannotOverlap(ahead, At({1, 0, 0}, 0, camera)));    // side by side: far away
  EXPECT_FALSE(CannotOverlap(ahead, At({0, 0, 5}, 180, camera)));  // face to face
  EXPECT_TRUE(CannotOverlap(ahead, At({0, 0, -5}, 180, camera)));  // back to back
  EXPECT_FALSE(CannotOverlap(ahead, At({0, 0, 0}, 94, camera)));   // poses are never exact
  EXPECT_TRUE(CannotOverlap(ahead, At({0, 0, 0}, 97, camera)));
  // Two that look across each other see the same, two that look away from each other do not.
  const bool left_first = CannotOverlap(At({-1, 0, 0}, 60, camera), At({1, 0, 0}, -60, camera));
  const bool right_first = CannotOverlap(At({1, 0, 0}, 60, camera), At({-1, 0, 0}, -60, camera));
  EXPECT_NE(left_first, right_first);
  PosedImage lens = At({0, 0, -5}, 180, camera);
  lens.camera = {calib::CameraModel::kSimpleRadial, 200, 200, {100, 100, 100, 0.1}};
  EXPECT_FALSE(CannotOverlap(ahead, lens));
}

TEST(CannotOverlap, NoPointIsInBothViewsOfAPairLeftOutAndSomeIsInMostOthers) {
  Random random(5);
  const PinholeCamera camera(300, 200, 250, 250, 150, 100);
  const auto random_image = [&] {
    PosedImage image;
    image.camera = FromPinhole(camera);
    image.cam_from_world.rotation =
        Eigen::Quaterniond(random.Normal(), random.Normal(), random.Normal(), random.Normal())
            .normalized();
    image.cam_from_world.translation = {random.Normal(), random.Normal(), random.Normal()};
    return image;
  };
  constexpr int kPairs = 300, kPoints = 3000;
  int left_out = 0, kept = 0, kept_with_points = 0;
  for (int pair = 0; pair < kPairs; ++pair) {
    const PosedImage a = random_image(), b = random_image();
    int shared = 0;
    for (int i = 0; i < kPoints; ++i) {
      const Eigen::Vector2d pixel(random.Uniform(0, 300), random.Uniform(0, 200));
      const Eigen::Vector3d p =
          a.cam_from_world.Inverse() *
          camera.CamFromPixel(pixel, std::exp(random.Uniform(-4, 7)), DepthKind::kPlaneZ);
      const auto in_b = camera.PixelFromCam(b.cam_from_world * p);
      shared += in_b && camera.Contains(*in_b);
    }
    if (CannotOverlap(a, b)) {
      ++left_out;
      EXPECT_EQ(shared, 0) << pair;
    } else {
      ++kept;
      kept_with_points += shared > 0;
    }
  }
  EXPECT_GT(left_out, kPairs / 4);
  EXPECT_GT(kept_with_points, kept * 7 / 10);  // the others overlap in the margin or a narrow wedge
}

// A frozen model of two photos, and held-out ones to be placed in it.
class HeldOutWithFake : public ::testing::Test {
 protected:
  HeldOutWithFake() {
    for (const char* name : {"a.jpg", "b.jpg", "x.jpg", "y.jpg"}) {
      WriteFileAtomically(photos_ / name, std::string("photo ") + name);
    }
    model_.cameras[4] = {calib::CameraModel::kSimpleRadial, 640, 480, {512.25, 320, 240, 0.01}};
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

  // Where a held-out photo is placed, and the pairs that are matched for it there.
  fs::path FolderOf(const std::string& name) const {
    return workspace_ / "held" / Sha256(std::as_bytes(std::span(name)));
  }
  std::string PairsOf(const std::string& name) const {
    return ReadFile(FolderOf(name) / "lists" / "pairs.txt", 1 << 20);
  }

  HeldOutResult Run() {
    return RegisterHeldOut(photos_.path(), held_out_, model_, sources_, workspace_ / "sfm",
                           workspace_ / "held", kByColmap, silent_);
  }

  const dtr::testing::TemporaryFolder photos_, workspace_;
  testing::FakeColmap fake_;
  std::vector<SfmImageInput> sources_ = {{"a.jpg", 640, 480, {}, "one"},
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

// A stabilised lens: a camera for every photo, and the lens they have in common, which is none's.
// COLMAP takes a camera that no image of the model has from its database, from before refinement,
// and crashes where the lens model is another one by now.
TEST_F(HeldOutWithFake, TheLensThatPhotosHaveInCommonIsOneOfAnImageOfTheModelThatColmapReads) {
  calib::LensCamera lens{
      calib::CameraModel::kOpenCv, 640, 480, {512, 513, 320, 240, 0.1, 0.2, 3e-3, 4e-3}};
  model_.cameras[4] = lens;
  for (const std::uint32_t i : {0, 1}) {
    lens.params[2] = 318 + 5.0 * i;
    model_.cameras[7 + i] = lens;
    model_.images[i].camera_id = 7 + i;
  }
  fake_.LeaveDatabase({"held_000000.jpg"});
  LeaveRegistered(true);
  fake_.Fail("image_registrator", "cp -r \"$input\" \"$here/seen\"");
  held_out_.resize(1);
  const HeldOutResult result = Run();
  const calib::SfmModel seen = ReadModel(fake_ / "seen");
  ASSERT_EQ(seen.images.size(), 2u);
  EXPECT_TRUE(HasImages(seen, 4)) << "COLMAP would take it from its database";
  for (const auto& [id, camera] : model_.cameras) {
    EXPECT_EQ(seen.cameras.at(id).params, camera.params) << id;
  }
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(seen.images[i].name, Workspace::AliasFor("", i, model_.images[i].name));
    EXPECT_EQ(seen.images[i].cam_from_world.translation,
              model_.images[i].cam_from_world.translation);
    EXPECT_EQ(seen.images[i].features.at(0).point_id, 9u);
  }
  EXPECT_THAT(fake_.Calls().front(), HasSubstr("--ImageReader.existing_camera_id 4"));
  ASSERT_EQ(result.images.size(), 1u);
  EXPECT_EQ(result.images[0].camera_id, 4u);
  EXPECT_EQ(result.cameras.at(4).params, model_.cameras.at(4).params);
}

TEST_F(HeldOutWithFake, EachPhotoIsMatchedWithSourcesAlone) {
  fake_.LeaveDatabase({"held_000000.jpg"});
  LeaveRegistered(true);
  Run();
  for (const std::string name : {"x.jpg", "y.jpg"}) {
    EXPECT_EQ(PairsOf(name), "held_000000.jpg 000000.jpg\nheld_000000.jpg 000001.jpg\n");
    EXPECT_EQ(fs::read_symlink(FolderOf(name) / "images" / "held_000000.jpg").filename(), name);
  }
  EXPECT_THAT(fake_.Calls(), Each(Not(HasSubstr("mapper"))));
}

// Of more sources than all can be matched with, those that the photo resembles.
TEST_F(HeldOutWithFake, OfManySourcesThePhotoIsMatchedWithThoseItResembles) {
  const fs::path plaza = "datasets/plaza/images";
  std::vector<fs::path> pictures(fs::directory_iterator(plaza), fs::directory_iterator{});
  std::sort(pictures.begin(), pictures.end());
  sources_.clear();
  for (size_t i = 0; i < kExhaustiveLimit + 1; ++i) {
    const std::string name = fmt::format("s{:03}.png", i);
    io::WriteImage(photos_ / name, ImageRgb8(64, 48, 3, std::uint8_t{128}));
    sources_.push_back({name, 640, 480, {}, "one"});
  }
  const auto becomes = [&](const std::string& name, const fs::path& picture) {
    fs::copy_file(picture, photos_ / name, fs::copy_options::overwrite_existing);
  };
  becomes("s007.png", pictures[1]);
  becomes("s040.png", pictures[2]);
  becomes("x.jpg", pictures[0]);
  becomes("y.jpg", pictures[0]);
  model_.images.resize(1);
  model_.images[0].name = sources_[0].name;
  fake_.LeaveDatabase({"held_000000.jpg"});
  LeaveRegistered(true);
  Run();
  for (const std::string name : {"x.jpg", "y.jpg"}) {
    EXPECT_EQ(PairsOf(name), "held_000000.jpg 000007.png\nheld_000000.jpg 000040.png\n");
  }
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
  std::string message;
  try {
    Run();
  } catch (const Error& error) {
    message = error.what();
  }
  EXPECT_THAT(message, HasSubstr("database.db: expected the database that made the source model, "
                                 "found none; run structure from motion on the sources again"));
}

}  // namespace
}  // namespace dtr::colmap
