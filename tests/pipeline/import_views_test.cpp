#include "pipeline/import/detail/import_views.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>

#include "dtr/base/error.h"
#include "dtr/base/hash.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "dtr/render/geometry.h"
#include "tests/support/on_threads.h"
#include "tests/support/test_data.h"

namespace dtr::pipeline {
namespace {

using namespace io;

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int kWidth = 96, kHeight = 70, kViews = 5;
constexpr double kPlaneZ = 4;  // the scene: a plane before cameras in a row

// A folder of photos and depth maps of a plane, seen by a row of cameras.
class ImportTest : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(folder_ / "images");
    fs::create_directories(folder_ / "depth");
    fs::create_directories(folder_ / "masks");
    for (int i = 0; i < kViews; ++i) {
      NamedCamera named;
      named.name = "photo " + std::to_string(i) + ".png";
      named.camera = PinholeCamera(kWidth, kHeight, 80, 81, 48.5, 34);
      named.cam_from_world.translation = {-0.3 * i * i, 0.1 * i, 0};
      ImageRgb8 image(kWidth, kHeight, 3, static_cast<std::uint8_t>(40 * i));
      image(3, 5, 1) = 200;
      WriteImage(folder_ / "images" / named.name, image);
      Grid<float> depth(kWidth, kHeight, 1, static_cast<float>(kPlaneZ));
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) depth(x, y) += 0.01f * static_cast<float>(x);
      }
      depth(0, 0) = 0;
      WriteExr(folder_ / "depth" / ("photo " + std::to_string(i) + ".exr"), depth);
      list_.cameras.push_back(named);
    }
    list_.unit = LengthUnit::kMetre;
    options_.images_dir = folder_ / "images";
    options_.depth_dir = folder_ / "depth";
    options_.depth_coding = DepthCoding::kExrFloat;
  }

  void Import(const std::string& name, const SparseScene* points = nullptr) {
    SilentProgress progress;
    ImportSet(list_, options_, folder_ / name, false, points, progress);
  }

  std::string ErrorOfImport(const SparseScene* points = nullptr) {
    try {
      Import("failed.dtr", points);
    } catch (const Error& e) {
      EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
      EXPECT_FALSE(fs::exists(folder_ / "failed.dtr"));
      return e.what();
    }
    return "no error";
  }

  testing::TemporaryFolder folder_;
  CameraList list_;
  ImportOptions options_;
};

SparseScene Points(const Eigen::Vector3d& where) {
  SparseScene scene;
  for (int i = 0; i < 9; ++i) {
    scene.points.push_back({where + Eigen::Vector3d(i % 3 - 1, i / 3 - 1, kPlaneZ)});
  }
  for (int view = 0; view < kViews; ++view) {
    for (int point = 0; point < 9; ++point) scene.observations.push_back({view, point, {10, 20}});
  }
  return scene;
}

TEST_F(ImportTest, TransparentPixelsAreMaskedAndHaveNoDepth) {
  Mask alpha(kWidth, kHeight, 1, 255);
  alpha(95, 3) = 0;
  const std::string name = list_.cameras[1].name;
  const ImageRgb8 image = ReadImage(folder_ / "images" / name);
  list_.cameras[1].name = "alpha.png";
  fs::rename(folder_ / "depth/photo 1.exr", folder_ / "depth/alpha.exr");
  WriteImageWithAlpha(folder_ / "images/alpha.png", image, alpha);
  Import("a.dtr");
  const View view = LoadSet(folder_ / "a.dtr").frames[0].views[1];
  EXPECT_EQ(view.mask, alpha);
  EXPECT_EQ(view.image(95, 3, 1), 0);
  EXPECT_EQ(view.depth(95, 3), 0);
  EXPECT_GT(view.depth(94, 3), 0);
}

