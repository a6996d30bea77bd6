// PNG files of sets are read and written without OpenImageIO, and nobody can tell.
#include "dtr/io/plain_png.h"

#include <OpenImageIO/oiioversion.h>
#include <gtest/gtest.h>

#include <numeric>
#include <random>
#include <vector>

#include "dtr/base/files.h"
#include "dtr/base/temporary_folder.h"
#include "dtr/io/rendered_mark.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;

struct Kind {
  ImageToWrite image;
  std::vector<std::uint8_t> pixels;
};

// Smooth, with noise in the low bits, so that every filter of PNG has its rows.
Kind MakeKind(int channels, Sample sample, bool marked) {
  Kind kind{{37, 23, channels, sample}, {}};
  if (marked) kind.image.attributes.emplace_back("Software", kRenderedSoftware);
  if (channels == 4) kind.image.attributes.emplace_back("oiio:UnassociatedAlpha", 1);
  std::mt19937 random(static_cast<unsigned>(channels));
  const int bytes = channels * (sample == Sample::kUint16 ? 2 : 1);
  for (int y = 0; y < kind.image.height; ++y) {
    for (int x = 0; x < kind.image.width * bytes; ++x) {
      const auto noise = static_cast<int>(random() % 4);
      kind.pixels.push_back(static_cast<std::uint8_t>(5 * y + 3 * (x / bytes) + noise));
    }
  }
  return kind;
}

std::vector<Kind> AllKinds() {
  std::vector<Kind> kinds;
  for (const int channels : {1, 3, 4}) {
    for (const Sample sample : {Sample::kUint8, Sample::kUint16}) {
      for (const bool marked : {false, true}) kinds.push_back(MakeKind(channels, sample, marked));
    }
  }
  return kinds;
}

std::string Encoded(const Kind& kind) {
  return EncodePlainPng(kind.image, kind.image.sample, kind.pixels.data()).value();
}

/// What reading a file gives.
struct Outcome {
  bool read = false;
  std::vector<std::uint8_t> pixels;
  std::string complaint;
  bool operator==(const Outcome&) const = default;
};

Outcome ReadAll(OpenedImage& in) {
  const ImageFacts& facts = in.facts();
  Outcome outcome;
  outcome.pixels.resize(facts.pixel_bytes * static_cast<size_t>(facts.width) *
                        static_cast<size_t>(facts.height));
  outcome.read = in.Read(0, facts.channels, facts.sample, outcome.pixels.data(), outcome.complaint);
  if (!outcome.read) outcome.pixels.clear();  // rows before the damage
  return outcome;
}

#if OIIO_VERSION < OIIO_MAKE_VERSION(2, 5, 0)  // others may choose other chunks
TEST(PlainPng, FilesAreTheBytesThatOpenImageIoWrites) {
  for (const Kind& kind : AllKinds()) {
    std::string complaint;
    const auto expected =
        Codecs().Encode(".png", kind.image, kind.image.sample, kind.pixels.data(), complaint);
    EXPECT_TRUE(Encoded(kind) == expected) << kind.image.channels << ' ' << complaint;
  }
}
#endif

TEST(PlainPng, FactsAndPixelsAreThoseOfOpenImageIo) {
  const TemporaryFolder folder;
  const fs::path file = folder / "a.png";
  for (const Kind& kind : AllKinds()) {
    WriteFileAtomically(file, Encoded(kind));
    const auto plain = OpenPlainPng(file);
    if (kind.image.channels == 4) {
      EXPECT_FALSE(plain);
      continue;
    }
    ASSERT_TRUE(plain);
    std::string complaint;
    const auto other = Codecs().Open(file.string(), {}, complaint);
    ASSERT_TRUE(other) << complaint;
    EXPECT_EQ(plain->format(), other->format());
    const ImageFacts &a = plain->facts(), &b = other->facts();
    EXPECT_EQ(a.channel_names, b.channel_names);
    EXPECT_EQ(std::tuple(a.x, a.y, a.width, a.height, a.depth, a.channels, a.alpha_channel),
              std::tuple(b.x, b.y, b.width, b.height, b.depth, b.channels, b.alpha_channel));
    EXPECT_EQ(std::tuple(a.full_x, a.full_y, a.full_width, a.full_height, a.tile_width),
              std::tuple(b.full_x, b.full_y, b.full_width, b.full_height, b.tile_width));
    EXPECT_EQ(std::tuple(a.sample, a.sample_name, a.sample_bytes, a.pixel_bytes),
              std::tuple(b.sample, b.sample_name, b.sample_bytes, b.pixel_bytes));
    const Outcome outcome = ReadAll(*plain);
    EXPECT_EQ(outcome, ReadAll(*other));
    EXPECT_EQ(outcome.pixels, kind.pixels);
    // A channel alone, and numbers of another kind.
    const auto count = static_cast<size_t>(a.width) * static_cast<size_t>(a.height);
    std::vector<float> ours(count), theirs(count);
    EXPECT_TRUE(plain->Read(0, 1, Sample::kFloat, ours.data(), complaint)) << complaint;
    EXPECT_TRUE(other->Read(0, 1, Sample::kFloat, theirs.data(), complaint)) << complaint;
    EXPECT_EQ(ours, theirs);
  }
}

TEST(PlainPng, DamageAnywhereHasOpenImageIosOutcome) {
  const TemporaryFolder folder;
  const fs::path file = folder / "a.png";
  const std::string whole = Encoded(MakeKind(3, Sample::kUint8, true));
  int plain_files = 0, damaged = 0;
  for (size_t at = 0; at < whole.size(); at += at < 150 || at + 40 > whole.size() ? 1 : 7) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x10);
    WriteFileAtomically(file, bytes);
    const auto plain = OpenPlainPng(file);
    if (!plain) continue;
    ++plain_files;
    std::string complaint;
    const auto other = Codecs().Open(file.string(), {}, complaint);
    ASSERT_TRUE(other) << "byte " << at << ": " << complaint;
    const Outcome outcome = ReadAll(*plain);
    EXPECT_TRUE(outcome == ReadAll(*other)) << "byte " << at;
    damaged += !outcome.read || !outcome.complaint.empty();
  }
  EXPECT_GT(plain_files, 100);
  EXPECT_GT(damaged, 100);
}

TEST(PlainPng, FilesThatStateMoreAreOpenImageIos) {
  const TemporaryFolder folder;
  Kind kind = MakeKind(3, Sample::kUint8, false);
  kind.image.attributes.emplace_back("Make", "Canon");
  EXPECT_FALSE(EncodePlainPng(kind.image, kind.image.sample, kind.pixels.data()));
  std::string complaint;
  const auto bytes =
      Codecs().Encode(".png", kind.image, kind.image.sample, kind.pixels.data(), complaint);
  ASSERT_TRUE(bytes) << complaint;
  WriteFileAtomically(folder / "a.png", *bytes);
  EXPECT_FALSE(OpenPlainPng(folder / "a.png"));
}

}  // namespace
}  // namespace dtr::io
