// Depth of another instrument as a prior of stereo: what it adds, what is said of it, and what
// wrong ones are called.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "dtr/base/random.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/formats/foreign_depth.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr int kShrink = 4;

class DepthPrior : public ::testing::Test {
 protected:
  // Cameras without depth, once for all tests.
  static void SetUpTestSuite() {
    shared_ = new TemporaryFolder;
    MakeSmallCourtyard(*shared_ / "courtyard");
    DtrOk({"build", (*shared_ / "courtyard/images").string(), "-o", Cameras(), "--poses",
           (*shared_ / "courtyard/sparse").string(), "--engine", "none"});
  }
  static void TearDownTestSuite() { delete shared_; }
  static std::string Cameras() { return (*shared_ / "cameras.dtr").string(); }
  std::string In(const std::string& name) const { return (folder_ / name).string(); }

  // Maps of a sensor of a quarter of the photos' size, with noise of 1 %. `change` has the last
  // word on each map, `of` says which photo's truth is measured for a photo.
  std::string Maps(
      const std::string& name, const std::function<void(Grid<float>&)>& change,
      const std::function<int(int)>& of = [](int photo) { return photo; }) const {
    const fs::path folder = folder_ / name;
    fs::create_directories(folder);
    for (int photo = 0; photo < kCourtyardViews; ++photo) {
      Random random(static_cast<std::uint64_t>(photo) + 1);
      const auto file_of = [](int i) { return "000" + std::to_string(i) + ".exr"; };
      const DepthImage truth =
          io::ReadForeignDepth(*shared_ / "courtyard/depth" / file_of(of(photo)),
                               DepthKind::kPlaneZ, 1, kCourtyardWidthPx, kCourtyardHeightPx);
      Grid<float> map(kCourtyardWidthPx / kShrink, kCourtyardHeightPx / kShrink);
      for (int y = 0; y < map.height(); ++y) {
        for (int x = 0; x < map.width(); ++x) {
          // The four pixels around the middle: a map's pixel has its centre there.
          double inverse = 0;
          for (int k = 0; k < 4; ++k) {
            inverse += 0.25 / truth(kShrink * x + 1 + k % 2, kShrink * y + 1 + k / 2);
          }
          const double noise = 0.01 * std::sqrt(3.0) * random.Uniform(-1, 1);
          map(x, y) = static_cast<float>((1 + noise) / inverse);
        }
      }
      change(map);
      io::WriteExr(folder / file_of(photo), map);
    }
    return folder.string();
  }
  std::string GoodMaps() const {
    return Maps("good", [](Grid<float>&) {});
  }
  static std::function<void(Grid<float>&)> Scaled(float scale) {
    return [scale](Grid<float>& map) {
      for (float& z : map.data()) z *= scale;
    };
  }
  Ran Stereo(const std::string& maps, const std::string& output,
             std::vector<std::string> further = {}) const {
    std::vector<std::string> args = {"stereo", Cameras(),       "-o", In(output), "--preset",
                                     "fast",   "--depth-prior", maps, "--json",   "-"};
    args.insert(args.end(), further.begin(), further.end());
    return Dtr(args);
  }

  static inline TemporaryFolder* shared_ = nullptr;
  TemporaryFolder folder_;
};

TEST_F(DepthPrior, AddsDepthAndSaysHowItAgrees) {
  const Ran without = Dtr({"stereo", Cameras(), "-o", In("without.dtr"), "--preset", "fast",
                           "--passes", "0", "--no-completion", "--json", "-"});
  const Ran with = Stereo(GoodMaps(), "with.dtr");
  ASSERT_EQ(with.code, 0) << with.err;
  const Json json = Json::parse(with.out), prior = json.at("depth_prior");
  EXPECT_EQ(prior.at("maps"), kCourtyardViews);
  EXPECT_NEAR(prior.at("scale").get<double>(), 1, 0.01);
  EXPECT_LT(prior.at("noise").get<double>(), 0.03);
  EXPECT_EQ(prior.at("views").at(0).at("fit"), "fits");
  EXPECT_GT(json.at("depth_completeness").get<double>(),
            Json::parse(without.out).at("depth_completeness").get<double>() + 0.03);
  EXPECT_THAT(with.err, HasSubstr("depth prior: 7 of 7 photos have a map"));
  const Json provenance = Json::parse(Text(fs::path(In("with.dtr")) / "set.json")).at("provenance");
  EXPECT_EQ(provenance.at("depth_prior"), prior);
  EXPECT_EQ(provenance.at("options").at("depth_prior").at("folder"), "good");
  EXPECT_THAT(Text(fs::path(In("with.dtr")) / "report/index.html"), HasSubstr("depth prior"));
}

TEST_F(DepthPrior, ThreadsHaveNoInfluence) {
  const std::string maps = GoodMaps();
  for (const char* threads : {"1", "3"}) {
    fs::create_directories(folder_ / threads);
    ASSERT_EQ(Stereo(maps, std::string(threads) + "/set.dtr", {"--threads", threads}).code, 0);
  }
  EXPECT_THAT(DifferingFiles(Contents(In("1/set.dtr")), Contents(In("3/set.dtr"))),
              ::testing::IsEmpty());
}

TEST_F(DepthPrior, AScaleIsDividedOutAndNamed) {
  const Ran ran = Stereo(Maps("larger", Scaled(1.1f)), "larger.dtr");
  ASSERT_EQ(ran.code, 0) << ran.err;
  EXPECT_NEAR(Json::parse(ran.out).at("depth_prior").at("divided_by").get<double>(), 1.1, 0.01);
  EXPECT_THAT(ran.err, HasSubstr("so that it has the scale of the cameras"));
}