TEST_F(ImportTest, TheSetHoldsWhatTheFilesHold) {
  Mask mask(kWidth, kHeight, 1, 255);
  mask(7, 8) = 0;
  WriteMask(folder_ / "masks/m.png", mask);
  list_.cameras[1].mask_file = "m.png";
  Import("a.dtr");
  const DtrSet set = LoadSet(folder_ / "a.dtr");
  ASSERT_EQ(set.frames.at(0).views.size(), size_t{kViews});
  EXPECT_EQ(set.unit, LengthUnit::kMetre);
  for (int i = 0; i < kViews; ++i) {
    const View& view = set.frames[0].views[size_t(i)];
    const NamedCamera& named = list_.cameras[size_t(i)];
    EXPECT_EQ(view.name, named.name);
    EXPECT_EQ(view.camera, named.camera);
    EXPECT_EQ(view.cam_from_world.translation, named.cam_from_world.translation);
    EXPECT_EQ(view.image, ReadImage(folder_ / "images" / named.name));
    EXPECT_EQ(view.depth(0, 0), 0);
    EXPECT_EQ(view.depth(95, 3), static_cast<float>(kPlaneZ) + 0.01f * 95);
    EXPECT_EQ(view.mask.empty(), i != 1);
  }
  EXPECT_EQ(set.frames[0].views[1].mask, mask);
  EXPECT_THAT(VerifySet(folder_ / "a.dtr"), ::testing::IsEmpty());
}

TEST_F(ImportTest, GeometryIsThatOfTheLoadedSet) {
  Import("a.dtr");
  const DtrSet set = LoadSet(folder_ / "a.dtr");
  DtrSet expected = set;
  FinishGeometry(expected);
  constexpr double kRounding = 1e-12;  // the coarse grid's camera has other roundings
  EXPECT_LT((set.scene_center - expected.scene_center).norm(), kRounding);
  EXPECT_LT((set.bounds.min - expected.bounds.min).norm(), kRounding);
  EXPECT_LT((set.bounds.max - expected.bounds.max).norm(), kRounding);
  for (size_t i = 0; i < kViews; ++i) {
    EXPECT_GT(set.frames[0].views[i].reference_baseline, 0.1);
    EXPECT_NEAR(set.frames[0].views[i].reference_baseline,
                expected.frames[0].views[i].reference_baseline, kRounding);
  }
}

TEST_F(ImportTest, BytesDoNotDependOnThreads) {
  options_.depth_coding = DepthCoding::kPng16InverseDepth;
  std::optional<ThreadLimit> limit;
  limit.emplace(1);
  Import("one.dtr");
  limit.emplace(3);
  Import("three.dtr");
  int files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder_ / "one.dtr")) {
    if (!entry.is_regular_file()) continue;
    const fs::path other =
        (folder_ / "three.dtr") / fs::relative(entry.path(), folder_ / "one.dtr");
    EXPECT_EQ(Sha256OfFile(entry.path()), Sha256OfFile(other)) << other;
    ++files;
  }
  EXPECT_GE(files, 2 * kViews + 1);
}

TEST_F(ImportTest, RayDistancesBecomePlaneZ) {
  options_.depth_kind = DepthKind::kRayDistance;
  const View view = ImportViews(list_, options_).at(2);
  EXPECT_EQ(view.depth.kind(), DepthKind::kPlaneZ);
  const double ray = kPlaneZ + 0.01f * 20;
  const double length =
      std::hypot((20.5 - 48.5) / 80, (60.5 - 34.0) / 81, 1.0);  // of the pixel's ray at z = 1
  constexpr double kFloat = 1e-6;
  EXPECT_NEAR(view.depth(20, 60), ray / length, kFloat);
}

TEST_F(ImportTest, MapsOfHalfTheSizeKeepTheirScale) {
  for (const NamedCamera& named : list_.cameras) {
    const Grid<float> half(kWidth / 2, kHeight / 2, 1, 3.0f);
    WriteExr(folder_ / "depth" / fs::path(named.name).replace_extension(".exr"), half);
  }
  Import("a.dtr");
  const DtrSet set = LoadSet(folder_ / "a.dtr");
  EXPECT_EQ(set.frames[0].views[0].depth_scale, 2);
  EXPECT_EQ(set.frames[0].views[0].depth.width(), kWidth / 2);
}

