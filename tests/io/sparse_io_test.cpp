#include "dtr/io/sparse_io.h"

#include <gtest/gtest.h>

#include <limits>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "tests/support/test_data.h"
#include "tests/support/truncation.h"

namespace dtr::io {
namespace {

using testing::TemporaryFolder;

SparseScene SmallScene() {
  SparseScene scene;
  scene.points = {{{1, 2, 3}}, {{-0.1, 1e300, 5e-324}}};
  scene.observations = {{0, 0, {1.5, 2.5}}, {0, 1, {0.25, -3}}, {2, 1, {7, 8}}};
  return scene;
}

TEST(SparseFile, RoundTripsExactlyAndIsTheSameBytesTwice) {
  const TemporaryFolder folder;
  const auto file = folder / "sparse.bin";
  WriteSparse(file, SmallScene());
  const std::string first = ReadFile(file, 1 << 20);
  EXPECT_EQ(first.size(), 32u + 2 * 24 + 3 * 24);
  const SparseScene back = ReadSparse(file);
  ASSERT_EQ(back.points.size(), 2u);
  EXPECT_EQ(back.points[1].p_in_world, SmallScene().points[1].p_in_world);
  ASSERT_EQ(back.observations.size(), 3u);
  EXPECT_EQ(back.observations[2].view, 2);
  EXPECT_EQ(back.observations[1].pixel, Eigen::Vector2d(0.25, -3));
  WriteSparse(file, back);
  EXPECT_EQ(ReadFile(file, 1 << 20), first);
}

TEST(SparseFile, EveryTruncatedPrefixIsAnError) {
  const TemporaryFolder folder;
  WriteSparse(folder / "sparse.bin", SmallScene());
  testing::ExpectEveryPrefixIsAnError(folder / "sparse.bin", 1,
                                      [&] { ReadSparse(folder / "sparse.bin"); });
}

TEST(SparseFile, RejectsHostileCountsVersionsAndTrailingBytes) {
  const TemporaryFolder folder;
  const auto file = folder / "sparse.bin";
  WriteSparse(file, SmallScene());
  const std::string good = ReadFile(file, 1 << 20);
  const auto expect_rejected = [&](const std::string& content) {
    WriteFileAtomically(file, content);
    EXPECT_THROW(ReadSparse(file), Error);
  };
  expect_rejected(good + '\0');
  for (const size_t at : {0u, 8u, 12u, 16u, 23u, 24u, 31u}) {  // magic, version, both counts
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 0x55);
    expect_rejected(bad);
  }
  std::string bad_point = good;  // of observation 0
  bad_point[32 + 2 * 24 + 4] = 9;
  expect_rejected(bad_point);
  std::string bad_view = good;  // 2^31 and more is no int
  bad_view[32 + 2 * 24 + 2 * 24 + 3] = '\xff';
  expect_rejected(bad_view);
}

TEST(SparseFile, WriterRejectsWhatTheReaderWould) {
  const TemporaryFolder folder;
  SparseScene scene = SmallScene();
  std::swap(scene.observations[0], scene.observations[2]);
  EXPECT_THROW(WriteSparse(folder / "s", scene), Error);
  scene = SmallScene();
  scene.points[0].p_in_world.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(WriteSparse(folder / "s", scene), Error);
  scene = SmallScene();
  scene.observations[2].point = 2;
  EXPECT_THROW(WriteSparse(folder / "s", scene), Error);
  EXPECT_FALSE(std::filesystem::exists(folder / "s"));
}

}  // namespace
}  // namespace dtr::io
