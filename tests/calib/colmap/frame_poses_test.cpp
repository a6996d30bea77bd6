// Models of COLMAP 3.12 and later, whose rigs and frames hold the poses.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "calib/colmap/model_io.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "tests/calib/colmap/model_test_support.h"
#include "tests/support/message_of.h"
#include "tests/support/test_data.h"
#include "tests/support/truncation.h"

namespace dtr::colmap {
namespace {

namespace fs = std::filesystem;
using dtr::testing::MessageOf;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kExact = 1e-14;  // one product of rotations of doubles

// A stereo rig at two times. The right camera stands 0.2 to the right and is turned by a quarter
// about y.
class FramePoses : public ::testing::Test {
 protected:
  FramePoses() {
    right_from_left_.rotation = Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitY());
    right_from_left_.translation = {-0.2, 0, 0.1};
    for (int frame = 0; frame < 2; ++frame) {
      left_from_world_[frame].rotation = Eigen::AngleAxisd(0.3 + frame, Eigen::Vector3d::UnitX());
      left_from_world_[frame].translation = {0.5, -1.0 * frame, 2};
    }
    for (const std::uint32_t camera : {1u, 2u}) {
      model_.cameras[camera] = {calib::CameraModel::kPinhole, 64, 48, {50, 50, 32, 24}};
      for (std::uint32_t frame = 0; frame < 2; ++frame) {
        model_.images.push_back({10 * camera + frame,
                                 fmt::format("{}/{}.jpg", camera, frame),
                                 camera,
                                 TruePose(camera, frame),
                                 {}});
      }
    }
  }

  Pose TruePose(std::uint32_t camera, std::uint32_t frame) const {
    return camera == 1 ? left_from_world_[frame] : right_from_left_ * left_from_world_[frame];
  }

  static std::string Numbers(const Pose& pose) {
    const auto& q = pose.rotation;
    const auto& t = pose.translation;
    return fmt::format("{} {} {} {} {} {} {}", q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z());
  }
  std::string Rigs() const {
    return "# Rig calib list\n# Number of rigs: 1\n7 3 CAMERA 1 IMU 5 0 CAMERA 2 1 " +
           Numbers(right_from_left_) + "\n";
  }
  std::string Frames() const {
    std::string text = "# Frame list\n# Number of frames: 2\n";
    for (std::uint32_t frame = 0; frame < 2; ++frame) {
      text += fmt::format("{} 7 {} 3 CAMERA 1 {} CAMERA 2 {} IMU 5 {}\n", 40 + frame,
                          Numbers(left_from_world_[frame]), 10 + frame, 20 + frame, frame);
    }
    return text;
  }
  void WriteText(const std::string& rigs, const std::string& frames) const {
    fs::remove(folder_ / "rigs.txt");
    fs::remove(folder_ / "frames.txt");
    WriteModel(folder_.path(), model_, Format::kText);
    if (!rigs.empty()) WriteFileAtomically(folder_ / "rigs.txt", rigs);
    if (!frames.empty()) WriteFileAtomically(folder_ / "frames.txt", frames);
  }
  void ExpectTruePoses(const calib::SfmModel& model) const {
    ASSERT_EQ(model.images.size(), 4u);
    for (const calib::SfmImage& image : model.images) {
      const Pose truth = TruePose(image.camera_id, image.id % 10);
      EXPECT_LT(image.cam_from_world.rotation.angularDistance(truth.rotation), kExact);
      EXPECT_LT((image.cam_from_world.translation - truth.translation).norm(), kExact);
    }
  }
  std::string Says() const {
    return MessageOf<Error>([&] { ReadModel(folder_.path()); });
  }

