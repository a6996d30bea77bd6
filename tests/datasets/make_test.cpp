#include "datasets/make.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "datasets/layout.h"
#include "datasets/render_truth.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/formats/cameras_json.h"
#include "dtr/io/image_io.h"
#include "dtr/types/panorama.h"
#include "tests/support/on_threads.h"
#include "tests/support/test_data.h"

namespace dtr::datasets {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kFileLimit = 1 << 24;

DatasetSpec Small(const std::string& scene) {
  DatasetSpec spec;
  spec.scene = scene;
  spec.views = 4;
  spec.width_px = 72;
  spec.height_px = 48;
  spec.supersampling = 1;
  return spec;
}

/// All files below a folder: relative path -> content.
std::map<std::string, std::string> Contents(const fs::path& folder) {
  std::map<std::string, std::string> contents;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    contents[fs::relative(entry.path(), folder).generic_string()] =
        ReadFile(entry.path(), kFileLimit);
  }
  return contents;
}

void Make(const DatasetSpec& spec, const fs::path& folder, int threads = 1) {
  SilentProgress progress;
  OnThreads(threads, [&] { return MakeDataset(spec, folder, progress); });
}

TEST(MakeDataset, WritesWhatItPromises) {
  const testing::TemporaryFolder folder;
  DatasetSpec spec = Small("courtyard");
  Make(spec, folder / "set");
  EXPECT_FALSE(fs::exists(folder / "set.partial"));
  const auto contents = Contents(folder / "set");
  std::set<std::string> names;
  for (const auto& [name, content] : contents) {
    names.insert(name);
    EXPECT_FALSE(content.empty());
  }
  std::set<std::string> expected = {"SOURCE.md", "cameras.json", "dataset.json"};
  for (const std::string i : {"0000", "0001", "0002", "0003"}) {
    expected.insert("images/" + i + ".jpg");
    expected.insert("depth/" + i + ".exr");
    expected.insert("masks/" + i + "_visible.png");
    expected.insert("masks/" + i + "_texture.png");
  }
  EXPECT_EQ(names, expected);

  const io::ImageHeader header = io::ReadImageHeader(folder / "set/images/0002.jpg");
  EXPECT_EQ(header.width_px, 72);
  EXPECT_EQ(header.height_px, 48);
  ASSERT_TRUE(header.focal_35mm && header.focal_mm);
  EXPECT_DOUBLE_EQ(*header.focal_35mm, 28);
  EXPECT_NEAR(*header.focal_mm, 28, 1e-6);

  const io::CameraList list = io::ReadCamerasJson(folder / "set/cameras.json");
  ASSERT_EQ(list.cameras.size(), 4u);
  EXPECT_EQ(list.unit, LengthUnit::kMetre);
  EXPECT_EQ(list.cameras[1].name, "0001.jpg");
  EXPECT_EQ(list.cameras[1].depth_file, "0001.exr");
  EXPECT_EQ(list.cameras[1].depth_kind, DepthKind::kPlaneZ);
  EXPECT_EQ(list.cameras[1].camera, MakeCamera(72, 48));

  // Cameras and depth maps of the files fit each other and the scene.
  const Scene scene = MakeScene("courtyard", spec.seed);
  for (const io::NamedCamera& camera : list.cameras) {
    const Grid<float> depth = io::ReadFloatGrid(folder / "set/depth" / camera.depth_file);
    EXPECT_EQ(std::count(depth.data().begin(), depth.data().end(), 0.0f), 0);
    const DepthImage truth = RenderDepth(scene, camera.camera, camera.cam_from_world);
    int equal = 0;
    for (size_t i = 0; i < depth.data().size(); ++i) {
      equal += std::abs(depth.data()[i] / truth.grid().data()[i] - 1) < 1e-6 ? 1 : 0;
    }
    // Rounding of the written pose may move a pixel across an edge, nothing more.
    EXPECT_GT(equal, 72 * 48 - 10);
  }
}

TEST(MakeDataset, SameRecipeGivesTheSameBytesForAnyNumberOfThreads) {
  const testing::TemporaryFolder folder;
  DatasetSpec spec = Small("room");
  spec.noise = 2;
  spec.exposure_drift = 0.5;
  spec.k1 = -0.1;
  Make(spec, folder / "one", 1);
  const auto one = Contents(folder / "one");
  const DatasetSpec again = ParseSpecJson(one.at("dataset.json"), "dataset.json");
  Make(again, folder / "two", 2);
  EXPECT_EQ(one, Contents(folder / "two"));
}

