// The converted real sets: conventions proven on their data, with controls that must fail.
#include "datasets/convert/convert.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/formats/foreign_depth.h"
#include "dtr/io/image_io.h"
#include "dtr/io/set_io.h"
#include "pipeline/import/detail/import_views.h"
#include "tests/io/formats/residuals.h"
#include "tests/support/test_data.h"

namespace dtr::datasets {
namespace {

namespace fs = std::filesystem;
using dtr::testing::CarryDepth;
using dtr::testing::DataFolder;
using dtr::testing::DepthFit;
using dtr::testing::MatchImages;
using dtr::testing::MedianEpipolarPx;
using dtr::testing::TemporaryFolder;
using dtr::testing::WithFlippedAxes;
using dtr::testing::WithInvertedPose;
using dtr::testing::WithShift;

DepthImage DepthOf(const fs::path& folder, const io::NamedCamera& named) {
  return io::ReadForeignDepth(folder / "depth" / named.depth_file, named.depth_kind, 1.0,
                              named.camera.width_px(), named.camera.height_px());
}

// The same numbers, as if they were measured along the rays.
DepthImage AsRayDistance(const DepthImage& depth_z) {
  DepthImage ray(depth_z.width(), depth_z.height(), DepthKind::kRayDistance);
  ray.grid() = depth_z.grid();
  return ray;
}

// Images match their cameras' sizes; masks and depth are there where named.
void ExpectFilesFit(const fs::path& folder, const io::CameraList& list) {
  for (const io::NamedCamera& named : list.cameras) {
    const io::ImageHeader header = io::ReadImageHeader(folder / "images" / named.name);
    EXPECT_EQ(header.width_px, named.camera.width_px()) << named.name;
    EXPECT_EQ(header.height_px, named.camera.height_px()) << named.name;
    if (!named.depth_file.empty()) {
      EXPECT_TRUE(fs::exists(folder / "depth" / named.depth_file)) << named.depth_file;
      EXPECT_EQ(named.depth_kind, DepthKind::kPlaneZ);
    }
    if (!named.mask_file.empty()) {
      EXPECT_TRUE(fs::exists(folder / "masks" / named.mask_file)) << named.mask_file;
    }
  }
}

// Matches of views i and j lie on their epipolar lines, and would not with conventions read
// wrongly. `good_px` is what the set's calibration allows.
void ExpectEpipolarFit(const fs::path& folder, const io::CameraList& list, size_t i, size_t j,
                       int width_px, double good_px) {
  constexpr size_t kMinMatches = 50;
  constexpr double kBadTimesGood = 3;  // a control must be worse than this, or it proves nothing
  const io::NamedCamera &a = list.cameras.at(i), &b = list.cameras.at(j);
  const auto pairs = MatchImages(folder / "images" / a.name, folder / "images" / b.name, width_px);
  ASSERT_GT(pairs.size(), kMinMatches);
  // Epipolar lines hide a shift along themselves, so one across and one along are tried.
  const double found_px = MedianEpipolarPx(a, b, pairs);
  const double shifted_px = std::max(MedianEpipolarPx(WithShift(a, 20, 0), b, pairs),
                                     MedianEpipolarPx(WithShift(a, 0, 20), b, pairs));
  const double flipped_px = MedianEpipolarPx(WithFlippedAxes(a), WithFlippedAxes(b), pairs);
  const double inverted_px = MedianEpipolarPx(WithInvertedPose(a), WithInvertedPose(b), pairs);
  EXPECT_LT(found_px, good_px);
  EXPECT_GT(shifted_px, kBadTimesGood * good_px);
  EXPECT_GT(flipped_px, kBadTimesGood * good_px);
  EXPECT_GT(inverted_px, kBadTimesGood * good_px);
  std::cout << pairs.size() << " matches, median " << found_px << " px; shifted " << shifted_px
            << ", flipped " << flipped_px << ", inverted " << inverted_px << "\n";
}

// True when the depth of two views says the same, in enough places.
bool Fits(const DepthFit& fit, double good) {
  constexpr int kMinSamples = 1000;
  return fit.samples > kMinSamples && fit.median_difference < good;
}

// Frames of depth must meet within `good` scene units, and not within half as much again with
// conventions read wrongly.
void ExpectDepthFit(const fs::path& folder, const io::NamedCamera& a, const io::NamedCamera& b,
                    double good) {
  constexpr double kBad = 1.5;
  const DepthImage depth_a = DepthOf(folder, a), depth_b = DepthOf(folder, b);
  const DepthFit found = CarryDepth(a, depth_a, b, depth_b);
  const DepthFit flipped = CarryDepth(WithFlippedAxes(a), depth_a, WithFlippedAxes(b), depth_b);
  const DepthFit inverted = CarryDepth(WithInvertedPose(a), depth_a, WithInvertedPose(b), depth_b);
  const DepthFit shifted = CarryDepth(WithShift(a, 20, 20), depth_a, b, depth_b);
  const DepthFit as_ray = CarryDepth(a, AsRayDistance(depth_a), b, AsRayDistance(depth_b));
  EXPECT_TRUE(Fits(found, good));
  EXPECT_FALSE(Fits(flipped, kBad * good));
  EXPECT_FALSE(Fits(inverted, kBad * good));
  EXPECT_FALSE(Fits(shifted, kBad * good));
  EXPECT_FALSE(Fits(as_ray, kBad * good));
  std::cout << found.samples << " samples, median " << found.median_difference << "; flipped "
            << flipped.median_difference << " (" << flipped.samples << "), inverted "
            << inverted.median_difference << " (" << inverted.samples << "), shifted "
            << shifted.median_difference << ", read as ray distance " << as_ray.median_difference
            << "\n";
}

struct Converted {
  TemporaryFolder folder;
  fs::path out;
  io::CameraList list;
  Converted(const std::string& kind, const fs::path& source) : out(folder / "out") {
    ConvertDataset(kind, source, out);
    list = io::ReadCamerasJson(out / "cameras.json");
    ExpectFilesFit(out, list);
  }
  const io::NamedCamera& camera(size_t i) const { return list.cameras.at(i); }
};

TEST(ConvertFountain, MatchesLieOnTheirEpipolarLines) {
  const fs::path source = DataFolder() / "strecha_fountain_p11";
  DTR_REQUIRE_DATA(source);
  const Converted set("fountain", source);
  ASSERT_EQ(set.list.cameras.size(), 11u);
  EXPECT_EQ(set.list.unit, LengthUnit::kMetre);
  EXPECT_NEAR(set.camera(0).camera.cx_px(), 1520.69 / 2, 1e-9);
  ExpectEpipolarFit(set.out, set.list, 2, 3, 768, 0.4);
}

TEST(ConvertDtu, MatchesLieOnTheirEpipolarLinesAndTheUnitIsMetres) {
  const fs::path source = DataFolder() / "dtu_scan24";
  DTR_REQUIRE_DATA(source);
  const Converted set("dtu", source);
  ASSERT_EQ(set.list.cameras.size(), 18u);
  const double baseline_m = (set.camera(0).cam_from_world.TargetOriginInSource() -
                             set.camera(1).cam_from_world.TargetOriginInSource())
                                .norm();
  EXPECT_GT(baseline_m, 0.1);  // 126 to 129 mm, SOURCE.md
  EXPECT_LT(baseline_m, 0.5);
  ExpectEpipolarFit(set.out, set.list, 11, 12, 800, 1.0);
}

TEST(ConvertTemple, MatchesLieOnTheirEpipolarLines) {
  const fs::path source = DataFolder() / "middlebury_temple_sparse_ring";
  DTR_REQUIRE_DATA(source);
  const Converted set("temple", source);
  ASSERT_EQ(set.list.cameras.size(), 16u);
  EXPECT_NEAR(set.camera(0).camera.cx_px(), 302.32 + 0.5, 1e-9);
  ExpectEpipolarFit(set.out, set.list, 6, 7, 640, 0.6);
}

TEST(ConvertFern, MatchesLieOnTheirEpipolarLines) {
  const fs::path source = DataFolder() / "llff_fern";
  DTR_REQUIRE_DATA(source);
  const Converted set("fern", source);
  ASSERT_EQ(set.list.cameras.size(), 20u);
  EXPECT_NEAR(set.camera(0).camera.fx_px(), 3260.526 / 4, 1e-2);
  ExpectEpipolarFit(set.out, set.list, 0, 1, 1008, 0.6);
}

TEST(ConvertLivingRoom, DepthOfOneFrameMeetsTheNext) {
  const fs::path source = DataFolder() / "livingroom_clean_rgbd";
  DTR_REQUIRE_DATA(source);
  const Converted set("livingroom", source);
  ASSERT_EQ(set.list.cameras.size(), 16u);
  EXPECT_EQ(set.camera(0).camera.cx_px(), 320);
  constexpr double kGood_m = 0.005;  // poses are Open3D's estimate: 1 to 4 mm at this distance
  ExpectDepthFit(set.out, set.camera(2), set.camera(4), kGood_m);
}

TEST(Convert7Scenes, DepthOfOneFrameMeetsTheNext) {
  const fs::path source = DataFolder() / "7scenes_redkitchen";
  DTR_REQUIRE_DATA(source);
  const Converted set("7scenes", source);
  ASSERT_EQ(set.list.cameras.size(), 16u);
  constexpr double kGood_m = 0.01;  // Kinect and KinectFusion: 6 mm in this pair
  ExpectDepthFit(set.out, set.camera(0), set.camera(1), kGood_m);
}

TEST(ConvertLego, RayDistanceBecomesPlaneZ) {
  const fs::path source = DataFolder() / "nerf_lego_depth";
  DTR_REQUIRE_DATA(source);
  const Converted set("lego", source);
  ASSERT_EQ(set.list.cameras.size(), 12u);
  EXPECT_NEAR(set.camera(0).camera.fx_px(), 1111.11, 0.01);
  EXPECT_EQ(set.camera(0).camera.cx_px(), 400);
  constexpr double kGood = 0.0135;  // found: 0.0114; the 8-bit depth has steps of 0.031
  ExpectDepthFit(set.out, set.camera(0), set.camera(1), kGood);
  const io::NamedCamera& a = set.camera(0);
  const DepthImage depth_a = DepthOf(set.out, a);
  // Colour is on black where the mask is 0; every pixel of the mask has depth.
  const ImageRgb8 image = io::ReadImage(set.out / "images" / a.name);
  const Mask mask = io::ReadMask(set.out / "masks" / a.mask_file);
  int usable = 0, black = 0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      if (mask(x, y) == 255) {
        ++usable;
        EXPECT_FALSE(DepthImage::IsHole(depth_a(x, y)));
      } else if (image(x, y, 0) + image(x, y, 1) + image(x, y, 2) == 0) {
        ++black;
      }
    }
  }
  EXPECT_GT(usable, 50000);
  EXPECT_GT(black, 300000);
}

