#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/ingest.h"
#include "capture/sfm_images.h"
#include "capture/store.h"
#include "tests/capture/photo_files.h"
#include "tests/support/test_data.h"

namespace dtr::capture {
namespace {

namespace fs = std::filesystem;
using dtr::testing::TemporaryFolder;
using testing::BlockPhoto;
using ::testing::HasSubstr;

Capture Ingest(const fs::path& folder) {
  SilentProgress progress;
  return IngestPhotos(folder, {}, progress);
}

// Blocks in the middle; white under transparent pixels about them.
void WriteCutOut(const fs::path& file, Mask& alpha) {
  constexpr int kWidth = 48, kHeight = 32;
  ImageRgb8 image = BlockPhoto(kWidth, kHeight, 4);
  alpha = Mask(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const bool inside = x >= 16 && x < 32 && y >= 8 && y < 24;
      alpha(x, y) = inside ? 255 : 0;
      if (!inside) std::fill_n(&image(x, y), 3, std::uint8_t{255});
    }
  }
  io::WriteImageWithAlpha(file, image, alpha);
}

TEST(PhotosWithAlpha, TransparentPixelsAreMaskedAndCountInNoMeasure) {
  const TemporaryFolder folder;
  Mask alpha;
  WriteCutOut(folder / "a.png", alpha);
  io::WriteImageWithAlpha(folder / "b.png", BlockPhoto(48, 32, 5), Mask(48, 32, 1, 255));
  const Capture capture = Ingest(folder.path());
  ASSERT_EQ(capture.photos.size(), 2u);
  const Photo& cut_out = capture.photos[0];
  EXPECT_TRUE(cut_out.HasMask());
  EXPECT_EQ(ReadPhotoMask(cut_out), alpha);
  EXPECT_EQ(cut_out.screening->overexposed_share, 0) << "two thirds of it are hidden white";
  EXPECT_FALSE(capture.photos[1].HasMask()) << "opaque alpha is no mask";
  EXPECT_THAT(AlphaLine(capture.photos), HasSubstr("transparent pixels of 1 photos are masked"));
}

TEST(PhotosWithAlpha, MaskFileAndAlphaMustBothAllowAPixel) {
  const TemporaryFolder folder;
  Mask alpha, file(48, 32);
  WriteCutOut(folder / "a.png", alpha);
  for (int y = 0; y < 32; ++y) std::fill_n(file.row(y), 24, std::uint8_t{255});
  io::WriteMask(folder / "a_mask.png", file);
  const Mask both = ReadPhotoMask(Ingest(folder.path()).photos.at(0));
  for (size_t i = 0; i < both.data().size(); ++i) {
    ASSERT_EQ(both.data()[i], alpha.data()[i] & file.data()[i]);
  }
  for (size_t i = 0; i < file.data().size(); ++i) file.data()[i] = alpha.data()[i] == 0 ? 255 : 0;
  io::WriteMask(folder / "a_mask.png", file);
  io::WriteImage(folder / "b.png", BlockPhoto(48, 32, 6));
  const Capture capture = Ingest(folder.path());
  ASSERT_EQ(capture.skipped.size(), 1u);
  EXPECT_THAT(capture.skipped[0].reason, HasSubstr("have no usable pixel in common"));
}

TEST(PhotosWithAlpha, APhotoThatIsTransparentThroughoutIsSkippedWithTheReason) {
  const TemporaryFolder folder;
  io::WriteImageWithAlpha(folder / "a.png", BlockPhoto(48, 32, 5), Mask(48, 32));
  io::WriteImage(folder / "b.png", BlockPhoto(48, 32, 6));
  const Capture capture = Ingest(folder.path());
  ASSERT_EQ(capture.skipped.size(), 1u);
  EXPECT_THAT(capture.skipped[0].reason, HasSubstr("remove the alpha channel"));
}

TEST(PhotosWithAlpha, SfmAndAStoredCaptureHaveTheMaskAndNoHiddenColour) {
  const TemporaryFolder folder;
  fs::create_directories(folder / "photos");
  Mask alpha;
  WriteCutOut(folder / "photos/a.png", alpha);
  const Capture capture = Ingest(folder / "photos");
  WriteCapture(capture, folder / "cap");
  EXPECT_EQ(io::ReadMask(folder / "cap/masks/a.png"), alpha);
  for (const Capture& read : {capture, ReadCapture(folder / "cap")}) {
    EXPECT_EQ(ReadPhotoMask(read.photos[0]), alpha);
    PrepareSfmImages(read, folder / "sfm", 24);
    const ImageRgb8 image = io::ReadImage(folder / "sfm/a.png");
    for (const std::uint8_t value : image.data()) ASSERT_LT(value, 240);  // blocks end at 227
    const Mask mask = io::ReadMask(SfmMaskFile(folder / "sfm", read.photos[0]));
    EXPECT_EQ(mask(12, 8), 255);
    EXPECT_EQ(mask(2, 2), 0);
  }
}

}  // namespace
}  // namespace dtr::capture
