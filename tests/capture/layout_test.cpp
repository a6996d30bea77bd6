#include "capture/layout.h"

#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "capture/folder_walk.h"
#include "capture/ingest.h"
#include "dtr/io/depth_io.h"
#include "dtr/types/area_average.h"
#include "tests/capture/photo_files.h"
#include "tests/support/photo_kinds.h"
#include "tests/support/test_data.h"

namespace dtr::capture {
namespace {

namespace fs = std::filesystem;
using dtr::testing::TemporaryFolder;
using testing::BlockPhoto;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pair;

class ProjectFolder : public ::testing::Test {
 protected:
  static constexpr int kWidth = 96, kHeight = 64;

  void Write(const std::string& name, const ImageRgb8& image) {
    fs::create_directories((folder_ / name).parent_path());
    io::WriteImage(folder_ / name, image);
  }
  void WritePhoto(const std::string& name, std::uint64_t seed, int width = kWidth) {
    const ImageRgb8 image = BlockPhoto(kWidth, kHeight, seed);
    Write(name, AreaAverage(image, width, kHeight * width / kWidth));
  }
  void WriteMask(const std::string& name, int width = kWidth, bool as_colour = false) {
    ImageRgb8 image(width, kHeight * width / kWidth, 3, 255);
    std::fill_n(image.data().begin(), image.data().size() / 4, std::uint8_t{0});
    if (as_colour) return Write(name, image);
    fs::create_directories((folder_ / name).parent_path());
    Mask mask(image.width(), image.height());
    for (size_t i = 0; i < mask.data().size(); ++i) mask.data()[i] = image.data()[3 * i];
    io::WriteMask(folder_ / name, mask);
  }
  void WriteDepth(const std::string& name, int width = kWidth) {
    fs::create_directories((folder_ / name).parent_path());
    const int height = kHeight * width / kWidth;
    std::vector<std::uint16_t> values;
    for (int i = 0; i < width * height; ++i) values.push_back(static_cast<std::uint16_t>(900 + i));
    dtr::testing::WriteForeign(folder_ / name, {width, height, 1, OIIO::TypeDesc::UINT16}, values);
  }
  Layout Sort() {
    FolderWalk walk = WalkFolder(folder_.path(), true);
    return SortImages(folder_.path(), walk.images, std::move(walk.contents));
  }
  static int IgnoredOf(const Layout& layout, const std::string& kind) {
    for (const Ignored& ignored : layout.contents.ignored) {
      if (ignored.kind == kind) return ignored.files;
    }
    return 0;
  }