TEST_F(DepthPrior, AMapOfAnotherPhotoIsLeftOutAndNamed) {
  const Ran ran =
      Stereo(Maps(
                 "mixed", [](Grid<float>&) {}, [](int photo) { return photo == 2 ? 6 : photo; }),
             "mixed.dtr");
  ASSERT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("the maps of 1 photos left out, first that of 0002.jpg"));
  EXPECT_EQ(Json::parse(ran.out).at("depth_prior").at("views").at(2).at("fit"), "differs");
}

TEST_F(DepthPrior, AWrongPriorIsNamed) {
  ExpectRejected(Stereo(Maps("mm", Scaled(1000)), "a.dtr"), kFailed,
                 "are its numbers millimetres? give --prior-unit 0.001");
  EXPECT_EQ(Stereo(In("mm"), "a.dtr", {"--prior-unit", "0.001"}).code, 0);
  const auto shifted = [](Grid<float>& map) {
    for (int y = 0; y < map.height(); ++y) {
      for (int x = 0; x + 1 < map.width(); ++x) map(x, y) = map(x + 1, y);
    }
  };
  ExpectRejected(Stereo(Maps("shifted", shifted), "b.dtr"), kFailed,
                 "its maps are shifted against the photos: moved by");
  const auto mirrored = [](Grid<float>& map) {
    for (int y = 0; y < map.height(); ++y) std::reverse(map.row(y), map.row(y) + map.width());
  };
  ExpectRejected(Stereo(Maps("mirrored", mirrored), "c.dtr"), kFailed,
                 "its maps do not show what the photos show: at");
}

TEST_F(DepthPrior, ARejectedPriorLeavesTheCamerasForTheNextCommand) {
  const auto build = [&](const std::string& folder, std::vector<std::string> further) {
    fs::create_directories(folder_ / folder);
    std::vector<std::string> args = {"build",
                                     (*shared_ / "courtyard/images").string(),
                                     "--poses",
                                     (*shared_ / "courtyard/cameras.json").string(),
                                     "-o",
                                     In(folder + "/built.dtr"),
                                     "--preset",
                                     "fast",
                                     "--passes",
                                     "0",
                                     "--no-completion"};
    args.insert(args.end(), further.begin(), further.end());
    return Dtr(args);
  };
  const fs::path partial = In("a/built.dtr.partial");
  const fs::path model = partial / "work/calibration/sfm/model/points3D.bin";
  const Ran first = build("a", {"--depth-prior", Maps("mm", Scaled(1000))});
  ExpectRejected(first, kFailed, "are its numbers millimetres? give --prior-unit 0.001");
  EXPECT_THAT(first.err, HasSubstr("cameras and undistorted photos are kept"));
  ASSERT_TRUE(fs::exists(model));
  const auto made = fs::last_write_time(model);
  // Another choice of depth goes on, whichever it is, and is rejected as before.
  ExpectRejected(build("a", {"--depth-prior", In("mm"), "--engine", "prior"}), kFailed,
                 "are its numbers millimetres?");
  EXPECT_EQ(fs::last_write_time(model), made);
  // Other photos or cameras do not.
  ExpectRejected(build("a", {"--holdout", "0003.jpg"}), kWrongUsage,
                 "expected work of the same inputs and options, found others");
  EXPECT_EQ(build("a", {}).code, 0);
  EXPECT_FALSE(fs::exists(partial));
  // Nothing of what was rejected is left.
  EXPECT_EQ(build("b", {}).code, 0);
  EXPECT_THAT(DifferingFiles(Contents(In("a/built.dtr")), Contents(In("b/built.dtr"))),
              ::testing::IsEmpty());
}

TEST_F(DepthPrior, APriorThatCannotBeUsedIsNamed) {
  const std::string maps = GoodMaps();
  ExpectRejected(Stereo(maps, "a.dtr", {"--engine", "sgbm"}), kWrongUsage,
                 "is the depth with --engine prior; found --engine sgbm");
  ExpectRejected(Dtr({"stereo", Cameras(), "-o", In("b.dtr"), "--engine", "prior"}), kWrongUsage,
                 "--engine prior: takes the depth of --depth-prior; give that folder");
  fs::create_directories(folder_ / "empty");
  ExpectRejected(Stereo(In("empty"), "c.dtr"), kWrongUsage,
                 "named like the photos, as that of 0000.jpg, found none");
  fs::create_directories(folder_ / "whole");
  io::WritePng16(folder_ / "whole/0000.png", Grid<std::uint16_t>(48, 32, 1, 900));
  ExpectRejected(Stereo(In("whole"), "d.dtr"), kWrongUsage,
                 "expected --prior-unit for a depth map of whole numbers, found none");
}

TEST_F(DepthPrior, EnginePriorTakesTheDepthAsItIs) {
  const Ran ran = Stereo(GoodMaps(), "taken.dtr", {"--engine", "prior"});
  ASSERT_EQ(ran.code, 0) << ran.err;
  EXPECT_GT(Json::parse(ran.out).at("depth_completeness").get<double>(), 0.95);
  const Json provenance =
      Json::parse(Text(fs::path(In("taken.dtr")) / "set.json")).at("provenance");
  EXPECT_EQ(provenance.at("depth_engine"), "prior");
  // Another run leaves nothing of a prior behind.
  DtrOk({"stereo", In("taken.dtr"), "-o", In("again.dtr"), "--preset", "fast"});
  EXPECT_THAT(Text(fs::path(In("again.dtr")) / "set.json"), Not(HasSubstr("depth_prior")));
}

}  // namespace
}  // namespace dtr::testing