  Pose right_from_left_, left_from_world_[2];
  calib::SfmModel model_;
  const dtr::testing::TemporaryFolder folder_;
};

template <typename T>
void Put(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void PutPose(std::string& bytes, const Pose& pose) {
  const auto& q = pose.rotation;
  for (const double value : {q.w(), q.x(), q.y(), q.z()}) Put(bytes, value);
  for (const double value : pose.translation) Put(bytes, value);
}

TEST_F(FramePoses, ThatAgreeWithTheImagesAreNotSpokenOf) {
  WriteText(Rigs(), Frames());
  std::vector<std::string> notes;
  ExpectTruePoses(ReadModel(folder_.path(), &notes));
  EXPECT_THAT(notes, IsEmpty());
}

TEST_F(FramePoses, GoBeforeThoseOfAnOlderImagesFile) {
  for (calib::SfmImage& image : model_.images) {
    if (image.id != 10) image.cam_from_world.translation.x() += 1.5;
  }
  WriteText(Rigs(), Frames());
  std::vector<std::string> notes;
  ExpectTruePoses(ReadModel(folder_.path(), &notes));
  EXPECT_THAT(notes, ElementsAre(AllOf(HasSubstr("frames.txt: 3 of 4 images have another pose"),
                                       HasSubstr("first 1/1.jpg"), HasSubstr("1.5 units"),
                                       HasSubstr("those of frames.txt are used"))));
}

TEST_F(FramePoses, OfBinaryFilesAreRead) {
  const auto truth = model_;
  for (calib::SfmImage& image : model_.images) image.cam_from_world = Pose();
  WriteModel(folder_.path(), model_, Format::kBinary);
  std::string rigs, frames;
  Put<std::uint64_t>(rigs, 1);
  Put<std::uint32_t>(rigs, 7);
  Put<std::uint32_t>(rigs, 3);
  Put<std::int32_t>(rigs, 0);
  Put<std::uint32_t>(rigs, 1);
  Put<std::int32_t>(rigs, 0);
  Put<std::uint32_t>(rigs, 2);
  Put<std::uint8_t>(rigs, 1);
  PutPose(rigs, right_from_left_);
  Put<std::int32_t>(rigs, 1);
  Put<std::uint32_t>(rigs, 5);
  Put<std::uint8_t>(rigs, 0);
  Put<std::uint64_t>(frames, 2);
  for (std::uint32_t frame = 0; frame < 2; ++frame) {
    Put<std::uint32_t>(frames, 40 + frame);
    Put<std::uint32_t>(frames, 7);
    PutPose(frames, left_from_world_[frame]);
    Put<std::uint32_t>(frames, 2);
    for (const std::uint32_t camera : {1u, 2u}) {
      Put<std::int32_t>(frames, 0);
      Put<std::uint32_t>(frames, camera);
      Put<std::uint64_t>(frames, 10 * camera + frame);
    }
  }
  WriteFileAtomically(folder_ / "rigs.bin", rigs);
  WriteFileAtomically(folder_ / "frames.bin", frames);
  ExpectTruePoses(ReadModel(folder_.path()));
  for (const char* name : {"rigs.bin", "frames.bin"}) {
    dtr::testing::ExpectEveryPrefixIsAnError(folder_ / name, 1, [&] { ReadModel(folder_.path()); });
  }
}

TEST_F(FramePoses, OfAnotherModelAreRejected) {
  WriteText(Rigs(), Frames());
  std::string frames = Frames();
  frames.replace(frames.find("CAMERA 2 21"), 11, "CAMERA 2 31");
  WriteText(Rigs(), frames);
  EXPECT_THAT(Says(), HasSubstr("frames.txt: image 21 of images.txt is in none of its frames"));
  frames = Frames();
  frames.replace(frames.find("CAMERA 2 21"), 11, "CAMERA 1 21");
  WriteText(Rigs(), frames);
  EXPECT_THAT(Says(), HasSubstr("image 21 of images.txt is in none of its frames, with the same"));
  frames = Frames();
  frames.replace(frames.find("CAMERA 2 21"), 11, "CAMERA 2 20");
  WriteText(Rigs(), frames);
  EXPECT_THAT(Says(), HasSubstr("frame 41: image 20 stands in another frame, too"));
  WriteText("7 1 CAMERA 1\n", Frames());
  EXPECT_THAT(Says(), HasSubstr("frame 40: expected a camera of rig 7, found 2"));
  WriteText("8 1 CAMERA 1\n", Frames());
  EXPECT_THAT(Says(), HasSubstr("frame 40: expected a rig of rigs.txt, found the absent id 7"));
  WriteText("", Frames());
  EXPECT_THAT(Says(), HasSubstr("expected a rig of rigs.txt, found the absent id 7"));
  WriteText("7 2 CAMERA 1 CAMERA 2 0\n", Frames());
  EXPECT_THAT(Says(), HasSubstr("frame 40: camera 2 has no pose in rig 7"));
  WriteText("7 1 CAMERA 1\n7 1 CAMERA 1\n", Frames());
  EXPECT_THAT(Says(), HasSubstr("rig 7: expected a unique id, found it twice"));
  WriteText("7 1 LIDAR 1\n", Frames());
  EXPECT_THAT(Says(), HasSubstr("expected a sensor CAMERA or IMU, found 'LIDAR'"));
}

TEST_F(FramePoses, AreTheImagesWhereThereAreRigsAlone) {
  WriteText(Rigs(), "");
  std::vector<std::string> notes;
  ExpectTruePoses(ReadModel(folder_.path(), &notes));
  EXPECT_THAT(notes, ElementsAre(HasSubstr("rigs.txt: is not used without frames.txt")));
}

TEST_F(FramePoses, OfFilesCutShortAreRejected) {
  WriteText(Rigs(), Frames());
  for (const char* name : {"rigs.txt", "frames.txt"}) {
    const std::string whole = ReadFile(folder_ / name, 1 << 20);
    // What stands in the last word of frames.txt is of no image.
    const size_t end = whole.find_last_of(" \n", whole.size() - 2);
    for (size_t size = 0; size < end; size += 3) {
      WriteFileAtomically(folder_ / name, whole.substr(0, size));
      EXPECT_THROW(ReadModel(folder_.path()), Error) << name << " cut to " << size;
    }
    WriteFileAtomically(folder_ / name, whole);
  }
}

}  // namespace
}  // namespace dtr::colmap