  TemporaryFolder folder_;
};

TEST_F(ProjectFolder, ReducedCopiesMasksDepthAndThumbnailsAreNoPhotos) {
  for (int i = 0; i < 3; ++i) {
    const std::string name = "frame_0" + std::to_string(i);
    WritePhoto("images/" + name + ".jpg", i);
    WritePhoto("images_2/" + name + ".jpg", i, 48);
    WritePhoto("images_4/" + name + ".png", i, 24);
    WriteMask("masks/" + name + ".jpg.png");
    WriteMask("masks_2/" + name + ".png", 48);
    WriteDepth("depth/" + name + ".png", 48);
    WritePhoto("images/@eaDir/" + name + ".jpg/SYNOFILE_THUMB_M.jpg", i, 12);
  }
  WriteFileAtomically(folder_ / "images/._frame_00.jpg", "resource fork");
  WriteFileAtomically(folder_ / "transforms.json", "{}");
  const Layout layout = Sort();
  EXPECT_THAT(layout.photos,
              ElementsAre("images/frame_00.jpg", "images/frame_01.jpg", "images/frame_02.jpg"));
  EXPECT_EQ(layout.masks.at("images/frame_01.jpg"), "masks/frame_01.jpg.png");
  EXPECT_EQ(layout.contents.masks, 3);
  EXPECT_EQ(layout.contents.depth_maps, 3);
  EXPECT_EQ(IgnoredOf(layout, "reduced_copies"), 6);
  EXPECT_EQ(IgnoredOf(layout, "unused_masks"), 3);
  EXPECT_EQ(IgnoredOf(layout, "system_files"), 4);
  EXPECT_EQ(IgnoredOf(layout, "other_files"), 1);
  EXPECT_THAT(LineOf(layout.contents), HasSubstr("reduced copies (6: images_2/, images_4/)"));
}

TEST_F(ProjectFolder, WhatIsNamedByNothingIsKnownByItsPixels) {
  for (const char* name : {"a", "b"}) {
    const std::string stem = name;
    WritePhoto("shots/" + stem + ".png", stem[0]);
    WritePhoto("half/" + stem + ".png", stem[0], 48);
    WriteMask("sel/" + stem + ".png", kWidth, true);
    WriteDepth("z/" + stem + ".png");
  }
  const Layout layout = Sort();
  EXPECT_THAT(layout.photos, ElementsAre("shots/a.png", "shots/b.png"));
  EXPECT_THAT(layout.masks,
              ElementsAre(Pair("shots/a.png", "sel/a.png"), Pair("shots/b.png", "sel/b.png")));
  EXPECT_EQ(IgnoredOf(layout, "reduced_copies"), 2);
  EXPECT_EQ(layout.contents.depth_maps, 2);
}

TEST_F(ProjectFolder, CamerasWithEqualNamesStayPhotosWhateverTheirSizes) {
  for (int i = 0; i < 2; ++i) {
    const std::string name = "/000" + std::to_string(i) + ".jpg";
    WritePhoto("cam0" + name, 10 + i);
    WritePhoto("cam1" + name, 20 + i);
    WritePhoto("cam2" + name, 30 + i, 48);  // half the size, another view
    WriteMask("masks/cam1/000" + std::to_string(i) + ".png");
  }
  const Layout layout = Sort();
  EXPECT_EQ(layout.photos.size(), 6u);
  EXPECT_THAT(layout.masks, ElementsAre(Pair("cam1/0000.jpg", "masks/cam1/0000.png"),
                                        Pair("cam1/0001.jpg", "masks/cam1/0001.png")));
  EXPECT_THAT(layout.contents.ignored, IsEmpty());
}

// Grey as a dim camera gives it: a gradient over few levels, and noise.
ImageRgb8 DimGrey(int width, int height, std::uint64_t seed, double noise_levels) {
  Random random(seed);
  ImageRgb8 image(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double level = 4 + 24.0 * (x + y) / (width + height) + noise_levels * random.Normal();
      for (int c = 0; c < 3; ++c)
        image(x, y, c) = static_cast<std::uint8_t>(std::clamp(level, 0., 60.));
    }
  }
  return image;
}

TEST_F(ProjectFolder, DarkPhotosOfACameraAreNoMasksOfAnother) {
  for (const int dark : {1, 2, 3}) {  // the first ones: a lamp that is still off
    for (int i = 0; i < 3; ++i) {
      const std::string name = "/000" + std::to_string(i) + ".png";
      WritePhoto("left" + name, 10 + i);
      if (i < dark) {
        Write("right" + name, ImageRgb8(kWidth, kHeight, 3, static_cast<std::uint8_t>(i)));
      } else {
        WritePhoto("right" + name, 20 + i);
      }
    }
    const Layout layout = Sort();
    EXPECT_EQ(layout.photos.size(), 6u) << dark;
    EXPECT_THAT(layout.masks, IsEmpty()) << dark;
  }
  for (int i = 0; i < 3; ++i) {  // and one that looks into the sun
    Write("right/000" + std::to_string(i) + ".png", ImageRgb8(kWidth, kHeight, 3, 255));
  }
  EXPECT_EQ(Sort().photos.size(), 6u);
}

TEST_F(ProjectFolder, MasksThatUseNothingOfAPhotoAreMasksAmongOthersOrByTheirName) {
  for (int i = 0; i < 3; ++i) {
    const std::string name = "/" + std::to_string(i) + ".png";
    WritePhoto("shots" + name, i);
    if (i == 0) {
      Write("sel" + name, ImageRgb8(kWidth, kHeight, 3));
    } else {
      WriteMask("sel" + name);
    }
  }
  EXPECT_EQ(Sort().masks.size(), 3u);
  fs::remove_all(folder_ / "sel");
  for (int i = 0; i < 3; ++i) {
    Write("sky_masks/" + std::to_string(i) + ".png", ImageRgb8(kWidth, kHeight, 3));
  }
  EXPECT_EQ(Sort().masks.size(), 3u);
}

TEST_F(ProjectFolder, DimGreyPhotosAreNoLabelMaps) {
  for (const double noise : {2.0, 0.05}) {
    for (int i = 0; i < 3; ++i) {
      const std::string name = "/" + std::to_string(i) + ".png";
      WritePhoto("left" + name, i);
      Write("right" + name, DimGrey(8 * kWidth, 8 * kHeight, i, noise));
    }
    EXPECT_EQ(Sort().photos.size(), 6u) << noise;
  }
}

TEST_F(ProjectFolder, LabelMapsAreKnownByTheirFlatAreas) {
  for (int i = 0; i < 3; ++i) {
    const std::string name = "/" + std::to_string(i) + ".png";
    WritePhoto("shots" + name, i);
    ImageRgb8 labels(kWidth, kHeight, 3);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const int label = x < 40 ? 0 : y < 30 ? 7 : x < 70 ? 23 : 11;
        for (int c = 0; c < 3; ++c) labels(x, y, c) = static_cast<std::uint8_t>(label);
      }
    }
    Write("classes" + name, labels);
  }
  EXPECT_EQ(Sort().photos.size(), 3u);
  EXPECT_EQ(IgnoredOf(Sort(), "label_maps"), 3);
}

