// Raw photos of a folder are developed alike.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/ingest.h"
#include "capture/store.h"
#include "tests/support/dng_file.h"
#include "tests/support/noted_lines.h"
#include "tests/support/test_data.h"

namespace dtr::capture {
namespace {

using dtr::testing::DngSpec;
using dtr::testing::TemporaryFolder;
using dtr::testing::WriteDng;
using ::testing::HasSubstr;

TEST(RawPhotos, OfOneCameraGetOneWhiteBalance) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "in");
  DngSpec spec;
  spec.value = [](int x, int y) { return 6000 + 40 * x + 30 * y; };
  for (const auto& [name, neutral] : {std::pair{"a.dng", std::array{0.5, 1.0, 0.7}},
                                      std::pair{"b.dng", std::array{0.6, 1.0, 0.6}},
                                      std::pair{"c.dng", std::array{0.7, 1.0, 0.5}}}) {
    spec.neutral = neutral;
    WriteDng(folder / "in" / name, spec);
  }
  dtr::testing::NotedLines lines;
  const Capture capture = IngestPhotos(folder / "in", {}, lines);
  ASSERT_EQ(capture.photos.size(), 3u);
  EXPECT_THAT(lines.lines,
              ::testing::Contains(
                  HasSubstr("3 raw photos of Maker Model: developed without automatic "
                            "brightness, with one white balance (red 1.67, blue 1.67 of green")));
  const ImageRgb8 first = ReadPhoto(capture.photos[0]);
  for (const Photo& photo : capture.photos) {
    EXPECT_EQ(photo.raw_balance, capture.photos[0].raw_balance);
    EXPECT_EQ(ReadPhoto(photo), first) << photo.name;  // the sensor saw the same
  }
  ASSERT_TRUE(capture.photos[0].focal_prior_px);
  EXPECT_EQ(capture.photos[0].focal_source, "exif-35mm");

  WriteCapture(capture, folder / "capture");
  const Capture stored = ReadCapture(folder / "capture");
  ASSERT_EQ(stored.photos.size(), 3u);
  EXPECT_EQ(ReadPhoto(stored.photos[2]), first);
}

}  // namespace
}  // namespace dtr::capture
