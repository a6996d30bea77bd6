// `dtr export` takes the colours of points from one image after another.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "calib/colmap/model_io.h"
#include "dtr/base/process.h"
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;

constexpr int kWidthPx = 2000, kHeightPx = 1500;  // 9 MB in memory

// The most memory that an export of so many photos took.
long ExportKib(const fs::path& folder, int photos) {
  const PinholeCamera camera(kWidthPx, kHeightPx, 1500, 1500, kWidthPx / 2, kHeightPx / 2);
  std::vector<CourtyardPhoto> taken;
  fs::create_directories(folder / "images");
  for (const Pose& pose : CourtyardArc(photos)) {
    taken.push_back({std::to_string(taken.size()) + ".png", camera, pose});
    io::WriteImage(folder / "images" / taken.back().name, ImageRgb8(kWidthPx, kHeightPx, 3, 100));
  }
  colmap::WriteModel(folder / "sparse", CourtyardModel(taken), colmap::Format::kBinary);
  const std::string set = (folder / "set.dtr").string();
  DtrOk({"import", "--format", "colmap", "--cameras", (folder / "sparse").string(), "--images",
         (folder / "images").string(), "-o", set});
  const ProcessResult ran = RunProcess(
      {DTR_PROGRAM, "export", set, "-o", (folder / "out").string(), "--threads", "1"}, {});
  EXPECT_TRUE(ran.Ok());
  EXPECT_EQ(FilesIn(folder / "out/images"), photos);
  const auto points = colmap::ReadModel(folder / "out/sparse/0").points;
  EXPECT_FALSE(points.empty());
  for (const auto& [id, point] : points) EXPECT_EQ(point.rgb[1], 100) << id;
  return ran.max_rss_kib;
}

TEST(ExportCommand, HoldsOneImageAtATime) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer keeps what was freed";
#endif
  const TemporaryFolder folder;
  const long few = ExportKib(folder / "few", 2), many = ExportKib(folder / "many", 14);
  constexpr long kImageKib = 9 * 1024;
  EXPECT_LT(many - few, 3 * kImageKib);  // 12 more would be 12 of them
}

// A set with true depth and no sparse points, as `dtr import` makes it of an RGB-D collection.
class ExportOfDepth : public ::testing::Test {
 protected:
  void SetUp() override {
    MakeSmallCourtyard(folder_ / "courtyard");
    ImportSmallCourtyard(folder_ / "courtyard", folder_ / "set.dtr");
  }
  fs::path Export(const std::string& name, const std::string& threads) {
    DtrOk({"export", (folder_ / "set.dtr").string(), "-o", (folder_ / name).string(), "--threads",
           threads, "--json", (folder_ / "result.json").string(), "--force"});
    return folder_ / name;
  }
  TemporaryFolder folder_;
};