TEST_F(ProjectFolder, AFoldersWordNeedsPixelsThatAgree) {
  for (int i = 0; i < 3; ++i) {
    const std::string name = "/" + std::to_string(i) + ".jpg";
    WritePhoto("images" + name, i);
    for (const char* camera : {"normal", "labels", "confidence"}) {
      Random random(i);
      ImageRgb8 photo = BlockPhoto(kWidth, kHeight, 100 + 10 * i + camera[0]);
      for (auto& value : photo.data()) value = static_cast<std::uint8_t>(value + random.Index(9));
      Write(camera + name, photo);
    }
    WritePhoto("preview" + name, 100 + 10 * i, 48);
  }
  EXPECT_EQ(Sort().photos.size(), 15u);
  EXPECT_THAT(Sort().contents.ignored, IsEmpty());
}

TEST_F(ProjectFolder, MapsInFoldersCalledSoAreNoPhotos) {
  for (int i = 0; i < 3; ++i) {
    const std::string name = "/" + std::to_string(i) + ".jpg";
    WritePhoto("images" + name, i);
    WritePhoto("preview" + name, i, 48);
    ImageRgb8 normals(kWidth, kHeight, 3), labels(kWidth, kHeight, 3), sure(kWidth, kHeight, 3);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const double angle = 0.01 * (x - 48);  // a cylinder that stands upright
        const double normal[] = {std::sin(angle), 0, std::cos(angle)};
        for (int c = 0; c < 3; ++c) {
          normals(x, y, c) = static_cast<std::uint8_t>(127.5 + 127.5 * normal[c]);
          labels(x, y, c) = static_cast<std::uint8_t>((x / 32 * 90 + c * 60) % 250);
          sure(x, y, c) = static_cast<std::uint8_t>(2 * x + y / 4);
        }
      }
    }
    Write("normals" + name, normals);
    Write("labels" + name, labels);
    Write("conf" + name, sure);
  }
  const Layout layout = Sort();
  EXPECT_EQ(layout.photos.size(), 3u);
  for (const char* kind : {"normal_maps", "label_maps", "confidence_maps", "previews"}) {
    EXPECT_EQ(IgnoredOf(layout, kind), 3) << kind;
  }
}

TEST_F(ProjectFolder, TimeStepsOfAStillSceneStayPhotos) {
  for (const char* step : {"t0", "t1"}) {
    for (int camera = 0; camera < 2; ++camera) {
      WritePhoto(std::string(step) + "/cam" + std::to_string(camera) + ".png", camera);
    }
  }
  EXPECT_EQ(Sort().photos.size(), 4u);
}

TEST_F(ProjectFolder, UndistortedCopiesOfColmapGiveWayToTheOriginals) {
  for (const char* name : {"1.jpg", "2.jpg"}) {
    WritePhoto(std::string("images/") + name, name[0]);
    WritePhoto(std::string("dense/0/images/") + name, name[0]);
  }
  fs::create_directories(folder_ / "dense/0/stereo");
  fs::create_directories(folder_ / "dense/0/sparse");
  const Layout layout = Sort();
  EXPECT_THAT(layout.photos, ElementsAre("images/1.jpg", "images/2.jpg"));
  EXPECT_EQ(IgnoredOf(layout, "undistorted_copies"), 2);
  fs::remove_all(folder_ / "images");
  EXPECT_EQ(Sort().photos.size(), 2u) << "alone they are the photos";
}

