// The files of tests/io/formats/lzfse were made by the reference encoder (github.com/lzfse/lzfse,
// `lzfse -encode`) from the bytes below, which the disabled test at the end writes.
// depth_plain_header.lzfse is depth.lzfse with its header in the long form, which the reference
// decoder reads and no encoder writes.
#include "dtr/io/formats/lzfse.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "tests/support/message_of.h"

namespace dtr::io {
namespace {

using ::testing::HasSubstr;

constexpr size_t kMaxBytes = 1 << 20;

std::string Stream(const std::string& name) {
  return ReadFile("tests/io/formats/lzfse/" + name + ".lzfse", kMaxBytes);
}

std::string Decoded(std::string_view stream) { return DecodeLzfse(stream, kMaxBytes, "s"); }

std::string ErrorOf(std::string_view stream) {
  return testing::MessageOf<Error>([&] { Decoded(stream); });
}

/// A stream out of blocks: marks, little-endian numbers, bytes.
std::string Le(std::uint32_t number) {
  std::string bytes;
  for (int i = 0; i < 4; ++i) bytes += static_cast<char>(number >> 8 * i & 0xff);
  return bytes;
}
std::string Stored(const std::string& bytes) {
  return "bvx-" + Le(static_cast<std::uint32_t>(bytes.size())) + bytes;
}
std::string Lzvn(std::uint32_t stands_for, const std::string& payload) {
  return "bvxn" + Le(stands_for) + Le(static_cast<std::uint32_t>(payload.size())) + payload;
}
const std::string kLzvnEnd("\x06\0\0\0\0\0\0\0", 8);

/// Numbers that look like any, the same on every machine.
class Congruential {
 public:
  explicit Congruential(std::uint64_t seed) : state_(seed) {}
  std::uint64_t Next() {
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;
    return state_ >> 40;
  }

 private:
  std::uint64_t state_;
};

/// A depth map of 36x48: a tilted wall with a disc before it, and a corner without depth.
std::string DepthBytes() {
  std::string bytes;
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 36; ++x) {
      auto z = static_cast<float>(1.5 + 0.01 * x + 0.02 * y);
      if ((x - 18) * (x - 18) + (y - 24) * (y - 24) < 100) z = 1;
      if (x >= 30 && y < 8) z = std::numeric_limits<float>::quiet_NaN();
      char raw[sizeof z];
      std::memcpy(raw, &z, sizeof z);
      bytes.append(raw, sizeof z);
    }
  }
  return bytes;
}

/// Long runs: repeats longer than one symbol can say.
std::string RunBytes() {
  std::string bytes(20000, '\0');
  for (int i = 0; i < 10000; ++i) bytes += static_cast<char>(i / 1000);
  for (int i = 0; i < 4000; ++i) bytes += "ab";
  return bytes;
}

/// More than one block holds.
std::string BlockBytes() {
  std::string bytes;
  Congruential numbers(1);
  for (int i = 0; i < 60000; ++i) bytes += static_cast<char>((numbers.Next() >> 10) % 5);
  return bytes;
}

/// What cannot be compressed is stored.
std::string NoiseBytes() {
  std::string bytes;
  Congruential numbers(2);
  for (int i = 0; i < 600; ++i) bytes += static_cast<char>(numbers.Next() >> 8 & 0xff);
  return bytes;
}

/// Less than 4 kB: LZVN.
std::string TextBytes() {
  std::string bytes;
  for (int i = 0; i < 60; ++i) bytes += "frame " + std::to_string(i) + " of the room; ";
  return bytes;
}

/// Confidence of 36x48.
std::string ConfidenceBytes() {
  std::string bytes;
  for (int i = 0; i < 36 * 48; ++i) bytes += static_cast<char>(i % 36 < 3 ? 0 : i % 36 < 6 ? 1 : 2);
  return bytes;
}

struct Vector {
  const char* name;
  std::string bytes;
  std::vector<std::string> marks;  ///< of its blocks
};

std::vector<Vector> Vectors() {
  return {{"depth", DepthBytes(), {"bvx2"}},     {"depth_plain_header", DepthBytes(), {"bvx1"}},
          {"runs", RunBytes(), {"bvx2"}},        {"blocks", BlockBytes(), {"bvx2", "bvx2"}},
          {"noise", NoiseBytes(), {"bvx-"}},     {"text", TextBytes(), {"bvxn"}},
          {"conf", ConfidenceBytes(), {"bvxn"}}, {"short", "abc", {"bvx-"}}};
}

std::vector<std::string> MarksOf(const std::string& stream) {
  std::vector<std::string> marks;
  for (size_t at = 0; (at = stream.find("bvx", at)) != std::string::npos; ++at) {
    marks.push_back(stream.substr(at, 4));
  }
  return marks;
}

TEST(Lzfse, StreamsOfTheReferenceEncoderAreDecoded) {
  for (const Vector& vector : Vectors()) {
    const std::string stream = Stream(vector.name);
    auto marks = vector.marks;
    marks.push_back("bvx$");
    EXPECT_EQ(MarksOf(stream), marks) << vector.name;
    EXPECT_TRUE(Decoded(stream) == vector.bytes) << vector.name;
  }
}

