// A .r3d file of Record3D, made of an exact scene: as a set, as cameras and as a depth prior.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "dtr/base/files.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/formats/foreign_depth.h"
#include "dtr/io/set_io.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/environment.h"
#include "tests/support/test_data.h"
#include "tests/support/zip_file.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using ::testing::HasSubstr;

constexpr int kShrink = 4;
constexpr std::uintmax_t kMaxBytes = 1 << 20;

class Record3dRecording : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    shared_ = new TemporaryFolder;
    MakeSmallCourtyard(Courtyard());
    WriteRecording();
  }
  static void TearDownTestSuite() { delete shared_; }
  static fs::path Courtyard() { return *shared_ / "courtyard"; }
  static std::string File() { return (*shared_ / "scan.r3d").string(); }
  std::string In(const std::string& name) const { return (folder_ / name).string(); }

  /// The middle one of each map's pixels; too far by a fifth, and of no confidence, in the left
  /// upper quarter.
  static bool IsUnsure(int x, int y, const DepthImage& truth) {
    return 2 * x < truth.width() && 2 * y < truth.height();
  }
  static std::string ConfidenceOf(const DepthImage& truth) {
    std::string levels;
    for (int y = kShrink / 2; y < truth.height(); y += kShrink) {
      for (int x = kShrink / 2; x < truth.width(); x += kShrink) {
        levels += IsUnsure(x, y, truth) ? '\0' : '\2';
      }
    }
    return StoredAsLzfse(levels);
  }
  static DepthImage TruthOf(const std::string& stem) {
    return io::ReadForeignDepth(Courtyard() / "depth" / (stem + ".exr"), DepthKind::kPlaneZ, 1,
                                kCourtyardWidthPx, kCourtyardHeightPx);
  }
  static std::string DepthOf(const DepthImage& truth) {
    std::string bytes;
    for (int y = kShrink / 2; y < truth.height(); y += kShrink) {
      for (int x = kShrink / 2; x < truth.width(); x += kShrink) {
        const float z = truth(x, y) * (IsUnsure(x, y, truth) ? 1.2f : 1.0f);
        char raw[sizeof z];
        std::memcpy(raw, &z, sizeof z);
        bytes.append(raw, sizeof raw);
      }
    }
    return StoredAsLzfse(bytes);
  }

  static void WriteRecording() {
    const io::CameraList list = io::ReadCamerasJson(Courtyard() / "cameras.json");
    Json poses = Json::array(), intrinsics = Json::array();
    ZipEntries entries;
    int frame = 0;
    for (const io::NamedCamera& named : list.cameras) {
      const Pose world_from_cam = named.cam_from_world.Inverse();
      // ARKit's axes of a camera: x right, y up, z back.
      const Eigen::Quaterniond q(world_from_cam.rotation * Eigen::Quaterniond(0, 1, 0, 0));
      const Eigen::Vector3d c = world_from_cam.translation + list.world_origin;
      poses.push_back({q.x(), q.y(), q.z(), q.w(), c.x(), c.y(), c.z()});
      intrinsics.push_back(
          {named.camera.fx_px(), named.camera.fy_px(), named.camera.cx_px(), named.camera.cy_px()});
      const std::string stem = fs::path(named.name).stem().string();
      const std::string name = "rgbd/" + std::to_string(frame++);
      entries.emplace_back(name + ".jpg", ReadFile(Courtyard() / "images" / named.name, kMaxBytes));
      entries.emplace_back(name + ".depth", DepthOf(TruthOf(stem)));
      entries.emplace_back(name + ".conf", ConfidenceOf(TruthOf(stem)));
    }
    const Json metadata = {{"w", kCourtyardWidthPx},
                           {"h", kCourtyardHeightPx},
                           {"K", {100, 0, 0, 0, 100, 0, 96, 64, 1}},
                           {"poses", poses},
                           {"perFrameIntrinsicCoeffs", intrinsics}};
    entries.emplace_back("metadata", metadata.dump());
    WriteZip(File(), entries);
  }

  /// Of pixels with depth, how far the median one is from the truth.
  static double MedianErrorOf(const DtrSet& set) {
    const io::CameraList list = io::ReadCamerasJson(Courtyard() / "cameras.json");
    std::vector<double> errors;
    for (const View& view : set.frames[0].views) {
      const auto frame = static_cast<size_t>(std::stoi(view.name));
      const std::string stem = fs::path(list.cameras[frame].name).stem().string();
      const DepthImage truth = TruthOf(stem);
      const int s = kCourtyardWidthPx / view.depth.width();
      for (int y = 0; y < view.depth.height(); ++y) {
        for (int x = 0; x < view.depth.width(); ++x) {
          const double z = truth(s * x + s / 2, s * y + s / 2);
          if (!DepthImage::IsHole(view.depth(x, y))) {
            errors.push_back(std::abs(view.depth(x, y) / z - 1));
          }
        }
      }
    }
    EXPECT_GT(errors.size(), 5000u);
    std::nth_element(errors.begin(), errors.begin() + static_cast<long>(errors.size() / 2),
                     errors.end());
    return errors[errors.size() / 2];
  }

  static inline TemporaryFolder* shared_ = nullptr;
  TemporaryFolder folder_;
};

