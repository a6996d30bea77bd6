#include "dtr/io/formats/foreign_depth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <limits>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/formats/pfm.h"
#include "tests/support/test_data.h"

namespace dtr::io {
namespace {

using ::testing::HasSubstr;

constexpr float kInf = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

Grid<float> Numbers() {
  Grid<float> grid(4, 2);
  grid.data() = {1, 2.5f, 0, -1, kNan, kInf, 1000, 3};
  return grid;
}

std::string ErrorOf(const std::filesystem::path& file, double unit = 1, int width = 4,
                    int height = 2) {
  try {
    ReadForeignDepth(file, DepthKind::kPlaneZ, unit, width, height);
  } catch (const Error& e) {
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
    return e.what();
  }
  return "no error";
}

TEST(ForeignDepth, EveryFormatGivesTheSameDepthsAndHoles) {
  testing::TemporaryFolder folder;
  WriteExr(folder / "a.exr", Numbers());
  WritePfm(folder / "a.pfm", Numbers());
  WritePfm(folder / "B.PFM", Numbers(), false);
  for (const char* name : {"a.exr", "a.pfm", "B.PFM"}) {
    const DepthImage depth = ReadForeignDepth(folder / name, DepthKind::kRayDistance, 0.001, 4, 2);
    EXPECT_EQ(depth.kind(), DepthKind::kRayDistance);
    EXPECT_THAT(depth.grid().data(), ::testing::ElementsAre(0.001f, 0.0025f, 0, 0, 0, 0, 1, 0.003f))
        << name;
  }
  Grid<std::uint16_t> codes(2, 1);
  codes.data() = {0, 65535};
  WritePng16(folder / "a.png", codes);
  const DepthImage depth = ReadForeignDepth(folder / "a.png", DepthKind::kPlaneZ, 0.001, 2, 1);
  EXPECT_THAT(depth.grid().data(), ::testing::ElementsAre(0, 65.535f));
}

TEST(ForeignDepth, NumbersThatOverflowAreHoles) {
  testing::TemporaryFolder folder;
  WriteExr(folder / "a.exr", Numbers());
  const DepthImage depth = ReadForeignDepth(folder / "a.exr", DepthKind::kPlaneZ, 1e38, 4, 2);
  EXPECT_EQ(depth(0, 0), 1e38f);
  EXPECT_EQ(depth(2, 1), 0);
}

TEST(ForeignDepth, MapsMayBeAWholePartOfTheImage) {
  testing::TemporaryFolder folder;
  WriteExr(folder / "a.exr", Numbers());
  EXPECT_EQ(ReadForeignDepth(folder / "a.exr", DepthKind::kPlaneZ, 1, 12, 6).width(), 4);
  EXPECT_THAT(ErrorOf(folder / "a.exr", 1, 12, 2), HasSubstr("a whole part"));
  EXPECT_THAT(ErrorOf(folder / "a.exr", 1, 6, 3), HasSubstr("found 4x2"));
  EXPECT_THAT(ErrorOf(folder / "a.exr", 1, 2, 1), HasSubstr("a.exr: "));
}

TEST(ForeignDepth, WhatIsNoDepthMapIsRefused) {
  testing::TemporaryFolder folder;
  WritePfm(folder / "rgb.pfm", Grid<float>(4, 2, 3));
  EXPECT_THAT(ErrorOf(folder / "rgb.pfm"), HasSubstr("one channel"));
  WriteMask(folder / "grey8.png", Mask(4, 2, 1, 7));
  EXPECT_THAT(ErrorOf(folder / "grey8.png"), HasSubstr("16 bits"));
  WriteExr(folder / "a.exr", Numbers());
  EXPECT_THAT(ErrorOf(folder / "a.exr", 0), HasSubstr("positive depth unit"));
  EXPECT_THAT(ErrorOf(folder / "a.exr", kNan), HasSubstr("positive depth unit"));
  std::ofstream(folder / "a.txt") << "1 2 3";
  EXPECT_THAT(ErrorOf(folder / "a.txt"), HasSubstr(".exr, .pfm, .png or .tif"));
  std::ofstream(folder / "text.exr") << "1 2 3";
  EXPECT_THAT(ErrorOf(folder / "text.exr"), HasSubstr("text.exr"));
  EXPECT_THAT(ErrorOf(folder / "absent.exr"), HasSubstr("absent.exr"));
}

TEST(ForeignDepth, EveryTruncatedPrefixIsRefused) {
  testing::TemporaryFolder folder;
  WriteExr(folder / "a.exr", Numbers());
  WritePfm(folder / "a.pfm", Numbers());
  WritePng16(folder / "a.png", Grid<std::uint16_t>(4, 2, 1, 77));
  for (const char* extension : {".exr", ".pfm", ".png"}) {
    const std::string good = ReadFile(folder / (std::string("a") + extension), 100000);
    const auto file = folder / (std::string("cut") + extension);
    for (size_t length = 0; length < good.size(); ++length) {
      std::ofstream(file, std::ios::binary) << good.substr(0, length);
      EXPECT_THROW(ReadForeignDepth(file, DepthKind::kPlaneZ, 1, 4, 2), Error)
          << extension << " " << length << " of " << good.size();
    }
  }
}

}  // namespace
}  // namespace dtr::io
