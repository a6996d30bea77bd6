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
  // 65535 is what depth cameras write where they measured nothing.
  Grid<std::uint16_t> codes(3, 1);
  codes.data() = {0, 65534, 65535};
  WritePng16(folder / "a.png", codes);
  const DepthImage depth = ReadForeignDepth(folder / "a.png", DepthKind::kPlaneZ, 0.001, 3, 1);
  EXPECT_THAT(depth.grid().data(), ::testing::ElementsAre(0, 65.534f, 0));
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

TEST(ForeignDepth, WhatIsNoDepthMapIsRejected) {
  testing::TemporaryFolder folder;
  WritePfm(folder / "rgb.pfm", Grid<float>(4, 2, 3));
  EXPECT_THAT(ErrorOf(folder / "rgb.pfm"), HasSubstr("one channel"));
  WriteMask(folder / "grey8.png", Mask(4, 2, 1, 7));
  EXPECT_THAT(ErrorOf(folder / "grey8.png"), HasSubstr("16 bits"));
  WriteExr(folder / "a.exr", Numbers());
  EXPECT_THAT(ErrorOf(folder / "a.exr", 0), HasSubstr("positive depth unit"));
  EXPECT_THAT(ErrorOf(folder / "a.exr", kNan), HasSubstr("positive depth unit"));
  std::ofstream(folder / "a.txt") << "1 2 3";
  EXPECT_THAT(ErrorOf(folder / "a.txt"), HasSubstr(".exr, .pfm, .png, .tif or .npy"));
  std::ofstream(folder / "text.exr") << "1 2 3";
  EXPECT_THAT(ErrorOf(folder / "text.exr"), HasSubstr("text.exr"));
  EXPECT_THAT(ErrorOf(folder / "absent.exr"), HasSubstr("absent.exr"));
}

// A .npy file of format 1 with these bytes as its data.
std::string Npy(const std::string& descr, const std::string& shape, const std::string& data) {
  const std::string header =
      "{'descr': '" + descr + "', 'fortran_order': False, 'shape': " + shape + ", }\n";
  std::string bytes("\x93NUMPY\x01\0", 8);
  bytes += static_cast<char>(header.size() & 0xff);
  bytes += static_cast<char>(header.size() >> 8);
  return bytes + header + data;
}

TEST(ForeignDepth, NumpyArraysOfOneImageAreRead) {
  testing::TemporaryFolder folder;
  const auto file = folder / "a.npy";
  const auto depths = [&](const std::string& bytes) {
    std::ofstream(file, std::ios::binary) << bytes;
    return ReadForeignDepth(file, DepthKind::kPlaneZ, 0.5, 2, 1).grid().data();
  };
  const auto text = [](std::initializer_list<int> codes) {
    std::string bytes;
    for (const int code : codes) bytes += static_cast<char>(code);
    return bytes;
  };
  using ::testing::ElementsAre;
  const std::string u16 = text({2, 0, 255, 255});
  for (const char* shape : {"(1, 2)", "(1, 1, 2)", "(1, 2, 1)"}) {
    EXPECT_THAT(depths(Npy("<u2", shape, u16)), ElementsAre(1, 32767.5f)) << shape;
  }
  EXPECT_TRUE(HoldsWholeNumbers(file));
  EXPECT_THAT(depths(Npy(">u2", "(1, 2)", u16)), ElementsAre(256, 32767.5f));
  EXPECT_THAT(depths(Npy("<i2", "(1, 2)", u16)), ElementsAre(1, 0)) << "-1 is a hole";
  // float16: 1.5 is 0x3e00, infinity 0x7c00.
  EXPECT_THAT(depths(Npy("<f2", "(1, 2)", text({0, 0x3e, 0, 0x7c}))), ElementsAre(0.75f, 0));
  // float32: 2 is 0x40000000, NaN 0x7fc00000.
  EXPECT_THAT(depths(Npy("<f4", "(1, 2)", text({0, 0, 0, 0x40, 0, 0, 0xc0, 0x7f}))),
              ElementsAre(1, 0));
  EXPECT_FALSE(HoldsWholeNumbers(file));
  for (const char* shape : {"(2,)", "(1, 2, 1, 1)", "(0, 2)", "(2, 1, 1, 1)"}) {
    EXPECT_THROW(depths(Npy("<u2", shape, u16)), Error) << shape;
  }
  EXPECT_THROW(depths(Npy("|O", "(1, 2)", u16)), Error);
  EXPECT_THROW(depths(Npy("<f8", "(100000, 100000)", u16)), Error);
  const std::string good = Npy("<u2", "(1, 2)", u16);
  for (size_t length = 0; length < good.size(); ++length) {
    EXPECT_THROW(depths(good.substr(0, length)), Error) << length;
  }
}

TEST(ForeignDepth, ATiffOf16BitsIsOfWholeNumbers) {
  testing::TemporaryFolder folder;
  // Little endian, one strip behind the header; the smallest directory that says so.
  const auto entry = [](int tag, int type, int value) {
    std::string bytes;
    for (const int part : {tag, type, 1, 0, value, 0}) {
      bytes += static_cast<char>(part & 0xff);
      bytes += static_cast<char>(part >> 8);
    }
    return bytes;
  };
  constexpr int kShort = 3, kLong = 4;
  std::string tiff("II*\0\x0c\0\0\0", 8);
  tiff += std::string("\xe8\x03\xd0\x07", 4);  // 1000, 2000
  tiff += std::string("\x09\0", 2);
  tiff += entry(256, kShort, 2) + entry(257, kShort, 1) + entry(258, kShort, 16) +
          entry(259, kShort, 1) + entry(262, kShort, 1) + entry(273, kLong, 8) +
          entry(277, kShort, 1) + entry(278, kShort, 1) + entry(279, kLong, 4);
  tiff += std::string(4, '\0');
  std::ofstream(folder / "a.tif", std::ios::binary) << tiff;
  EXPECT_TRUE(HoldsWholeNumbers(folder / "a.tif"));
  EXPECT_THAT(ReadForeignDepth(folder / "a.tif", DepthKind::kPlaneZ, 0.001, 2, 1).grid().data(),
              ::testing::ElementsAre(1, 2));
}

TEST(ForeignDepth, EveryTruncatedPrefixIsRejected) {
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
