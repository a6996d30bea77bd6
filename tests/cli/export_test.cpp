// `dtr export` takes the colours of points from one image after another.
#include <gtest/gtest.h>

#include "calib/colmap/model_io.h"
#include "dtr/base/process.h"
#include "dtr/io/image_io.h"
#include "tests/cli/run_dtr.h"
#include "tests/cli/small_courtyard.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;

constexpr int kWidthPx = 2000, kHeightPx = 1500;  // 9 MB in memory

// The most memory that an export of so many photos took.
long ExportKib(const fs::path& folder, int photos) {
  const PinholeCamera camera(kWidthPx, kHeightPx, 1500, 1500, kWidthPx / 2, kHeightPx / 2);
  std::vector<CourtyardPhoto> taken;
  fs::create_directories(folder / "images");
  for (const Pose& pose : CourtyardArc(photos)) {
    taken.push_back({std::to_string(taken.size()) + ".png", camera, pose});
    io::WriteImage(folder / "images" / taken.back().name, ImageRgb8(kWidthPx, kHeightPx, 3, 100));
  }
  colmap::WriteModel(folder / "sparse", CourtyardModel(taken), colmap::Format::kBinary);
  const std::string set = (folder / "set.dtr").string();
  DtrOk({"import", "--format", "colmap", "--cameras", (folder / "sparse").string(), "--images",
         (folder / "images").string(), "-o", set});
  const ProcessResult ran = RunProcess(
      {DTR_PROGRAM, "export", set, "-o", (folder / "out").string(), "--threads", "1"}, {});
  EXPECT_TRUE(ran.Ok());
  EXPECT_EQ(FilesIn(folder / "out/images"), photos);
  const auto points = colmap::ReadModel(folder / "out/sparse").points;
  EXPECT_FALSE(points.empty());
  for (const auto& [id, point] : points) EXPECT_EQ(point.rgb[1], 100) << id;
  return ran.max_rss_kib;
}

TEST(ExportCommand, HoldsOneImageAtATime) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer keeps what was freed";
#endif
  const TemporaryFolder folder;
  const long few = ExportKib(folder / "few", 2), many = ExportKib(folder / "many", 14);
  constexpr long kImageKib = 9 * 1024;
  EXPECT_LT(many - few, 3 * kImageKib);  // 12 more would be 12 of them
}

}  // namespace
}  // namespace dtr::testing
