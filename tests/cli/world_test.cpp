// A set may lie anywhere and be of any size: what is seen is the same, and cameras keep their
// places through every format.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;

constexpr int kLevels = 1;  // of 255
// Depth files are float32: at another size of the world their rounding differs, and a pixel's
// centre that lies on the rim of a splat falls to the other side of it. 1 pixel of 24576 did.
constexpr double kShareOnRims = 2e-4;
const Eigen::Vector3d kUtmOffset(5e5, 4.5e6, 100);

class Worlds : public ::testing::Test {
 protected:
  fs::path Import(const std::string& name, double scale, const Eigen::Vector3d& offset) {
    const fs::path photos = folder_ / name, set = folder_ / (name + ".dtr");
    MakeSmallCourtyard(photos, scale, offset);
    DtrOk({"import", "--cameras", (photos / "cameras.json").string(), "--images",
           (photos / "images").string(), "--depth", (photos / "depth").string(), "-o",
           set.string()});
    return set;
  }
  // What a set shows from one of its views without using that view, and from between its views.
  std::vector<ImageRgb8> Images(const fs::path& set) {
    const fs::path out = set.string() + ".pictures";
    fs::create_directories(out);
    DtrOk({"render", set.string(), "--renderer", "cpu", "--like", "0003", "--exclude", "0003", "-o",
           (out / "like.png").string(), "--force"});
    DtrOk({"render", set.string(), "--renderer", "cpu", "--like", "0002", "--exclude", "0002",
           "--primitive", "splat", "-o", (out / "splat.png").string(), "--force"});
    DtrOk({"render", set.string(), "--renderer", "cpu", "--fly-through", "2", "-o",
           (out / "path").string(), "--force"});
    std::vector<ImageRgb8> pictures;
    for (const char* name : {"like.png", "splat.png", "path/000000.png", "path/000001.png"}) {
      pictures.push_back(io::ReadImage(out / name));
    }
    return pictures;
  }
  static constexpr size_t kSplatImage = 1;
  void ExpectSameImages(const fs::path& a, const fs::path& b) {
    const auto of_a = Images(a), of_b = Images(b);
    for (size_t i = 0; i < of_a.size(); ++i) {
      ASSERT_EQ(of_a[i].data().size(), of_b[i].data().size());
      long seen = 0, beyond = 0;
      int worst = 0;
      for (size_t k = 0; k < of_a[i].data().size(); ++k) {
        const int difference = std::abs(of_a[i].data()[k] - of_b[i].data()[k]);
        worst = std::max(worst, difference);
        beyond += difference > kLevels;
        seen += of_a[i].data()[k] > 0;
      }
      const double allowed = i == kSplatImage ? kShareOnRims : 0;
      EXPECT_LE(static_cast<double>(beyond), allowed * static_cast<double>(of_a[i].data().size()))
          << "image " << i << ", worst difference " << worst;
      EXPECT_GT(seen, static_cast<long>(of_a[i].data().size()) / 2) << "almost nothing was seen";
    }
  }
  TemporaryFolder folder_;
};

TEST_F(Worlds, AWorldFarFromZeroLooksTheSame) {
  ExpectSameImages(Import("here", 1, {0, 0, 0}), Import("far", 1, kUtmOffset));
}

TEST_F(Worlds, AWorldOfAnotherSizeLooksTheSame) {
  const fs::path plain = Import("plain", 1, {0, 0, 0});
  ExpectSameImages(plain, Import("small", 1e-3, {0, 0, 0}));
  ExpectSameImages(plain, Import("large", 1e3, {0, 0, 0}));
}