TEST_F(Record3dRecording, BecomesASetAsItIs) {
  fs::create_directories(folder_ / "temporary");
  const Environment elsewhere("TMPDIR", In("temporary"));
  for (const char* name : {"a", "b"}) {
    fs::create_directories(folder_ / name);
    DtrByItself({"import", "--cameras", File(), "--no-completion", "-o",
                 In(name + std::string("/set.dtr"))});
  }
  EXPECT_THAT(DifferingFiles(Contents(In("a/set.dtr")), Contents(In("b/set.dtr"))),
              ::testing::IsEmpty())
      << "where it was unpacked leaves no trace";
  EXPECT_TRUE(fs::is_empty(folder_ / "temporary"));
  const DtrSet set = io::LoadSet(In("a/set.dtr"));
  ASSERT_EQ(set.frames[0].views.size(), static_cast<size_t>(kCourtyardViews));
  EXPECT_EQ(set.unit, LengthUnit::kMetre);
  constexpr double kCoded = 1e-4;  // 16 bits of inverse depth; the maps' pixels are exact
  EXPECT_LT(MedianErrorOf(set), kCoded);
  for (const View& view : set.frames[0].views) {
    EXPECT_TRUE(DepthImage::IsHole(view.depth(3, 3))) << "of the lowest confidence";
    EXPECT_FALSE(DepthImage::IsHole(view.depth(3, view.depth.height() - 3)));
  }
}

TEST_F(Record3dRecording, GivesCamerasAndAPriorToItsPhotos) {
  // Its photos as unzip leaves them, every second one deleted.
  const fs::path photos = folder_ / "scan/rgbd";
  fs::create_directories(photos);
  for (int frame = 0; frame < kCourtyardViews; frame += 2) {
    fs::copy(Courtyard() / "images" / fmt::format("{:04}.jpg", frame),
             photos / fmt::format("{}.jpg", frame));
  }
  const Ran ran = DtrOk({"build", photos.string(), "--poses", File(), "--depth-prior", File(),
                         "--preset", "fast", "-o", In("scene.dtr"), "--json", "-"});
  EXPECT_THAT(ran.err, HasSubstr("depth of the lowest confidence is left out, 25.0 % of the"));
  const Json prior = Json::parse(ran.out).at("depth_prior");
  EXPECT_EQ(prior.at("maps"), 4);
  EXPECT_NEAR(prior.at("scale").get<double>(), 1, 0.01);
  EXPECT_LT(prior.at("noise").get<double>(), 0.03);
  constexpr double kStereo = 0.01;
  EXPECT_LT(MedianErrorOf(io::LoadSet(In("scene.dtr"))), kStereo);
}

TEST_F(Record3dRecording, IsNoFolderOfPhotos) {
  ExpectRejected(Dtr({"build", File(), "-o", In("scene.dtr")}), kWrongUsage,
                 "expected a folder of photos, found a recording of Record3D; unpack it (unzip ");
}

TEST_F(Record3dRecording, IsNamedWhereItIsDamaged) {
  WriteFileAtomically(folder_ / "cut.r3d", ReadFile(File(), kMaxBytes).substr(0, 9999));
  ExpectRejected(Dtr({"import", "--cameras", In("cut.r3d"), "-o", In("cut.dtr")}), kFailed,
                 "expected a recording of Record3D (a ZIP archive), found ");
  EXPECT_FALSE(fs::exists(In("cut.dtr")));
}

}  // namespace
}  // namespace dtr::testing
