// A turntable before a background that stands still: the reason that is reported, and whether its
// advice leads to cameras.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <vector>

#include "calib/colmap/model_io.h"
#include "dtr/base/process.h"
#include "dtr/io/image_io.h"
#include "tests/cli/run_dtr.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;

constexpr int kVaries = 60;  // levels that a pixel of the turning box differs by; JPEG: up to 30
constexpr int kGrownPx = 4;  // features reach beyond their pixel

// White where any photo differs from the others: the box in all its positions.
ImageRgb8 MaskOfWhatTurns(const std::vector<fs::path>& photos) {
  std::vector<ImageRgb8> images;
  for (const fs::path& photo : photos) images.push_back(io::ReadImage(photo));
  const int width = images[0].width(), height = images[0].height();
  ImageRgb8 mask(width, height, 3);
  const auto varies = [&](int x, int y) {
    for (int c = 0; c < 3; ++c) {
      int least = 255, most = 0;
      for (const ImageRgb8& image : images) {
        least = std::min<int>(least, image(x, y, c));
        most = std::max<int>(most, image(x, y, c));
      }
      if (most - least > kVaries) return true;
    }
    return false;
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (!varies(x, y)) continue;
      for (int v = std::max(0, y - kGrownPx); v < std::min(height, y + kGrownPx + 1); ++v) {
        for (int u = std::max(0, x - kGrownPx); u < std::min(width, x + kGrownPx + 1); ++u) {
          for (int c = 0; c < 3; ++c) mask(u, v, c) = 255;
        }
      }
    }
  }
  return mask;
}

TEST(TurntableThroughColmap, TheReasonIsReportedAndItsAdviceLeadsToCameras) {
  const fs::path given = DataFolder() / "field" / "turntable" / "photos";
  DTR_REQUIRE_DATA(given);
  if (FindProgram("colmap").empty()) GTEST_SKIP() << "SKIPPED: colmap is absent";
  const TemporaryFolder folder;
  fs::copy(given, folder / "photos");
  const auto calibrate = [&](const char* output) {
    return Dtr({"calibrate", "photos", folder / "photos", "-o", folder / output, "--feature-size",
                "400", "--features", "1500"});
  };
  const std::string reason =
      "matched pairs of photos show most of their common features at the same position in both: ";
  const Ran with_background = calibrate("none");
  // Now and then COLMAP, which does not repeat itself, makes a model of what stands still: then the
  // reason is a warning.
  if (with_background.code == 0) {
    EXPECT_THAT(with_background.err, ::testing::HasSubstr(reason));
  } else {
    ExpectRejected(with_background, kFailed, reason);
    EXPECT_FALSE(fs::exists(folder / "none" / "cameras.bin"));
  }

  std::vector<fs::path> photos;
  for (const auto& entry : fs::directory_iterator(folder / "photos")) {
    photos.push_back(entry.path());
  }
  const ImageRgb8 mask = MaskOfWhatTurns(photos);
  for (const fs::path& photo : photos) {
    io::WriteImage(folder / "photos" / (photo.stem().string() + "_mask.png"), mask);
  }
  const Ran masked = calibrate("model");
  ASSERT_EQ(masked.code, 0) << masked.err;
  EXPECT_EQ(colmap::ReadModel(folder / "model").images.size(), photos.size());
}

}  // namespace
}  // namespace dtr::testing
