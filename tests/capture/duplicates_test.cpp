// Of photos that show one image the best one stays, and none repeats what is held out.
#include "capture/duplicates.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "capture/ingest.h"
#include "dtr/base/random.h"
#include "dtr/types/area_average.h"
#include "tests/support/test_data.h"

namespace dtr::capture {
namespace {

namespace fs = std::filesystem;
using dtr::testing::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Capture Ingest(const fs::path& folder) {
  SilentProgress progress;
  return IngestPhotos(folder, {}, progress);
}

std::vector<std::string> NamesOf(const Capture& capture) {
  std::vector<std::string> names;
  for (const Photo& photo : capture.photos) names.push_back(photo.name);
  return names;
}

// Names of what goes with --drop duplicate.
std::vector<std::string> Dropped(const fs::path& folder) {
  Capture capture = Ingest(folder);
  DropFaulty(capture, {Fault::kDuplicate});
  std::vector<std::string> names;
  for (const Skipped& skipped : capture.skipped) names.push_back(skipped.name);
  return names;
}

// Waves that a thumbnail shows, with squares of 4 px that it does not.
ImageRgb8 Mosaic(std::uint64_t seed) {
  ImageRgb8 image(400, 300, 3);
  const double a = static_cast<double>(seed), b = 1.7 * static_cast<double>(seed);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const double wave = std::cos(x / 21.0 + a) * std::cos(y / 17.0 + b);
      const auto square = static_cast<double>(HashOf(seed, x / 4, y / 4) % 20);
      for (int c = 0; c < 3; ++c) {
        image(x, y, c) = static_cast<std::uint8_t>(100 + 60 * wave + square);
      }
    }
  }
  return image;
}

ImageRgb8 Half(const ImageRgb8& image) {
  return AreaAverage(image, image.width() / 2, image.height() / 2);
}

TEST(ScreenPhotos, OfAPhotoAndItsCopyTheBetterOneStaysWhateverTheirNames) {
  const ImageRgb8 image = Mosaic(1);
  {
    const TemporaryFolder folder;  // a messenger's copy: the same size, compressed once more
    io::WriteImage(folder / "IMG_1-WA.jpg", image, 55);
    io::WriteImage(folder / "IMG_1.jpg", image, 90);
    io::WriteImage(folder / "IMG_2.jpg", image, 65);
    EXPECT_THAT(Dropped(folder.path()), ElementsAre("IMG_1-WA.jpg", "IMG_2.jpg"));
    const Capture capture = Ingest(folder.path());
    EXPECT_EQ(capture.photos[0].screening->duplicate_of, "IMG_1.jpg");
    EXPECT_THAT(capture.photos[0].screening->remarks[0], HasSubstr("same image as IMG_1.jpg"));
    EXPECT_THAT(capture.photos[1].screening->faults, IsEmpty());
  }
  {
    const TemporaryFolder folder;  // smaller, though of less compression
    io::WriteImage(folder / "a.jpg", Half(image), 98);
    io::WriteImage(folder / "b.jpg", image, 50);
    EXPECT_THAT(Dropped(folder.path()), ElementsAre("a.jpg"));
  }
  {
    const TemporaryFolder folder;  // larger files, without the camera's data
    io::WriteImage(folder / "a.jpg", image, 98);
    io::WriteJpegWithExif(folder / "b.jpg", image, 85, {4.2, 26.0, "Maker", "Phone"});
    EXPECT_THAT(Dropped(folder.path()), ElementsAre("a.jpg"));
  }
  {
    const TemporaryFolder folder;  // the same file, copied by a file manager
    io::WriteImage(folder / "IMG_1.jpg", image, 90);
    fs::copy_file(folder / "IMG_1.jpg", folder / "IMG_1 (1).jpg");
    EXPECT_THAT(Dropped(folder.path()), ElementsAre("IMG_1 (1).jpg"));
  }
}

TEST(ScreenPhotos, TheFieldCasesPhotoStaysAndItsCopyOfAChatGoes) {
  const fs::path folder = dtr::testing::DataFolder() / "field/neardup_drop/photos";
  DTR_REQUIRE_DATA(folder);
  EXPECT_THAT(Dropped(folder), ElementsAre("0003-chat.jpg"));
}

TEST(DropFaulty, WhereTheBestGoesForAnotherFaultTheNextBestStays) {
  const TemporaryFolder folder;
  io::WriteImage(folder / "a.jpg", Half(Mosaic(1)), 90);
  io::WriteImage(folder / "b.jpg", Mosaic(1), 60);
  io::WriteImage(folder / "c.jpg", Mosaic(1), 90);
  Capture capture = Ingest(folder.path());
  Screening& best = *capture.photos[2].screening;
  ASSERT_THAT(best.faults, IsEmpty());
  best.faults = {Fault::kOverexposed};
  best.remarks = {"is too bright"};
  DropFaulty(capture, {Fault::kDuplicate, Fault::kOverexposed});
  EXPECT_THAT(NamesOf(capture), ElementsAre("b.jpg"));
}

TEST(DropCopiesOf, TakesOutWhatShowsAHeldOutPhotoAgain) {
  const TemporaryFolder folder;
  io::WriteImage(folder / "a.jpg", Mosaic(1), 90);
  io::WriteImage(folder / "b-small.jpg", Half(Mosaic(2)), 90);
  io::WriteImage(folder / "b.jpg", Mosaic(2), 90);
  io::WriteImage(folder / "b_again.jpg", Mosaic(2), 60);
  io::WriteImage(folder / "c.jpg", Mosaic(1), 60);
  for (const size_t held : {1u, 2u, 3u}) {
    Capture capture = Ingest(folder.path());
    std::vector<bool> held_out(5);
    held_out[held] = true;
    const std::string name = capture.photos[held].name;
    EXPECT_EQ(DropCopiesOf(held_out, capture).size(), 2u);
    EXPECT_THAT(NamesOf(capture), ElementsAre("a.jpg", name, "c.jpg"));
    EXPECT_THAT(held_out, ElementsAre(false, true, false));
    EXPECT_THAT(capture.skipped.front().reason, HasSubstr("held-out photo, " + name));
  }
}

}  // namespace
}  // namespace dtr::capture
