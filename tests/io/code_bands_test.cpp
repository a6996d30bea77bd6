// Our own depth files: codes come back exactly, errors stay within what was asked for, and nothing
// that was not written is read.
#include "dtr/io/code_bands.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <string>

#include "dtr/base/error.h"
#include "dtr/base/random.h"
#include "dtr/io/depth_io.h"
#include "tests/support/on_threads.h"

namespace dtr::io {
namespace {

using ::testing::HasSubstr;
using Codes = Grid<std::uint16_t>;

constexpr size_t kHeaderBytes = 20;  // docs/FORMAT.md, section 4.1

Codes RandomCodes(Random& random, int width_px, int height_px, int most, double holes) {
  Codes codes(width_px, height_px);
  for (auto& code : codes.data()) {
    if (random.Uniform() < holes) continue;
    code = static_cast<std::uint16_t>(1 + random.Index(most));
  }
  return codes;
}

TEST(CodeBands, AllKindsOfMapsComeBackExactly) {
  Random random(1);
  // Below, at and above the rows of a band, and widths at and beside whole bytes of validity.
  for (const auto& [w, h] : {std::pair(1, 1), std::pair(7, 3), std::pair(8, 128), std::pair(9, 129),
                             std::pair(64, 257), std::pair(300, 2)}) {
    EXPECT_EQ(DecodeBands(EncodeBands(Codes(w, h)), w, h), Codes(w, h)) << "all holes";
    for (const int most : {1, 2, 300, 65535}) {
      for (const double holes : {0.0, 0.5, 0.99}) {
        const Codes codes = RandomCodes(random, w, h, most, holes);
        ASSERT_EQ(DecodeBands(EncodeBands(codes), w, h), codes) << w << "x" << h << " " << most;
      }
    }
    Codes board(w, h);
    for (int y = 0; y < h; ++y) {
      for (int x = 0; x < w; ++x) board(x, y) = (x + y) % 2 == 0 ? 1 : 65535;
    }
    EXPECT_EQ(DecodeBands(EncodeBands(board), w, h), board) << "near and far in turns";
    Codes single(w, h);
    single(w - 1, h - 1) = 40000;
    EXPECT_EQ(DecodeBands(EncodeBands(single), w, h), single) << "one pixel";
  }
}

TEST(CodeBands, AreTheSameForAnyNumberOfThreads) {
  Random random(2);
  const Codes codes = RandomCodes(random, 50, 700, 400, 0.3);
  const std::string bytes = OnThreads(1, [&] { return EncodeBands(codes); });
  EXPECT_EQ(OnThreads(4, [&] { return EncodeBands(codes); }), bytes);
  EXPECT_EQ(OnThreads(4, [&] { return DecodeBands(bytes, 50, 700); }), codes);
}

TEST(CodeBands, SmoothSurfacesWithHolesCostAFractionOfTheirBytes) {
  Random random(3);
  Codes codes(400, 300);
  for (int y = 0; y < 300; ++y) {
    for (int x = 0; x < 400; ++x) {
      if (random.Uniform() < 0.1) continue;
      codes(x, y) = static_cast<std::uint16_t>(1000 + 2 * x + 3 * y);
    }
  }
  // Residuals of a plane are 0 but beside holes, and the holes alone have 0.47 bits a pixel.
  EXPECT_LT(EncodeBands(codes).size(), 400 * 300 * 2 / 10);
}

TEST(CodeBands, EveryTruncatedPrefixAndEveryFlippedBitIsAnError) {
  Random random(4);
  Codes codes = RandomCodes(random, 13, 140, 900, 0.4);
  const std::string bytes = EncodeBands(codes);
  for (size_t size = 0; size < bytes.size(); ++size) {
    ASSERT_THROW(DecodeBands(std::string_view(bytes).substr(0, size), 13, 140), Error) << size;
  }
  EXPECT_THROW(DecodeBands(bytes + '\0', 13, 140), Error);
  for (size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    std::string damaged = bytes;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ 1 << (bit % 8));
    try {
      // A bit that means nothing (a reserved one of a frame) may read the same, never other codes.
      ASSERT_EQ(DecodeBands(damaged, 13, 140), codes) << bit;
    } catch (const Error&) {
    }
  }
}

TEST(CodeBands, HostileSizesAreRejectedBeforeAnythingIsAllocated) {
  const std::string bytes = EncodeBands(Codes(8, 8, 1, 7));
  const auto with = [&](size_t at, std::uint32_t value) {
    std::string changed = bytes;
    std::memcpy(changed.data() + at, &value, sizeof value);
    return changed;
  };
  EXPECT_THROW(DecodeBands(bytes, 8, 9), Error);
  EXPECT_THROW(DecodeBands(with(8, 0xffffffff), 8, 8), Error);
  EXPECT_THROW(DecodeBands(with(16, 0), 8, 8), Error);
  EXPECT_THROW(DecodeBands(with(16, 0x7fffffff), 8, 8), Error);
  EXPECT_THROW(DecodeBands(with(16, 1), 8, 8), Error) << "eight bands where there is one";
  EXPECT_THROW(DecodeBands(with(kHeaderBytes, 0xffffffff), 8, 8), Error);
  EXPECT_THROW(EncodeBands(Codes()), Error);
  EXPECT_LE(bytes.size(), MostBandBytes(8, 8));
}

// The most address space this process had so far, in KiB.
long PeakAddressSpaceKib() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmPeak:", 0) == 0) return std::stol(line.substr(7));
  }
  return 0;
}

