// Images whose headers lie: memory that reading takes, counted for all libraries.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/image_io.h"
#include "tests/fuzz/memory_watch.h"
#include "tests/support/hostile_images.h"
#include "tests/support/message_of.h"
#include "tests/support/test_data.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
constexpr double kMiB = 1 << 20;
// docs/SECURITY.md, with OpenImageIO's conversion buffer.
constexpr double kTimesInput = 10, kBeside = 128 * kMiB;

struct Taken {
  double bytes = 0;
  std::string error;  ///< empty: it was read
};

template <typename Read>
Taken Watch(const Read& read) {
  const fuzz::MemoryWatch watch;
  Taken taken;
  try {
    read();
  } catch (const Error& error) {
    taken.error = error.what();
  }
  taken.bytes = static_cast<double>(watch.PeakBytes());
  return taken;
}

std::vector<Taken> ReadInEveryWay(const fs::path& file, double memory_gb) {
  return {Watch([&] { ReadImageHeader(file, memory_gb); }),
          Watch([&] { ReadImageAndMask(file, {.memory_gb = memory_gb}); }),
          Watch([&] { ReadMask(file, kImageLimitPx, memory_gb); })};
}

void ExpectWithin(const fs::path& file, const std::string& bytes, double memory_gb, double most) {
  WriteFileAtomically(file, bytes);
  const std::vector<Taken> all = ReadInEveryWay(file, memory_gb);
  for (size_t way = 0; way < all.size(); ++way) {
    EXPECT_LE(all[way].bytes, most) << file << ", way " << way << ": " << all[way].error;
    // A header may be told, the pixels are not there.
    if (way > 0) {
      EXPECT_NE(all[way].error, "") << file;
    }
    EXPECT_EQ(all[way].error.find('\n'), std::string::npos) << file;
    EXPECT_LT(all[way].error.size(), 600U) << file;
  }
}

TEST(HostileImages, HeadersThatLieTakeNoMemory) {
  const TemporaryFolder folder;
  ReadInEveryWay(folder / "absent.png", 4);  // what is set up once is none of theirs
  for (const auto& [name, bytes] : testing::HostileImages(0)) {
    ExpectWithin(folder / name, bytes, 4,
                 kTimesInput * static_cast<double>(bytes.size()) + kBeside);
  }
}

TEST(HostileImages, CanvasesOfGifs) {
  const TemporaryFolder folder;
  for (const int side : {20000, 40000, 65535}) {
    for (const bool frame : {false, true}) {
      ExpectWithin(folder / "a.gif", testing::HostileGif(side, side, frame), 4, kBeside);
    }
  }
  EXPECT_THAT(testing::MessageOf<Error>([&] { ReadImageHeader(folder / "a.gif"); }),
              HasSubstr("a.gif: damaged image: expected as many pixels as "));
}

// A file that is long enough for its header is read within the memory that is given, or not at all.
TEST(HostileImages, PaddedHeadersTakeTheMemoryThatIsGiven) {
  const TemporaryFolder folder;
  constexpr size_t kPadding = 300'000;
  constexpr double kGb = 0.25;
  for (const auto& [name, bytes] : testing::HostileImages(kPadding)) {
    ExpectWithin(folder / name, bytes, kGb, kGb * 1e9 + kBeside);
  }
  ExpectWithin(folder / "a.gif", testing::HostileGif(19000, 19000) + std::string(kPadding, '\0'),
               kGb, kGb * 1e9 + kBeside);
  EXPECT_THAT(testing::MessageOf<Error>([&] { ReadImageHeader(folder / "a.gif", kGb); }),
              HasSubstr("a.gif: reading its 19000x19000 pixels takes 2.89 GB of memory, more than "
                        "`memory` 0.25; give more, or shrink the image"));
}

TEST(HostileImages, WhatAHeaderNeedsIsKnownBeforeItIsRead) {
  const TemporaryFolder folder;
  WriteFileAtomically(folder / "a.gif", testing::HostileGif(1000, 1000));
  EXPECT_EQ(BytesToReadHeader(folder / "a.gif"), 8e6);
  WriteImage(folder / "a.png", ImageRgb8(100, 100, 3));
  EXPECT_EQ(BytesToReadHeader(folder / "a.png"), 0);
}

}  // namespace
}  // namespace dtr::io