TEST(MakeDataset, WorldOffsetAndScaleChangeTheWrittenWorldOnly) {
  const testing::TemporaryFolder folder;
  DatasetSpec spec = Small("stairs");
  Make(spec, folder / "here");
  spec.world_offset = {5e5, 4.5e6, 100};
  spec.scale = 250;
  Make(spec, folder / "there");
  const auto here = Contents(folder / "here"), there = Contents(folder / "there");
  for (const auto& [name, content] : here) {
    if (name.starts_with("images/") || name.starts_with("masks/")) {
      EXPECT_EQ(content, there.at(name)) << name;
    }
  }
  const io::CameraList a = io::ReadCamerasJson(folder / "here/cameras.json");
  const io::CameraList b = io::ReadCamerasJson(folder / "there/cameras.json");
  EXPECT_EQ(b.unit, LengthUnit::kArbitrary);
  // Half an ulp at 4.5e6 is 5e-10; a handful of them add up in a centre.
  constexpr double kCentre = 1e-8;
  for (size_t i = 0; i < a.cameras.size(); ++i) {
    EXPECT_LT(
        a.cameras[i].cam_from_world.rotation.angularDistance(b.cameras[i].cam_from_world.rotation),
        1e-15);
    const Eigen::Vector3d expected =
        250 * a.cameras[i].cam_from_world.TargetOriginInSource() + spec.world_offset;
    EXPECT_LT((b.cameras[i].cam_from_world.TargetOriginInSource() - expected).norm(), kCentre);
    const Grid<float> za = io::ReadFloatGrid(folder / "here/depth" / a.cameras[i].depth_file);
    const Grid<float> zb = io::ReadFloatGrid(folder / "there/depth" / b.cameras[i].depth_file);
    for (size_t k = 0; k < za.data().size(); ++k) {
      // One rounding to float each.
      ASSERT_NEAR(zb.data()[k] / (250.0 * za.data()[k]), 1, 1.2e-7);
    }
  }
}

TEST(MakeDataset, ExposureDriftsEvenlyInStops) {
  EXPECT_DOUBLE_EQ(ExposureGain(0, 3, 8), 1);
  EXPECT_DOUBLE_EQ(ExposureGain(1, 0, 5), std::exp2(-0.5));
  EXPECT_DOUBLE_EQ(ExposureGain(1, 2, 5), 1);
  EXPECT_DOUBLE_EQ(ExposureGain(1, 4, 5) / ExposureGain(1, 0, 5), 2);
  EXPECT_DOUBLE_EQ(ExposureGain(-2, 1, 3), 1);

  // The photos show it: the same recipe with and without drift.
  const testing::TemporaryFolder folder;
  DatasetSpec spec = Small("room");
  Make(spec, folder / "even");
  spec.exposure_drift = 1.5;
  Make(spec, folder / "drift");
  const auto mean = [&](const std::string& file) {
    const ImageRgb8 image = io::ReadImage(folder / file);
    double sum = 0;
    for (const std::uint8_t level : image.data()) sum += level;
    return sum / static_cast<double>(image.data().size());
  };
  EXPECT_LT(mean("drift/images/0000.jpg"), 0.9 * mean("even/images/0000.jpg"));
  EXPECT_GT(mean("drift/images/0003.jpg"), 1.1 * mean("even/images/0003.jpg"));
}

TEST(MakeDataset, LensBendsThePhotosAndLeavesTruthAlone) {
  const testing::TemporaryFolder folder;
  DatasetSpec spec = Small("courtyard");
  Make(spec, folder / "ideal");
  spec.k1 = -0.12;
  spec.k2 = 0.02;
  Make(spec, folder / "bent");
  const auto ideal = Contents(folder / "ideal"), bent = Contents(folder / "bent");
  EXPECT_NE(ideal.at("images/0001.jpg"), bent.at("images/0001.jpg"));
  for (const auto& [name, content] : ideal) {
    if (name.starts_with("images/") || name == "dataset.json" || name == "SOURCE.md") continue;
    EXPECT_EQ(content, bent.at(name)) << name;
  }
}

TEST(MakeDataset, PanoramasAndTheViewsAroundThemShowTheSame) {
  const testing::TemporaryFolder folder;
  DatasetSpec spec = Small("room");
  spec.panoramas = true;
  spec.views = 2;
  spec.width_px = 256;
  spec.supersampling = 3;
  spec.jpeg_quality = 100;
  Make(spec, folder / "set");
  EXPECT_EQ(FormatSpecJson(ParseSpecJson(FormatSpecJson(spec), "spec")), FormatSpecJson(spec));
  const io::CameraList list = io::ReadCamerasJson(folder / "set/cameras.json");
  ASSERT_EQ(list.cameras.size(), 12u);
  const ImageRgb8 whole = io::ReadImage(folder / "set/panoramas/0001.jpg");
  ASSERT_EQ(whole.width(), 256);
  ASSERT_EQ(whole.height(), 128);
  EXPECT_TRUE(io::ReadImageHeader(folder / "set/panoramas/0001.jpg").panorama);
  const Panorama panorama{256, 128, 0, 0};
  for (const PanoramaFace& face : PanoramaFaces()) {
    const ImageRgb8 view = io::ReadImage(folder / "set/images" / face.name / "0001.jpg");
    const PinholeCamera camera = FaceCamera(view.width());
    double difference = 0, contrast = 0;
    int count = 0;
    // Around the middle of a view both have the same resolution.
    for (int y = view.height() / 3; y < 2 * view.height() / 3; ++y) {
      for (int x = view.width() / 3; x < 2 * view.width() / 3; ++x) {
        const Eigen::Vector2d pixel = panorama.PixelFromDirection(
            face.cam_from_panorama.transpose() * camera.RayFromPixel({x + 0.5, y + 0.5}));
        const int u = std::min(255, static_cast<int>(pixel.x()));
        const int v = std::min(127, static_cast<int>(pixel.y()));
        difference += std::abs(view(x, y, 1) - whole(u, v, 1));
        contrast += std::abs(view(x, y, 1) - whole((u + 100) % 256, v, 1));
        ++count;
      }
    }
    // The nearest pixel lies up to half a pixel aside; anywhere else the image is another.
    EXPECT_LT(difference / count, 12) << face.name;  // 8.5 was measured where texture is finest
    EXPECT_LT(difference, 0.5 * contrast) << face.name;
    const Grid<float> depth = io::ReadFloatGrid(folder / "set/depth" / face.name / "0001.exr");
    EXPECT_EQ(depth.width(), view.width());
    EXPECT_EQ(std::count(depth.data().begin(), depth.data().end(), 0.0f), 0);
  }
  // All views of a panorama stand in one point.
  EXPECT_LT((list.cameras[0].cam_from_world.TargetOriginInSource() -
             list.cameras[5].cam_from_world.TargetOriginInSource())
                .norm(),
            1e-12);
  spec.width_px = 255;
  EXPECT_THROW(Make(spec, folder / "odd"), UsageError);
}