TEST_F(Worlds, ExactTruthIsCastAnewForASetOfAnotherGrid) {
  // Stored depth of half the size, evaluated by a truth of the whole size: equal but for its
  // coding.
  constexpr double kMedianOfCoding = 1e-4;  // half a step of 65534 in 1/z over a range of 20 : 1
  const fs::path large = folder_ / "large", small = folder_ / "small", set = folder_ / "small.dtr";
  MakeSmallCourtyard(large, 10, kUtmOffset);
  DtrOk({"dataset", "make", "courtyard", "-o", small.string(), "--layout", "arc", "--views",
         std::to_string(kCourtyardViews), "--width", std::to_string(kCourtyardWidthPx / 2),
         "--height", std::to_string(kCourtyardHeightPx / 2), "--scale", "10", "--world-offset",
         "500000", "4500000", "100"});
  DtrOk({"import", "--cameras", (small / "cameras.json").string(), "--images",
         (small / "images").string(), "--depth", (small / "depth").string(), "-o", set.string()});
  const Ran ran = DtrOk({"evaluate", set.string(), "--depth", large.string(), "--json", "-"});
  const auto depth = nlohmann::json::parse(ran.out)["depth"];
  EXPECT_EQ(depth["share_within_1pct"], 1) << depth;
  EXPECT_EQ(depth["depth_completeness"], 1) << depth;
  EXPECT_LT(depth["median_relative_error"].get<double>(), kMedianOfCoding) << depth;
  EXPECT_GT(depth["truth_pixels"], kCourtyardViews * kCourtyardWidthPx * kCourtyardHeightPx / 8);
}

// Import of a COLMAP model, export, and a build with the exported model.
class CameraTrip : public Worlds {
 protected:
  // The farthest that a camera's centre moved; its camera and rotation must have stayed.
  double Travel(const Eigen::Vector3d& offset) {
    constexpr double kRoundTrip = 1e-9;  // radians and pixels
    const fs::path photos = folder_ / "photos", set = folder_ / "photos.dtr";
    MakeSmallCourtyard(photos, 1, offset);
    DtrOk({"import", "--cameras", (photos / "sparse").string(), "--format", "colmap", "--images",
           (photos / "images").string(), "--depth", (photos / "depth").string(), "-o",
           set.string()});
    DtrOk({"export", set.string(), "--format", "colmap", "-o", (folder_ / "colmap").string()});
    const fs::path rebuilt = folder_ / "rebuilt.dtr";
    DtrOk({"build", (folder_ / "colmap/images").string(), "--poses",
           (folder_ / "colmap/sparse").string(), "--engine", "none", "--max-size", "0", "-o",
           rebuilt.string()});
    const DtrSet a = io::ReadSet(set), b = io::ReadSet(rebuilt);
    EXPECT_EQ(a.frames[0].views.size(), static_cast<size_t>(kCourtyardViews));
    EXPECT_EQ(b.frames[0].views.size(), a.frames[0].views.size());
    double farthest = 0;
    for (size_t i = 0; i < a.frames[0].views.size(); ++i) {
      const View &before = a.frames[0].views[i], &after = b.frames[0].views[i];
      EXPECT_EQ(fs::path(before.name).stem(), fs::path(after.name).stem());
      for (const auto& number : {&PinholeCamera::fx_px, &PinholeCamera::fy_px,
                                 &PinholeCamera::cx_px, &PinholeCamera::cy_px}) {
        EXPECT_NEAR((before.camera.*number)(), (after.camera.*number)(), kRoundTrip);
      }
      const auto& rotation = before.cam_from_world.rotation;
      EXPECT_LT(rotation.angularDistance(after.cam_from_world.rotation), kRoundTrip);
      const Eigen::Vector3d moved =
          (before.CenterInWorld() - after.CenterInWorld()) + (a.world_origin - b.world_origin);
      farthest = std::max(farthest, moved.norm());
    }
    return farthest;
  }
};

TEST_F(CameraTrip, KeepsCamerasNearZeroInPlace) { EXPECT_LT(Travel({0, 0, 0}), 1e-9); }

TEST_F(CameraTrip, KeepsCamerasFarFromZeroAsWellAsAColmapModelCan) {
  // COLMAP has no world origin: its translations are as large as the offset, where a double
  // resolves 9.3e-10. One such step per axis of the way there and back.
  constexpr double kStep = 9.3132257461547852e-10;
  EXPECT_LT(Travel(kUtmOffset), 2 * std::sqrt(3.0) * kStep);
}

}  // namespace
}  // namespace dtr::testing
