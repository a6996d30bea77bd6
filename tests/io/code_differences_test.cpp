// Codes as differences to a base: they come back exactly, equal ones cost almost nothing, and
// nothing that was not written is read.
#include "dtr/io/code_differences.h"

#include <gtest/gtest.h>

#include <cstring>
#include <string>

#include "dtr/base/error.h"
#include "dtr/base/random.h"
#include "tests/support/on_threads.h"

namespace dtr::io {
namespace {

using CodeGrid = Grid<std::uint16_t>;

constexpr size_t kRowsAt = 8 + 32 + 2 * 4;  // magic, SHA-256, width, height (docs/FORMAT.md, 4.3)
const std::string kHash = "00ff" + std::string(58, '7') + "a1";

CodeGrid CodesAtRandom(Random& random, int width_px, int height_px, double holes) {
  CodeGrid codes(width_px, height_px);
  for (auto& code : codes.data()) {
    if (random.Uniform() >= holes) code = static_cast<std::uint16_t>(1 + random.Index(65535));
  }
  return codes;
}

/// Another code, or a hole, at a share of the pixels.
CodeGrid Changed(Random& random, const CodeGrid& base, double share) {
  CodeGrid codes = base;
  for (auto& code : codes.data()) {
    if (random.Uniform() < share) code = static_cast<std::uint16_t>(random.Index(3) * 21845);
  }
  return codes;
}

TEST(CodeDifferences, AllKindsOfChangesComeBackExactly) {
  Random random(1);
  for (const auto& [w, h] : {std::pair(1, 1), std::pair(7, 3), std::pair(8, 128), std::pair(9, 129),
                             std::pair(64, 257), std::pair(300, 2)}) {
    for (const double holes : {0.0, 0.5, 1.0}) {
      const CodeGrid base = CodesAtRandom(random, w, h, holes);
      for (const double share : {0.0, 0.02, 0.5, 1.0}) {
        const CodeGrid codes = Changed(random, base, share);
        const std::string bytes = EncodeDifferences(codes, base, kHash);
        ASSERT_EQ(DecodeDifferences(bytes, base), codes) << w << "x" << h << " " << share;
        ASSERT_EQ(BaseOfDifferences(bytes), kHash);
        ASSERT_LE(bytes.size(), MostDifferenceBytes(w, h));
      }
    }
  }
}

TEST(CodeDifferences, BandsWithoutAChangeTakeTheirSizesAlone) {
  Random random(2);
  const CodeGrid base = CodesAtRandom(random, 200, 300, 0.1);  // three bands
  EXPECT_EQ(EncodeDifferences(base, base, kHash).size(), kRowsAt + 4 + 3 * 4 * 4);
}

TEST(CodeDifferences, AreTheSameForAnyNumberOfThreads) {
  Random random(3);
  const CodeGrid base = CodesAtRandom(random, 50, 700, 0.3), codes = Changed(random, base, 0.2);
  const std::string bytes = OnThreads(1, [&] { return EncodeDifferences(codes, base, kHash); });
  EXPECT_EQ(OnThreads(4, [&] { return EncodeDifferences(codes, base, kHash); }), bytes);
  EXPECT_EQ(OnThreads(4, [&] { return DecodeDifferences(bytes, base); }), codes);
}

TEST(CodeDifferences, EveryTruncatedPrefixAndEveryFlippedBitIsAnError) {
  Random random(4);
  const CodeGrid base = CodesAtRandom(random, 13, 140, 0.4), codes = Changed(random, base, 0.1);
  const std::string bytes = EncodeDifferences(codes, base, kHash);
  for (size_t size = 0; size < bytes.size(); ++size) {
    ASSERT_THROW(DecodeDifferences(std::string_view(bytes).substr(0, size), base), Error) << size;
  }
  EXPECT_THROW(DecodeDifferences(bytes + '\0', base), Error);
  for (size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    if (bit >= 8 * 8 && bit < 8 * 40) continue;  // the base's hash, which the caller compares
    std::string damaged = bytes;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ 1 << (bit % 8));
    try {
      // A bit that means nothing (a reserved one of a frame) may read the same, never other codes.
      ASSERT_EQ(DecodeDifferences(damaged, base), codes) << bit;
    } catch (const Error&) {
    }
  }
}

TEST(CodeDifferences, HostileSizesAreRejectedBeforeAnythingIsAllocated) {
  const CodeGrid base(8, 8, 1, 7);
  CodeGrid codes = base;
  codes(3, 3) = 9;
  const std::string bytes = EncodeDifferences(codes, base, kHash);
  const auto with = [&](size_t at, std::uint32_t value) {
    std::string changed = bytes;
    std::memcpy(changed.data() + at, &value, sizeof value);
    return changed;
  };
  EXPECT_THROW(DecodeDifferences(bytes, CodeGrid(8, 9)), Error);
  EXPECT_THROW(DecodeDifferences(with(kRowsAt - 8, 0xffffffff), base), Error);
  EXPECT_THROW(DecodeDifferences(with(kRowsAt, 0), base), Error);
  EXPECT_THROW(DecodeDifferences(with(kRowsAt, 0x7fffffff), base), Error);
  EXPECT_THROW(DecodeDifferences(with(kRowsAt, 1), base), Error)
      << "eight bands where there is one";
  for (size_t part = 0; part < 4; ++part) {
    EXPECT_THROW(DecodeDifferences(with(kRowsAt + 4 + 4 * part, 0xffffffff), base), Error);
  }
  for (size_t part = 0; part < 3; ++part) {  // the fourth is empty
    EXPECT_THROW(DecodeDifferences(with(kRowsAt + 4 + 4 * part, 0), base), Error) << part;
  }
}

}  // namespace
}  // namespace dtr::io