TEST_F(ImportTest, HeldOutViewsHaveNoDepthAndMoveNothing) {
  options_.held_out = {list_.cameras[4].name};
  Import("a.dtr");
  LoadOptions load;
  load.held_out = true;
  const DtrSet with = LoadSet(folder_ / "a.dtr", load);
  ASSERT_EQ(with.frames[0].views.size(), size_t{kViews});
  EXPECT_EQ(with.frames[0].views[4].role, ViewRole::kHeldOut);
  EXPECT_TRUE(with.frames[0].views[4].depth.empty());
  list_.cameras.pop_back();
  options_.held_out = {};
  Import("b.dtr");
  const DtrSet without = ReadSet(folder_ / "b.dtr");
  EXPECT_EQ(with.scene_center, without.scene_center);
  for (size_t i = 0; i + 1 < kViews; ++i) {
    EXPECT_EQ(with.frames[0].views[i].reference_baseline,
              without.frames[0].views[i].reference_baseline);
  }
}

TEST_F(ImportTest, AFarWorldIsStoredNearItsOriginWithItsPoints) {
  Import("near.dtr");
  const Eigen::Vector3d offset(5e5, 4.5e6, 100);
  const SparseScene points = Points(offset);
  for (NamedCamera& named : list_.cameras) {
    named.cam_from_world.translation -= named.cam_from_world.rotation * offset;
  }
  Import("far.dtr", &points);
  const DtrSet near = ReadSet(folder_ / "near.dtr"), far = ReadSet(folder_ / "far.dtr");
  EXPECT_LT((far.world_origin - offset).norm(), 10);
  constexpr double kStored = 2e-9;  // twice half the spacing of doubles at 4.5e6
  EXPECT_LT((far.world_origin + far.scene_center - offset - near.scene_center).norm(), kStored);
  for (const View& view : far.frames[0].views) EXPECT_LT(view.CenterInWorld().norm(), 10);
  const SparseScene stored = LoadSparse(folder_ / "far.dtr", far);
  EXPECT_LT((stored.points[0].p_in_world + far.world_origin - points.points[0].p_in_world).norm(),
            kStored);
}

TEST_F(ImportTest, PointsStandInWhereNobodyGivesDepth) {
  options_.depth_dir.clear();
  EXPECT_THAT(ErrorOfImport(), HasSubstr("expected depth maps"));
  const SparseScene points = Points({0, 0, 0});
  Import("a.dtr", &points);
  const DtrSet set = LoadSet(folder_ / "a.dtr");
  EXPECT_TRUE(set.frames[0].views[0].depth.empty());
  EXPECT_LT((set.scene_center - Eigen::Vector3d(0, 0, kPlaneZ)).norm(), 1e-9);
}

TEST_F(ImportTest, WhatIsMissingOrDoesNotFitIsNamed) {
  const NamedCamera good = list_.cameras[2];
  list_.cameras[2].name = "absent.png";
  EXPECT_THAT(ErrorOfImport(), HasSubstr("absent.png"));
  list_.cameras[2] = good;
  list_.cameras[2].camera = PinholeCamera(kWidth, kHeight + 1, 80, 81, 48, 34);
  EXPECT_THAT(ErrorOfImport(), HasSubstr("expected 96x71 pixels as the camera says, found 96x70"));
  list_.cameras[2] = good;
  list_.cameras[2].mask_file = "none.png";
  EXPECT_THAT(ErrorOfImport(), HasSubstr("masks/none.png"));
  list_.cameras[2] = good;
  list_.cameras[2].depth_file = "none.exr";
  EXPECT_THAT(ErrorOfImport(), HasSubstr("none.exr"));
  list_.cameras[2] = good;
  options_.held_out = {"nobody.png"};
  EXPECT_THAT(ErrorOfImport(), HasSubstr("nobody.png"));
  options_.held_out = {};
  WriteExr(folder_ / "depth/photo 2.exr", Grid<float>(kWidth, kHeight - 1, 1, 2.0f));
  EXPECT_THAT(ErrorOfImport(),
              HasSubstr("photo 2.exr: a depth map of 96x69 pixels has another shape"));
  fs::remove(folder_ / "depth/photo 2.exr");
  EXPECT_THAT(ErrorOfImport(), HasSubstr("named like the photo photo 2.png, found 0"));
}