TEST(Lzfse, EveryTruncatedPrefixIsRejected) {
  for (const Vector& vector : Vectors()) {
    const std::string stream = Stream(vector.name);
    const size_t step = stream.size() > 3000 ? 97 : 1;
    for (size_t bytes = 0; bytes < stream.size(); bytes += step) {
      EXPECT_THROW(Decoded(std::string_view(stream).substr(0, bytes)), Error)
          << vector.name << " cut after " << bytes;
    }
    EXPECT_THROW(Decoded(std::string_view(stream).substr(0, stream.size() - 1)), Error);
  }
}

TEST(Lzfse, BlocksOfAnyKindFollowEachOtherAndReferToEarlierOnes) {
  // A block of LZVN that repeats two of the three stored bytes before it, then copies one.
  const std::string payload = std::string("\x00\x02\xe1z", 4) + kLzvnEnd;
  EXPECT_EQ(Decoded(Stored("abc") + Lzvn(4, payload) + Stored("") + Stored("!") + "bvx$and more"),
            "abcbcbz!");
}

TEST(Lzfse, InstructionsOfLzvnWorkedByHand) {
  const auto of = [](const std::string& payload, std::uint32_t length) {
    return Decoded(Lzvn(length, payload + kLzvnEnd) + "bvx$");
  };
  EXPECT_EQ(of("\xe2xy", 2), "xy") << "bytes alone";
  EXPECT_EQ(of(std::string("\xe0\x02", 2) + std::string(18, 'q'), 18), std::string(18, 'q'))
      << "16 bytes and more";
  EXPECT_EQ(of(std::string("\xe2xy\x40\x01z", 6), 6), "xyzzzz") << "one byte, then near";
  EXPECT_EQ(of(std::string("\xe2xy\x47\x02\x00z", 7), 6), "xyzyzy") << "far";
  EXPECT_EQ(of(std::string("\xe2xy\xa8\x09\x00z", 7), 7), "xyzyzyz") << "medium";
  EXPECT_EQ(of(std::string("\xe2xy\x00\x02\x46q", 7), 9), "xyxyxqxqx") << "as far as before";
  EXPECT_EQ(of(std::string("\xe2xy\x00\x02\xf1", 6), 6), "xyxyxy") << "a repeat alone";
  EXPECT_EQ(of(std::string("\xe2xy\x00\x01\xf0\x01", 7), 22), "x" + std::string(21, 'y'));
  EXPECT_EQ(of("\xe1x\x0e\x16\xe1y", 2), "xy") << "nothing is nothing";
}

TEST(Lzfse, DamagedStreamsAreNamedWithWhatIsWrong) {
  EXPECT_EQ(ErrorOf("PK\x03\x04"),
            "s: damaged LZFSE data: found an unknown kind of block; copy the file again");
  EXPECT_THAT(ErrorOf("bvx-" + Le(0xffffffff)), HasSubstr("its end before that of a block"));
  EXPECT_THAT(ErrorOf(Lzvn(3, std::string("\x00\x01", 2) + kLzvnEnd) + "bvx$"),
              HasSubstr("before the first"));
  EXPECT_THAT(ErrorOf(Lzvn(3, std::string("\xe1x\x00\x00", 4) + kLzvnEnd) + "bvx$"),
              HasSubstr("before the first"));
  EXPECT_THAT(ErrorOf(Lzvn(3, "\xe1x" + kLzvnEnd) + "bvx$"), HasSubstr("another length"));
  EXPECT_THAT(ErrorOf(Lzvn(1, "\xe1x" + kLzvnEnd + "?") + "bvx$"), HasSubstr("behind the end"));
  for (const char code : {'\x1e', '\x3e', '\x70', '\xd0'}) {
    EXPECT_THAT(ErrorOf(Lzvn(1, std::string("\xe1x") + code + kLzvnEnd) + "bvx$"),
                HasSubstr("an unknown instruction"))
        << static_cast<int>(code);
  }
}

TEST(Lzfse, NothingBeyondTheLimitIsMade) {
  const std::string stream = Stream("runs");
  const size_t exact = RunBytes().size();
  EXPECT_EQ(DecodeLzfse(stream, exact, "s").size(), exact);
  EXPECT_THAT(testing::MessageOf<Error>([&] { DecodeLzfse(stream, exact - 1, "s"); }),
              HasSubstr("more bytes than it may stand for"));
}

// Every byte of a small stream, changed in several ways, gives bytes or an Error; with sanitizers
// nothing else happens either.
TEST(Lzfse, ChangedBytesNeverLeadOutOfTheStream) {
  for (const char* name : {"depth", "depth_plain_header", "text", "runs"}) {
    const std::string stream = Stream(name);
    int rejected = 0, all = 0;
    for (size_t i = 0; i < stream.size(); ++i) {
      for (const int change : {1, 0x80, 0xff}) {
        std::string changed = stream;
        changed[i] = static_cast<char>(changed[i] ^ change);
        ++all;
        try {
          EXPECT_LE(Decoded(changed).size(), kMaxBytes);
        } catch (const Error&) {
          ++rejected;
        }
      }
    }
    EXPECT_GT(rejected, 0) << name << ", of " << all;
  }
}

TEST(Lzfse, DISABLED_WritesWhatTheStreamsStandFor) {
  for (const Vector& vector : Vectors()) {
    WriteFileAtomically(std::string(vector.name) + ".raw", vector.bytes);
  }
}

}  // namespace
}  // namespace dtr::io
