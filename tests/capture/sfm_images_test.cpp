#include "capture/sfm_images.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <iterator>

#include "capture/ingest.h"
#include "dtr/base/error.h"
#include "dtr/types/area_average.h"
#include "tests/capture/photo_files.h"
#include "tests/support/colour_files.h"
#include "tests/support/photo_kinds.h"
#include "tests/support/test_data.h"

namespace dtr::capture {
namespace {

namespace fs = std::filesystem;
using dtr::testing::TemporaryFolder;
using testing::AddExifOrientation;
using testing::BlockPhoto;
using testing::NoisePhoto;

constexpr size_t kFileLimit = 1 << 20;

Capture Ingest(const fs::path& folder) {
  SilentProgress progress;
  return IngestPhotos(folder, {}, progress);
}

TEST(PrepareSfmImages, UprightPhotosKeepNamesAndBytes) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "photos/left cam");
  io::WriteImage(folder / "photos/a b.JPG", BlockPhoto(48, 32, 1));
  io::WriteImage(folder / "photos/left cam/1.png", NoisePhoto(48, 32, 2));
  PrepareSfmImages(Ingest(folder / "photos"), folder / "sfm", 48);
  for (const char* name : {"a b.JPG", "left cam/1.png"}) {
    EXPECT_EQ(ReadFile(folder / "sfm" / name, kFileLimit),
              ReadFile(folder / "photos" / name, kFileLimit));
  }
}

TEST(PrepareSfmImages, PhotosThatAreNotSrgbAreWrittenAsSrgb) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "photos");
  io::WriteImage(folder / "photos/1.png", BlockPhoto(48, 32, 1));
  io::WriteImage(folder / "photos/2.png", BlockPhoto(48, 32, 2));
  dtr::testing::InsertPngChunk(folder / "photos/1.png", "gAMA", dtr::testing::BigEndian(100000));
  PrepareSfmImages(Ingest(folder / "photos"), folder / "sfm", 48);
  EXPECT_NE(io::ReadImage(folder / "photos/1.png"), BlockPhoto(48, 32, 1));
  EXPECT_EQ(io::ReadImage(folder / "sfm/1.png"), io::ReadImage(folder / "photos/1.png"));
}

TEST(PrepareSfmImages, TurnedAndLargePhotosAreWrittenUprightAndSmall) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "photos");
  io::WriteJpegWithExif(folder / "photos/1.jpg", BlockPhoto(96, 64, 1), 95,
                        {35.0, 50.0, "Canon", "EOS"});
  io::WriteImage(folder / "photos/2.jpg", BlockPhoto(96, 64, 2));
  AddExifOrientation(folder / "photos/2.jpg", 6);
  io::WriteImage(folder / "photos/3.png", NoisePhoto(96, 64, 3));
  const Capture capture = Ingest(folder / "photos");
  PrepareSfmImages(capture, folder / "sfm", 48);
  const auto header = io::ReadImageHeader(folder / "sfm/1.jpg");
  EXPECT_EQ(header.width_px, 48);
  EXPECT_EQ(header.height_px, 32);
  EXPECT_EQ(header.focal_35mm, 50.0);  // what COLMAP reads its first guess from
  EXPECT_EQ(header.make, "Canon");
  const auto turned = io::ReadImageHeader(folder / "sfm/2.jpg");
  EXPECT_EQ(turned.width_px, 32);
  EXPECT_EQ(turned.height_px, 48);
  EXPECT_EQ(turned.exif_orientation, 1);
  EXPECT_EQ(io::ReadImage(folder / "sfm/3.png"), AreaAverage(ReadPhoto(capture.photos[2]), 48, 32));
}

