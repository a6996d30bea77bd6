// Photos of 100 megapixels within --memory.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "dtr/io/image_io.h"
#include "tests/cli/run_dtr.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;

// "at most 736 MiB" of the stage "photos".
double PeakMib(const std::string& progress) {
  const size_t stage = progress.find("photos: ");
  const size_t at = progress.find("at most ", stage);
  if (stage == std::string::npos || at == std::string::npos) return 0;
  return std::atof(progress.c_str() + at + 8);
}

TEST(LargePhotos, OfAHundredMegapixelsAreReadOneAtATimeWhereMemoryIsShort) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "photos");
  ImageRgb8 image(11600, 8700, 3, 90);
  for (const char* name : {"a.jpg", "b.jpg", "c.jpg"}) {
    image(0, 0) = static_cast<std::uint8_t>(name[0]);  // not the same photo three times
    io::WriteImage(folder / "photos" / name, image);
  }
  const auto peak = [&](const char* memory_gb) {
    const Ran ran =
        DtrByItself({"capture", (folder / "photos").string(), "-o", (folder / memory_gb).string(),
                     "--memory", memory_gb, "--threads", "3"});
    EXPECT_EQ(ran.code, 0) << ran.err;
    return PeakMib(ran.err);
  };
  const double bounded = peak("2"), all = peak("64");
  EXPECT_GT(bounded, 0);
  EXPECT_LT(bounded, 2e9 / (1 << 20));
  EXPECT_GT(all, 1.5 * bounded);  // three at a time; else the bound would prove nothing
}

}  // namespace
}  // namespace dtr::testing