TEST_F(ExportOfDepth, HasPointsOfItsSurfacesForGaussianSplatting) {
  const fs::path out = Export("out", "2");
  EXPECT_TRUE(fs::exists(out / "sparse/0/points3D.bin"));
  const calib::SfmModel model = colmap::ReadModel(out / "sparse/0");
  for (const auto& image : model.images) EXPECT_TRUE(fs::exists(out / "images" / image.name));
  const auto json = nlohmann::json::parse(Text(folder_ / "result.json"));
  EXPECT_EQ(json["points_from"], "depth");
  EXPECT_EQ(json["points"], model.points.size());
  EXPECT_GT(model.points.size(), 1000u);
  EXPECT_LE(model.points.size(), 100'000u);
  // The courtyard is no black place.
  size_t coloured = 0;
  for (const auto& [id, point] : model.points) coloured += point.rgb[0] + point.rgb[1] > 0;
  EXPECT_GT(coloured, model.points.size() * 9 / 10);
}

TEST_F(ExportOfDepth, IsTheSameForAnyNumberOfThreadsAndIsImportedAgain) {
  const fs::path a = Export("a", "1"), b = Export("b", "3");
  EXPECT_THAT(DifferingFiles(Contents(a), Contents(b)), ::testing::IsEmpty());
  // The folder as a whole, its sparse/ and sparse/0 are the same model.
  int number = 0;
  for (const fs::path& cameras : {a, a / "sparse", a / "sparse/0"}) {
    const std::string set = (folder_ / (std::to_string(number++) + ".dtr")).string();
    DtrOk(
        {"import", "--cameras", cameras.string(), "--images", (a / "images").string(), "-o", set});
    EXPECT_EQ(io::ReadSet(set).frames[0].views.size(), static_cast<size_t>(kCourtyardViews));
  }
}

TEST_F(ExportOfDepth, TheEndingOfTheNameDecidesAndAMismatchIsRejected) {
  const std::string set = (folder_ / "set.dtr").string();
  const auto name = [&](const char* file) { return (folder_ / file).string(); };
  DtrOk({"export", set, "-o", name("x.ply")});
  EXPECT_THAT(Text(name("x.ply")).substr(0, 3), "ply");
  DtrOk({"export", set, "-o", name("X.GLB")});
  EXPECT_THAT(Text(name("X.GLB")).substr(0, 4), "glTF");
  DtrOk({"export", set, "-o", name("x.splat")});
  EXPECT_TRUE(fs::is_regular_file(name("x.splat")));
  DtrOk({"export", set, "-o", name("x.html"), "--no-evaluate"});
  EXPECT_THAT(Text(name("x.html")), ::testing::HasSubstr("<!doctype html>"));
  DtrOk({"export", set, "-o", name("model")});
  EXPECT_TRUE(fs::exists(folder_ / "model/sparse/0/cameras.bin"));
  EXPECT_EQ(nlohmann::json::parse(Text(name("model/dtr-export.json")))["format"], "colmap");
  // With --format a folder may have a dot in its name, but not a file's ending.
  DtrOk({"export", set, "-o", name("model.v2"), "--format", "colmap"});
  ExpectRejected(Dtr({"export", set, "-o", name("y.ply"), "--format", "colmap"}), kWrongUsage,
                 "--format colmap writes a folder, and '.ply' is the ending of a file");
  ExpectRejected(Dtr({"export", set, "-o", name("y.html"), "--format", "nerfstudio"}), kWrongUsage,
                 "--format nerfstudio writes a folder, and '.html' is the ending of a file");
  ExpectRejected(Dtr({"export", set, "-o", name("y.las"), "--format", "ply"}), kWrongUsage,
                 "expected a name ending in .ply");
  ExpectRejected(Dtr({"export", set, "-o", name("y.obj")}), kWrongUsage,
                 "no format writes files that end in '.obj'");
  for (const char* file : {"y.ply", "y.html", "y.las", "y.obj"}) {
    EXPECT_FALSE(fs::exists(name(file))) << file;
  }
}

// A working folder: photos, and beside them what the program made of them.
TEST(OwnOutputs, AFolderWithEverythingThatWasMadeInItIsItsPhotosAlone) {
  const TemporaryFolder folder;
  MakeSmallCourtyard(folder / "courtyard");
  fs::create_directories(folder / "work");
  for (const auto& photo : fs::directory_iterator(folder / "courtyard/images")) {
    fs::copy_file(photo.path(), folder / "work" / photo.path().filename());
  }
  const auto name = [&](const char* file) { return (folder / "work" / file).string(); };
  const auto photos_of = [&] {
    DtrOk({"capture", name(""), "-o", (folder / "cap").string(), "--force", "--json",
           (folder / "cap.json").string()});
    return nlohmann::json::parse(Text(folder / "cap.json"))["contents"];
  };
  const auto before = photos_of();
  const std::string set = name("scene.dtr");
  ImportSmallCourtyard(folder / "courtyard", set);
  DtrOk({"capture", name(""), "-o", name("captured")});
  DtrOk({"export", set, "-o", name("model")});
  DtrOk({"export", set, "--format", "nerfstudio", "-o", name("nerf")});
  DtrOk({"export", set, "--format", "depth", "-o", name("depth_maps")});
  DtrOk({"render", set, "--like", "0002", "-o", name("0002.png"), "--depth-out",
         name("0002-depth.exr"), "--coverage-out", name("0002-seen.png")});
  DtrOk({"render", set, "--like", "0003", "-o", name("view.jpg")});
  DtrOk({"render", set, "--fly-through", "3", "-o", name("frames")});
  DtrOk({"evaluate", set, "--leave-one-out", "--images", name("comparison")});
  const auto after = photos_of();
  EXPECT_EQ(after["photos"], before["photos"]);
  EXPECT_EQ(after["cameras"], before["cameras"]);
  EXPECT_EQ(after["masks"], 0);
  const Ran again = DtrOk({"capture", name(""), "-o", (folder / "cap2").string()});
  EXPECT_THAT(again.err, ::testing::HasSubstr("folders that dtr made ("));
  EXPECT_THAT(again.err, ::testing::HasSubstr("captured/, depth_maps/, model/, nerf/"));
  EXPECT_THAT(again.err, ::testing::HasSubstr("images that dtr rendered ("));
}

}  // namespace
}  // namespace dtr::testing