TEST(MakeDataset, WrongRequestsAreRejectedBeforeAnyFileIsWritten) {
  const testing::TemporaryFolder folder;
  const auto reject = [&](auto change, const std::string& word) {
    DatasetSpec spec = Small("plane");
    change(spec);
    try {
      Make(spec, folder / "set");
      FAIL() << word;
    } catch (const UsageError& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
    EXPECT_FALSE(fs::exists(folder / "set"));
    EXPECT_FALSE(fs::exists(folder / "set.partial"));
  };
  reject([](DatasetSpec& s) { s.views = 1; }, "views");
  reject([](DatasetSpec& s) { s.views = 20000; }, "views");
  reject([](DatasetSpec& s) { s.width_px = 0; }, "width");
  reject([](DatasetSpec& s) { s.height_px = 1 << 20; }, "height");
  reject([](DatasetSpec& s) { s.noise = std::nan(""); }, "noise");
  reject([](DatasetSpec& s) { s.scale = 0; }, "scale");
  reject([](DatasetSpec& s) { s.world_offset.y() = HUGE_VAL; }, "world offset");
  reject([](DatasetSpec& s) { s.jpeg_quality = 101; }, "quality");
  reject([](DatasetSpec& s) { s.scene = "moon"; }, "moon");
  reject([](DatasetSpec& s) { s.layout = "ring"; }, "ring");
  reject([](DatasetSpec& s) { s.k1 = -3; }, "lens");

  fs::create_directory(folder / "taken");
  EXPECT_THROW(Make(Small("plane"), folder / "taken"), UsageError);
  EXPECT_TRUE(fs::is_empty(folder / "taken"));
}

TEST(DatasetSpec, JsonRoundTripsAndRejectsEveryTruncation) {
  DatasetSpec spec = Small("sphere");
  spec.layout = "grid";
  spec.noise = 0.1;
  spec.exposure_drift = -1.0 / 3;
  spec.k1 = 0.0123456789012345;
  spec.seed = 18446744073709551615u;
  spec.world_offset = {5e5, 4.5e6, 100.25};
  spec.scale = 1e-3;
  const std::string text = FormatSpecJson(spec);
  EXPECT_EQ(FormatSpecJson(ParseSpecJson(text, "dataset.json")), text);
  for (size_t length = 0; length + 2 < text.size(); ++length) {
    EXPECT_THROW(ParseSpecJson(text.substr(0, length), "dataset.json"), Error) << length;
  }
  const std::string deep = text.substr(0, text.rfind('}')) +
                           ", \"more\": " + std::string(100'000, '[') + std::string(100'000, ']') +
                           "}";
  EXPECT_THROW(ParseSpecJson(deep, "dataset.json"), Error);
  // A wrong value is shown by its beginning, whatever it is.
  const std::string huge = "{\"generator_version\": [" + std::string(50'000, ' ') + "\"" +
                           std::string(50'000, 'x') + "\"]}";
  try {
    ParseSpecJson(huge, "dataset.json");
    ADD_FAILURE() << "read";
  } catch (const Error& error) {
    EXPECT_LT(std::string(error.what()).size(), 200u);
  }
  for (const auto& [from, to] :
       {std::pair<std::string, std::string>{"\"views\": 4", "\"views\": -4"},
        {"\"views\": 4", "\"views\": 4.5"},
        {"\"views\": 4", "\"view\": 4"},
        {"\"scale\": 0.001", "\"scale\": \"big\""},
        {"\"generator_version\": 1", "\"generator_version\": 99"},
        {"500000.0,", ""}}) {
    std::string broken = text;
    const size_t at = broken.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    broken.replace(at, from.size(), to);
    EXPECT_THROW(ParseSpecJson(broken, "dataset.json"), Error) << to;
  }
}

}  // namespace
}  // namespace dtr::datasets