TEST_F(ImportTest, DepthsThatCannotBeWorkedWithAreNamed) {
  Grid<float> depth(kWidth, kHeight, 1, 2.0f);
  depth(7, 3) = 3e38f;
  WriteExr(folder_ / "depth/photo 2.exr", depth);
  EXPECT_THAT(
      ErrorOfImport(),
      HasSubstr("photo 2.exr: its depth of 3e+38 units at pixel (7, 3) cannot be computed with"));
  depth(7, 3) = 1e18f;
  WriteExr(folder_ / "depth/photo 2.exr", depth);
  options_.completion = true;  // it goes farther still
  Import("far.dtr");
  EXPECT_EQ(LoadSet(folder_ / "far.dtr").frames[0].views[2].depth(7, 3), 1e18f);
}

TEST_F(ImportTest, AMaskThatLeavesNothingIsRejected) {
  options_.mask_dir = folder_ / "masks";
  fs::create_directory(options_.mask_dir);
  list_.cameras[0].mask_file = "ones.png";
  WriteImage(options_.mask_dir / "ones.png", ImageRgb8(kWidth, kHeight, 3, 1));
  EXPECT_THAT(ErrorOfImport(), HasSubstr("found it dark throughout; what is to be used is 255"));
}

TEST_F(ImportTest, ExtensionsOfDepthMayBeOfCapitals) {
  Import("small.dtr");
  fs::rename(folder_ / "depth/photo 0.exr", folder_ / "depth/photo 0.EXR");
  Import("capital.dtr");
  EXPECT_EQ(Sha256OfFile(folder_ / "small.dtr/set.json"),
            Sha256OfFile(folder_ / "capital.dtr/set.json"));
}

TEST_F(ImportTest, WholeNumbersNeedAStatedUnit) {
  for (const NamedCamera& named : list_.cameras) {
    const fs::path file = folder_ / "depth" / named.name;
    WritePng16(file, Grid<std::uint16_t>(kWidth, kHeight, 1, 2500));
    fs::remove(fs::path(file).replace_extension(".exr"));
  }
  EXPECT_THAT(ErrorOfImport(), HasSubstr("`depth_unit`"));
  options_.depth_unit = 0.001;
  EXPECT_EQ(ImportViews(list_, options_).at(0).depth(4, 4), 2.5f);
}

// A JPEG with an EXIF orientation in its smallest form: the tag is put before the image data.
void WriteTurned(const fs::path& file, const ImageRgb8& image, char orientation) {
  WriteImage(file, image);
  std::ifstream in(file, std::ios::binary);
  std::string jpeg((std::istreambuf_iterator<char>(in)), {});
  std::string exif(
      "\xff\xe1\x00\x22"
      "Exif\0\0"
      "II*\0\x08\0\0\0"
      "\x01\0"
      "\x12\x01\x03\0\x01\0\0\0\x06\0\0\0"
      "\0\0\0\0",
      36);
  exif[28] = orientation;
  jpeg.insert(2, exif);
  std::ofstream(file, std::ios::binary) << jpeg;
}

// An image whose left half is bright and right half dark.
ImageRgb8 BrightLeft(int width, int height) {
  ImageRgb8 image(width, height, 3, 20);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width / 2; ++x) {
      for (int c = 0; c < 3; ++c) image(x, y, c) = 230;
    }
  }
  return image;
}

