#include "dtr/io/formats/pfm.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/random.h"
#include "tests/support/test_data.h"

namespace dtr::io {
namespace {

using ::testing::HasSubstr;

TEST(Pfm, TheFirstRowInTheFileIsTheBottomRow) {
  // 1.0f is 0x3f800000, 2.0f is 0x40000000.
  const std::string bytes = std::string("Pf\n1 2\n-1.0\n") + std::string("\0\0\x80\x3f", 4) +
                            std::string("\0\0\0\x40", 4);
  const Grid<float> grid = ParsePfm(bytes, "a.pfm");
  EXPECT_EQ(grid(0, 1), 1.0f);
  EXPECT_EQ(grid(0, 0), 2.0f);
}

TEST(Pfm, BothByteOrdersAndChannelCountsSurviveWritingAndReading) {
  testing::TemporaryFolder folder;
  Random random(1);
  for (const int channels : {1, 3}) {
    Grid<float> grid(7, 5, channels);
    for (float& value : grid.data()) value = static_cast<float>(random.Normal());
    grid(3, 2) = std::numeric_limits<float>::infinity();
    for (const bool little_endian : {true, false}) {
      WritePfm(folder / "a.pfm", grid, little_endian);
      EXPECT_EQ(ReadPfm(folder / "a.pfm"), grid) << channels << little_endian;
    }
  }
  EXPECT_THROW(WritePfm(folder / "b.pfm", Grid<float>(2, 2, 2)), std::invalid_argument);
  EXPECT_FALSE(std::filesystem::exists(folder / "b.pfm"));
}

TEST(Pfm, EveryTruncatedPrefixIsRejected) {
  testing::TemporaryFolder folder;
  WritePfm(folder / "a.pfm", Grid<float>(3, 2, 3, 1.5f));
  const std::string good = ReadFile(folder / "a.pfm", 1000);
  for (size_t length = 0; length < good.size(); ++length) {
    EXPECT_THROW(ParsePfm(std::string_view(good).substr(0, length), "a.pfm"), Error) << length;
  }
  EXPECT_THROW(ParsePfm(good + "x", "a.pfm"), Error);
}

TEST(Pfm, HostileHeadersAreRejectedBeforeAnyAllocation) {
  const auto error_of = [](const std::string& bytes) -> std::string {
    try {
      ParsePfm(bytes, "a.pfm");
    } catch (const Error& e) {
      return e.what();
    }
    return "no error";
  };
  EXPECT_THAT(error_of("P6\n1 1\n255\n..."), HasSubstr("Pf or PF"));
  EXPECT_THAT(error_of("Pf\n65536 65536\n-1\nabcd"), HasSubstr("17179869184 bytes"));
  EXPECT_THAT(error_of("Pf\n99999999999 1\n-1\nabcd"), HasSubstr("width"));
  EXPECT_THAT(error_of("Pf\n-1 1\n-1\nabcd"), HasSubstr("sides"));
  EXPECT_THAT(error_of("Pf\n1 1\n0\nabcd"), HasSubstr("scale"));
  EXPECT_THAT(error_of("Pf\n1 1\nnan\nabcd"), HasSubstr("scale"));
  EXPECT_THAT(error_of("Pf\n" + std::string(1000, '1')), HasSubstr("header"));
}

}  // namespace
}  // namespace dtr::io