TEST_F(ProjectFolder, KindsInFileNamesOfRgbdRecordersAreKnown) {
  WritePhoto("frame-000000.color.png", 1);
  WriteDepth("frame-000000.depth.png");
  WritePhoto("seq/frame000001.jpg", 2);
  WriteDepth("seq/depth000001.png");
  WritePhoto("test/r_0.png", 3);
  WriteMask("test/r_0_depth_0001.png");
  const Layout layout = Sort();
  EXPECT_THAT(layout.photos,
              ElementsAre("frame-000000.color.png", "seq/frame000001.jpg", "test/r_0.png"));
  EXPECT_EQ(layout.contents.depth_maps, 3);
}

TEST_F(ProjectFolder, PhotosInFoldersCalledMasksOrDepthStayPhotosWhereNothingElseIs) {
  WritePhoto("masks/venice 1.jpg", 1);
  WritePhoto("masks/venice 2.jpg", 2);
  EXPECT_EQ(Sort().photos.size(), 2u);
  // Called masks, beside a photo of that name, and yet full of colour.
  WritePhoto("hall/venice 1.jpg", 3);
  EXPECT_EQ(Sort().photos.size(), 3u);
}

TEST_F(ProjectFolder, ResultsOfProgramsAreNoPhotos) {
  WritePhoto("images/1.jpg", 1);
  WritePhoto("odm_texturing/material_map_Kd.png", 2);
  WritePhoto("opensfm/undistorted/images/1.jpg.png", 1);
  WritePhoto("MeshroomCache/PrepareDenseScene/ab/17.png", 3);
  const Layout layout = Sort();
  EXPECT_THAT(layout.photos, ElementsAre("images/1.jpg"));
  EXPECT_EQ(IgnoredOf(layout, "program_results"), 3);
}

TEST_F(ProjectFolder, BrightMasksOfInstantNgpAreReportedAndNotUsed) {
  WritePhoto("1.png", 1);
  WriteMask("dynamic_mask_1.png");
  const Layout layout = Sort();
  EXPECT_THAT(layout.photos, ElementsAre("1.png"));
  EXPECT_THAT(layout.masks, IsEmpty());
  EXPECT_EQ(IgnoredOf(layout, "inverse_masks"), 1);
}

TEST_F(ProjectFolder, RawFilesBesidePhotosVideosAndImagesWithoutExtensionAreCounted) {
  WritePhoto("IMG_1.JPG", 1);
  WriteFileAtomically(folder_ / "IMG_1.CR2", "raw");
  WriteFileAtomically(folder_ / "IMG_1.MOV", "film");
  WriteFileAtomically(folder_ / "walk.mp4", "film");
  WriteFileAtomically(folder_ / "IMG_1.xmp", "sidecar");
  WriteFileAtomically(folder_ / "new.jxl", "image");
  fs::copy(folder_ / "IMG_1.JPG", folder_ / "IMG_2.insp");
  const Layout layout = Sort();
  EXPECT_THAT(layout.photos, ElementsAre("IMG_1.JPG"));
  EXPECT_EQ(layout.contents.videos, 2);
  for (const char* kind : {"raw_files", "live_photo_videos", "videos", "other_files",
                           "unread_images", "unnamed_images"}) {
    EXPECT_EQ(IgnoredOf(layout, kind), 1) << kind;
  }
}

TEST_F(ProjectFolder, VideosOfLowResolutionAreNotAdvisedBesideThoseOfFull) {
  WritePhoto("1.jpg", 1);
  WriteFileAtomically(folder_ / "GL010001.LRV", "film");
  EXPECT_EQ(IgnoredOf(Sort(), "videos"), 1);
  WriteFileAtomically(folder_ / "GX010001.MP4", "film");
  EXPECT_EQ(IgnoredOf(Sort(), "videos"), 1);
  EXPECT_EQ(IgnoredOf(Sort(), "proxy_videos"), 1);
  for (const char* extension : {".MTS", ".m2ts", ".insv", ".LRV", ".mj2"}) {
    EXPECT_TRUE(IsVideoExtension(extension)) << extension;
  }
}