TEST_F(ImportTest, TheCamerasSizeSaysWhichPixelsOfATurnedPhotoAreMeant) {
  // Orientation 6: the stored left side is the upright top.
  const std::string name = "photo 0.jpg";
  WriteTurned(folder_ / "images" / name, BrightLeft(kWidth, kHeight), 6);
  options_.depth_dir.clear();
  NamedCamera camera = list_.cameras[0];
  camera.name = name;
  const auto corners = [&] {
    const ImageRgb8 image = ImportView(camera, "a", options_).image;
    const int right = image.width() - 3, bottom = image.height() - 3;
    return std::array{image(2, 2) > 128, image(right, 2) > 128, image(2, bottom) > 128};
  };
  for (const PhotoGrid convention : {PhotoGrid::kStored, PhotoGrid::kUpright}) {
    options_.photo_grid = convention;
    camera.camera = PinholeCamera(kWidth, kHeight, 80, 81, 48, 34);
    EXPECT_EQ(corners(), (std::array{true, false, true})) << "stored";
    camera.camera = PinholeCamera(kHeight, kWidth, 80, 81, 34, 48);
    EXPECT_EQ(corners(), (std::array{true, true, false})) << "upright";
  }
}

TEST_F(ImportTest, WhereBothGridsFitTheFilesConventionDecides) {
  struct Case {
    int width, height;
    char orientation;
  };
  for (const Case& one : {Case{64, 64, 6}, Case{64, 64, 8}, Case{kWidth, kHeight, 3}}) {
    const std::string name = "photo 0.jpg";
    WriteTurned(folder_ / "images" / name, BrightLeft(one.width, one.height), one.orientation);
    options_.depth_dir.clear();
    NamedCamera camera = list_.cameras[0];
    camera.name = name;
    camera.camera = PinholeCamera(one.width, one.height, 80, 81, 32, 32);
    options_.photo_grid = PhotoGrid::kStored;
    const ImageRgb8 stored = ImportView(camera, "a", options_).image;
    options_.photo_grid = PhotoGrid::kUpright;
    const ImageRgb8 upright = ImportView(camera, "a", options_).image;
    EXPECT_GT(stored(2, 30), 128);
    EXPECT_EQ(upright, ApplyExifOrientation(stored, one.orientation)) << int(one.orientation);
    EXPECT_NE(upright, stored);
  }
}

TEST_F(ImportTest, MapsOfAnyRatioAreResampledToAGridThatASetHolds) {
  // 96x70 and a map of 32x23, a third but for rounding; the plane's depth grows to the right.
  Grid<float> map(32, 23);
  for (int y = 0; y < map.height(); ++y) {
    for (int x = 0; x < map.width(); ++x) {
      map(x, y) = static_cast<float>(1 / (0.2 + 0.001 * (3 * (x + 0.5))));
    }
  }
  WriteExr(folder_ / "depth/photo 0.exr", map);
  const View view = ImportView(list_.cameras[0], "a", options_);
  EXPECT_EQ(view.depth_scale, 2);
  ASSERT_EQ(view.depth.width(), 48);
  ASSERT_EQ(view.depth.height(), 35);
  constexpr double kInterpolated = 1e-5;  // float32, through 1/z and back
  for (int x = 0; x < 48; ++x) {
    const double z = 1 / (0.2 + 0.001 * 2 * (x + 0.5));
    EXPECT_NEAR(view.depth(x, 17) / z, 1, kInterpolated) << x;
  }
}

TEST_F(ImportTest, ATargetThatExistsIsKept) {
  Import("a.dtr");
  const std::string before = Sha256OfFile(folder_ / "a.dtr/set.json");
  EXPECT_THROW(Import("a.dtr"), UsageError);
  EXPECT_EQ(Sha256OfFile(folder_ / "a.dtr/set.json"), before);
}

}  // namespace
}  // namespace dtr::pipeline