TEST(ConvertPlaza, AHalfPixelSlipWouldShow) {
  const fs::path source = DataFolder() / "plaza";
  DTR_REQUIRE_DATA(source);
  const Converted set("plaza", source);
  ASSERT_EQ(set.list.cameras.size(), 16u);
  const io::NamedCamera &a = set.camera(6), &b = set.camera(8);
  const DepthImage depth_a = DepthOf(set.out, a), depth_b = DepthOf(set.out, b);
  const DepthFit fit = CarryDepth(a, depth_a, b, depth_b);
  const DepthFit slipped =
      CarryDepth(WithShift(a, 0.5, 0.5), depth_a, WithShift(b, 0.5, 0.5), depth_b);
  const DepthFit as_ray = CarryDepth(a, AsRayDistance(depth_a), b, AsRayDistance(depth_b));
  constexpr double kExact = 1e-5;  // 15 bits of mantissa: 1.5e-5 at worst, 6.7e-6 in this pair
  EXPECT_GT(fit.samples, 5000);
  EXPECT_LT(fit.median_relative, kExact);
  EXPECT_GT(slipped.median_relative, 3 * kExact);
  EXPECT_GT(as_ray.median_relative, 100 * kExact);
  std::cout << fit.samples << " samples, relative " << fit.median_relative << "; half a pixel off "
            << slipped.median_relative << ", read as ray distance " << as_ray.median_relative
            << "\n";
}