TEST_F(ProjectFolder, WhatThisProgramMadeIsNoPhotoWhereverItLies) {
  for (int i = 0; i < 3; ++i) WritePhoto("0" + std::to_string(i) + ".png", 10 + i);
  const auto rendered = [&](const std::string& name) {
    fs::create_directories((folder_ / name).parent_path());
    io::WriteImage(folder_ / name, BlockPhoto(kWidth, kHeight, 99), 90, io::Mark::kRendered);
  };
  rendered("view.png");
  rendered("out/plaza-0003.jpg");
  rendered("out/comparison/0003.png");
  io::WriteExr(folder_ / "view-depth.exr", Grid<float>(kWidth, kHeight), false,
               io::Mark::kRendered);
  io::WriteMask(folder_ / "view-seen.png", Mask(kWidth, kHeight, 1, 255), io::Mark::kRendered);
  for (const char* mark : {"export/dtr-export.json", "set/set.json", "cap/capture.json"}) {
    fs::create_directories((folder_ / mark).parent_path());
    WriteFileAtomically(folder_ / mark, "{}");
  }
  WritePhoto("export/images/00.png", 20);
  WritePhoto("set/views/00.png", 21);
  WritePhoto("cap/images/00.png", 22);
  WritePhoto("a.dtr.partial/work/frames/00.png", 23);
  const Layout layout = Sort();
  EXPECT_THAT(layout.photos, ElementsAre("00.png", "01.png", "02.png"));
  EXPECT_THAT(layout.skipped, IsEmpty());
  EXPECT_EQ(IgnoredOf(layout, "rendered_images"), 5);
  EXPECT_EQ(IgnoredOf(layout, "own_folders"), 7);
  EXPECT_THAT(LineOf(layout.contents), HasSubstr("images that dtr rendered (5: out/"));
  EXPECT_THAT(LineOf(layout.contents),
              HasSubstr("folders that dtr made (7: a.dtr.partial/, cap/, export/, set/)"));
}

TEST_F(ProjectFolder, RenderedImagesByThemselvesAreWhatIsAskedFor) {
  for (const char* name : {"0.png", "1.jpg"}) {
    io::WriteImage(folder_ / name, BlockPhoto(kWidth, kHeight, 3), 90, io::Mark::kRendered);
  }
  EXPECT_THAT(Sort().photos, ElementsAre("0.png", "1.jpg"));
}

TEST(IngestPhotos, ExtensionsOfHeifAndJpegAreKnownInAnyCase) {
  for (const char* extension :
       {".HIF", ".hif", ".heics", ".AVIF", ".jfif", ".JPE", ".jp2", ".tif"}) {
    EXPECT_TRUE(IsImageExtension(extension)) << extension;
  }
  EXPECT_TRUE(IsRawExtension(".CR2"));
  EXPECT_FALSE(IsRawExtension(".jpg"));
}

TEST(FieldFolders, ACopyOfAProjectGivesItsFourPhotosWithTheirMasks) {
  const fs::path folder = dtr::testing::DataFolder() / "field/project_folder/scene";
  DTR_REQUIRE_DATA(folder);
  SilentProgress progress;
  const Capture capture = IngestPhotos(folder, {}, progress);
  ASSERT_EQ(capture.photos.size(), 4u);
  for (const Photo& photo : capture.photos) {
    EXPECT_THAT(photo.name, HasSubstr("images/frame_0000"));
    EXPECT_TRUE(photo.HasMask());
  }
  EXPECT_EQ(capture.contents.masks, 4);
  EXPECT_EQ(capture.contents.depth_maps, 4);
}

TEST(FieldFolders, AHifIsAPhotoAndVideosAreNamed) {
  const fs::path folder = dtr::testing::DataFolder() / "field/extensions";
  DTR_REQUIRE_DATA(folder);
  SilentProgress progress;
  const Capture capture = IngestPhotos(folder, {}, progress);
  EXPECT_EQ(capture.photos.size(), 3u);
  EXPECT_EQ(capture.contents.videos, 1);
  EXPECT_THAT(LineOf(capture.contents), HasSubstr("videos of live photos (1: .mov"));
}

}  // namespace
}  // namespace dtr::capture