TEST(PrepareSfmImages, OtherFormatsBecomePngUnderTheirOwnNames) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "photos");
  // A PNG by content: stands for every format that COLMAP may not read.
  io::WriteImageWithAlpha(folder / "photos/x.png", NoisePhoto(20, 10, 1), Mask(20, 10, 1, 128));
  fs::rename(folder / "photos/x.png", folder / "photos/x.tif");
  const Capture capture = Ingest(folder / "photos");
  PrepareSfmImages(capture, folder / "sfm", 0);
  const auto header = io::ReadImageHeader(folder / "sfm/x.tif");
  EXPECT_EQ(header.format, "png");
  EXPECT_EQ(header.channels, 3);
  int files = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator(folder / "sfm")) ++files;
  EXPECT_EQ(files, 1);
}

/// A photo as other programs write it, and what COLMAP is given for it.
struct Foreign {
  const char* name;
  void (*write)(const fs::path&, const ImageRgb8&);
  const char* format;  ///< of what SfM reads
  int apart;           ///< levels of 255 that JPEG may cost, on blocks
};

TEST(PrepareSfmImages, WhatColmapDoesNotReadIsEightBitColourOfTheSameLook) {
  const Foreign kinds[] = {{"inks.jpg", dtr::testing::WriteCmyk, "jpeg", 6},
                           {"deep.png", dtr::testing::WriteSixteenBits, "png", 0},
                           {"deep.tif", dtr::testing::WriteSixteenBits, "png", 0},
                           {"linear.exr", dtr::testing::WriteLinear, "png", 0},
                           {"veiled.png", dtr::testing::WriteAlpha, "png", 0}};
  const TemporaryFolder folder;
  fs::create_directories(folder / "photos");
  const ImageRgb8 truth = BlockPhoto(48, 32, 5);
  for (const Foreign& kind : kinds) kind.write(folder / "photos" / kind.name, truth);
  const Capture capture = Ingest(folder / "photos");
  ASSERT_EQ(capture.photos.size(), std::size(kinds));
  PrepareSfmImages(capture, folder / "sfm", 0);
  for (const Foreign& kind : kinds) {
    const fs::path file = folder / "sfm" / kind.name;
    const io::ImageHeader header = io::ReadImageHeader(file);
    EXPECT_EQ(header.format, kind.format) << kind.name;
    EXPECT_EQ(header.channels, 3) << kind.name;
    EXPECT_EQ(header.bits, 8) << kind.name;
    const ImageRgb8 found = io::ReadImage(file);
    ASSERT_EQ(found.data().size(), truth.data().size()) << kind.name;
    int apart = 0;
    for (size_t i = 0; i < truth.data().size(); ++i) {
      apart = std::max(apart, std::abs(found.data()[i] - truth.data()[i]));
    }
    EXPECT_LE(apart, kind.apart) << kind.name;
  }
}

TEST(PrepareSfmImages, ASecondRunNeverWritesIntoTheOriginals) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "photos");
  io::WriteImage(folder / "photos/1.jpg", BlockPhoto(96, 64, 1));
  const std::string original = ReadFile(folder / "photos/1.jpg", kFileLimit);
  const Capture capture = Ingest(folder / "photos");
  PrepareSfmImages(capture, folder / "sfm", 0);   // links
  PrepareSfmImages(capture, folder / "sfm", 48);  // rewrites
  EXPECT_EQ(io::ReadImageHeader(folder / "sfm/1.jpg").width_px, 48);
  EXPECT_EQ(ReadFile(folder / "photos/1.jpg", kFileLimit), original);
  PrepareSfmImages(capture, folder / "sfm", 0);
  EXPECT_EQ(ReadFile(folder / "sfm/1.jpg", kFileLimit), original);
}

TEST(PrepareSfmImages, APhotoThatVanishedIsAnError) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "photos");
  io::WriteImage(folder / "photos/1.jpg", BlockPhoto(96, 64, 1));
  const Capture capture = Ingest(folder / "photos");
  fs::remove(folder / "photos/1.jpg");
  EXPECT_THROW(PrepareSfmImages(capture, folder / "sfm", 0), Error);
}

}  // namespace
}  // namespace dtr::capture