TEST(ConvertLego, TheResultImportsAsASet) {
  const fs::path source = DataFolder() / "nerf_lego_depth";
  DTR_REQUIRE_DATA(source);
  Converted set("lego", source);
  set.list.cameras.erase(set.list.cameras.begin() + 3, set.list.cameras.end());
  pipeline::ImportOptions options;
  options.images_dir = set.out / "images";
  options.depth_dir = set.out / "depth";
  SilentProgress progress;
  pipeline::ImportSet(set.list, options, set.folder / "lego.dtr", false, nullptr, progress);
  const DtrSet loaded = io::LoadSet(set.folder / "lego.dtr");
  ASSERT_EQ(loaded.frames.at(0).views.size(), 3u);
  EXPECT_LT(loaded.scene_center.norm(), 1.0);  // the model stands on the origin, cameras at 4
  for (const View& view : loaded.frames[0].views) {
    EXPECT_FALSE(view.mask.empty());
    EXPECT_GT(view.near_z, 2);
    EXPECT_LT(view.far_z, 6);
  }
}

TEST(ConvertDataset, ImagesAreCopiedByteByByte) {
  const fs::path source = DataFolder() / "plaza";
  DTR_REQUIRE_DATA(source);
  const Converted set("plaza", source);
  constexpr std::uintmax_t kLimit = 10 << 20;
  EXPECT_EQ(ReadFile(set.out / "images/0003.jpg", kLimit),
            ReadFile(source / "images/0003.jpg", kLimit));
}

TEST(ConvertDataset, WrongRequestsAreRejectedAndLeaveNothing) {
  TemporaryFolder folder;
  fs::create_directory(folder / "empty");
  EXPECT_THROW(ConvertDataset("nothing", folder / "empty", folder / "out"), UsageError);
  EXPECT_THROW(ConvertDataset("lego", folder / "absent", folder / "out"), Error);
  EXPECT_THROW(ConvertDataset("lego", folder / "empty", folder / "empty"), UsageError);
  for (const std::string& kind : ConvertibleKinds()) {
    EXPECT_THROW(ConvertDataset(kind, folder / "empty", folder / "out"), Error) << kind;
    EXPECT_FALSE(fs::exists(folder / "out"));
    EXPECT_FALSE(fs::exists(folder / "out.partial"));
  }
}

}  // namespace
}  // namespace dtr::datasets