// A file of a few bytes about a map of 400 million pixels: what it says of itself must hold before
// room for the map is made.
TEST(CodeBands, AMapThatTheFileCannotHoldTakesNoMemory) {
  constexpr int kSide = 20000, kRows = 10000;
  constexpr long kMaxKib = 64 << 10;  // the codes alone would be 800 MB
  const auto file = [&](const std::string& frame) {
    std::string bytes("DTRBAND1");
    const auto put = [&](std::uint32_t value) {
      bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
    };
    for (const int number : {kSide, kSide, kRows}) put(static_cast<std::uint32_t>(number));
    for (int band = 0; band < kSide / kRows; ++band) {
      put(static_cast<std::uint32_t>(frame.size()));
      put(0);
      put(0);
    }
    for (int band = 0; band < kSide / kRows; ++band) bytes += frame;
    return bytes;
  };
  // zstd's magic, a single segment with 4 bytes of size, and one block of no bytes (RFC
  // 8878, 3.1.1)
  const auto frame = [](std::uint32_t size) {
    std::string bytes("\x28\xb5\x2f\xfd\xa0", 5);
    bytes.append(reinterpret_cast<const char*>(&size), sizeof size);
    return bytes + std::string("\x01\x00\x00", 3);
  };
  const long before = PeakAddressSpaceKib();
  ASSERT_GT(before, 0);
  EXPECT_THROW(DecodeBands(file(""), kSide, kSide), Error);
  EXPECT_THROW(DecodeBands(file("no frame at all"), kSide, kSide), Error);
  EXPECT_THROW(DecodeBands(file(frame(7)), kSide, kSide), Error);
  EXPECT_THROW(DecodeBands(file(frame(kSide / 8 * kRows)), kSide, kSide), Error);
  EXPECT_LT(PeakAddressSpaceKib() - before, kMaxKib);
}

DepthImage DepthWithin(Random& random, double near_z, double far_z) {
  DepthImage depth(40, 30);
  for (float& z : depth.grid().data()) {
    if (random.Uniform() < 0.2) continue;
    z = static_cast<float>(1 / random.Uniform(1 / far_z, 1 / near_z));
    z = std::clamp(z, static_cast<float>(near_z), static_cast<float>(far_z));
  }
  depth(0, 0) = static_cast<float>(near_z);
  depth(1, 0) = static_cast<float>(far_z);
  return depth;
}

TEST(StepsForError, KeepsEveryInverseDepthWithinTheBoundAndEveryHole) {
  Random random(5);
  for (const auto& [near_z, far_z] :
       {std::pair(0.5, 1.0), std::pair(2.0, 90.0), std::pair(1e-3, 65.535), std::pair(1e5, 1e9),
        std::pair(1.0, 1.001)}) {
    const double range = 1 / near_z - 1 / far_z;
    for (const double share : {0.6, 0.3, 0.01, 1e-4, 2e-5}) {
      const double error = share * range;
      if (error < 1e-6 / near_z) continue;  // float32's own rounding would be a part of it
      const int steps = StepsForError(near_z, far_z, error);
      const DepthImage depth = DepthWithin(random, near_z, far_z);
      const DepthImage back =
          DecodeInverseDepth(EncodeInverseDepth(depth, near_z, far_z, steps), near_z, far_z, steps);
      for (size_t i = 0; i < depth.grid().data().size(); ++i) {
        const double z = depth.grid().data()[i], stored = back.grid().data()[i];
        ASSERT_EQ(z == 0, stored == 0);
        if (z == 0) continue;
        ASSERT_LE(std::abs(1 / stored - 1 / z), error) << steps << " steps, z " << z;
      }
      // Not more steps than it takes: a half of them breaks the bound's half step.
      if (steps > 4) {
        EXPECT_GT(range / (steps / 2) / 2, error);
      }
    }
  }
}

TEST(StepsForError, RejectsWhatSixteenBitsOrFloatCannotKeep) {
  EXPECT_EQ(StepsForError(1, 2, 10), 1);
  EXPECT_THROW(StepsForError(1, 2, 1e-7), Error);       // 2.5 million steps
  EXPECT_THROW(StepsForError(1, 1.0001, 1e-8), Error);  // below float's rounding
  EXPECT_THROW(StepsForError(2, 1, 0.1), Error);
  EXPECT_THROW(StepsForError(1, 2, std::nan("")), Error);
  EXPECT_THROW(DecodeInverseDepth(Codes(2, 2, 1, 12), 1, 2, 10), Error);  // code 11 is the last
  EXPECT_NO_THROW(DecodeInverseDepth(Codes(2, 2, 1, 11), 1, 2, 10));
  EXPECT_THROW(DecodeInverseDepth(Codes(2, 2), 1, 2, 65535), Error);
}

TEST(SetDepthError, TakesOffWhatWasRoundedAlready) {
  View view;
  view.near_z = 1, view.far_z = 4;
  const double exact_half_step = 0.75 / InverseDepthCode::kSteps / 2;
  SetDepthError(view, 0.01);
  EXPECT_EQ(view.depth_coding, DepthCoding::kZstdInverseDepth);
  EXPECT_EQ(view.depth_steps, StepsForError(1, 4, 0.01 - exact_half_step));
  const int steps = view.depth_steps;
  SetDepthError(view, 0.02);  // half of it is gone
  EXPECT_EQ(view.depth_steps, StepsForError(1, 4, 0.02 - 0.75 / steps / 2));
}

}  // namespace
}  // namespace dtr::io
