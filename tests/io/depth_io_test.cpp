#include "dtr/io/depth_io.h"

#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/random.h"
#include "tests/support/message_of.h"
#include "tests/support/test_data.h"
#include "tests/support/truncation.h"

namespace dtr::io {
namespace {

using testing::TemporaryFolder;

// Depths over three decades, a tenth of them holes, the ends of the range among them.
DepthImage RandomDepth(Random& random, int width_px, int height_px, float near_z, float far_z) {
  DepthImage depth(width_px, height_px);
  for (float& z : depth.grid().data()) {
    const double inverse = random.Uniform(1.0 / far_z, 1.0 / near_z);
    z = random.Uniform() < 0.1 ? 0 : std::clamp(static_cast<float>(1 / inverse), near_z, far_z);
  }
  depth(0, 0) = near_z;
  depth(1, 0) = far_z;
  return depth;
}

TEST(Png16Inverse, HandWorkedCodes) {
  DepthImage depth(3, 1);
  depth(0, 0) = 1;      // near
  depth(1, 0) = 2;      // far
  depth(2, 0) = 1.25f;  // 1/z = 0.8: share 0.6 of [0.5, 1]
  const auto codes = EncodeInverseDepth(depth, 1, 2);
  EXPECT_EQ(codes(0, 0), 65535);
  EXPECT_EQ(codes(1, 0), 1);
  EXPECT_EQ(codes(2, 0), 1 + 39320);  // round(0.6 * 65534) = 39320
}

TEST(Png16Inverse, ErrorIsAtMostHalfAStepAndHolesAndEndsAreExact) {
  Random random(1);
  // Rounding the decoded depth to float adds at most 2^-24 of 1/z.
  constexpr double kFloatRounding = 0x1.0p-24;
  for (int round = 0; round < 20; ++round) {
    const auto near_z = static_cast<float>(std::exp(random.Uniform(-7, 7)));
    const auto far_z = static_cast<float>(near_z * std::exp(random.Uniform(0.01, 5)));
    const DepthImage depth = RandomDepth(random, 40, 30, near_z, far_z);
    const DepthImage back =
        DecodeInverseDepth(EncodeInverseDepth(depth, near_z, far_z), near_z, far_z);
    const double half_step = 0.5 * (1.0 / near_z - 1.0 / far_z) / 65534;
    for (size_t i = 0; i < depth.grid().data().size(); ++i) {
      const float z = depth.grid().data()[i], stored = back.grid().data()[i];
      ASSERT_EQ(z == 0, stored == 0);
      if (z == 0) continue;
      ASSERT_LE(std::abs(1.0 / stored - 1.0 / z),
                half_step * (1 + 1e-9) + 1.01 * kFloatRounding / stored);
    }
    EXPECT_EQ(back(0, 0), near_z);
    EXPECT_EQ(back(1, 0), far_z);
  }
}

TEST(Png16Inverse, IsMonotoneAndStableOverAllCodes) {
  Grid<std::uint16_t> codes(256, 256);
  for (size_t i = 0; i < codes.data().size(); ++i) {
    codes.data()[i] = static_cast<std::uint16_t>(i);
  }
  // A range ratio of 30: neighbouring codes differ by more than float's rounding at both ends.
  const DepthImage depth = DecodeInverseDepth(codes, 0.3, 9.0);
  const auto& z = depth.grid().data();
  EXPECT_EQ(z[0], 0);
  for (size_t i = 2; i < z.size(); ++i) ASSERT_LT(z[i], z[i - 1]) << i;
  EXPECT_EQ(EncodeInverseDepth(depth, 0.3, 9.0), codes);
}

TEST(Png16Inverse, RejectsDepthOutsideTheRangeAndBadRanges) {
  DepthImage depth(2, 2);
  depth(1, 1) = 3;
  EXPECT_THROW(EncodeInverseDepth(depth, 1, 2), Error);
  EXPECT_THROW(EncodeInverseDepth(depth, 4, 5), Error);
  for (const auto& [near_z, far_z] :
       {std::pair(0.0, 5.0), {-1.0, 5.0}, {3.0, 3.0}, {5.0, 1.0}, {1.0, HUGE_VAL}, {NAN, 5.0}}) {
    EXPECT_THROW(EncodeInverseDepth(depth, near_z, far_z), Error);
    EXPECT_THROW(DecodeInverseDepth(Grid<std::uint16_t>(1, 1), near_z, far_z), Error);
  }
  for (const float bad : {-1.0f, HUGE_VALF, std::numeric_limits<float>::quiet_NaN()}) {
    depth(1, 1) = bad;
    EXPECT_THROW(EncodeInverseDepth(depth, 1, 2), Error);
  }
  EXPECT_THROW(EncodeInverseDepth(DepthImage(2, 2, DepthKind::kRayDistance), 1, 2), Error);
}

TEST(Png16Millimetre, RoundsToAMillimetreAndRejectsWhatDoesNotFit) {
  DepthImage depth(3, 1);
  depth(0, 0) = 65.535f;
  depth(1, 0) = 1.2344f;
  EXPECT_EQ(EncodePng16Millimetre(depth).data(), (std::vector<std::uint16_t>{65535, 1234, 0}));
  EXPECT_EQ(DecodePng16Millimetre(EncodePng16Millimetre(depth))(1, 0), 1.234f);
  depth(2, 0) = 65.536f;
  EXPECT_THROW(EncodePng16Millimetre(depth), Error);
  depth(2, 0) = 0.0004f;  // would turn into a hole
  EXPECT_THROW(EncodePng16Millimetre(depth), Error);
}

// An EXR with these channels, channel k 10 + k throughout; `x` columns of the image before it.
void WriteLayers(const std::filesystem::path& file, const std::vector<std::string>& channels,
                 int x = 0) {
  OIIO::ImageSpec spec(4, 3, static_cast<int>(channels.size()), OIIO::TypeDesc::FLOAT);
  spec.channelnames = channels;
  spec.x = x;
  spec.full_width = 4 + x;
  std::vector<float> pixels;
  for (int i = 0; i < 12; ++i) {
    for (size_t k = 0; k < channels.size(); ++k) pixels.push_back(10 + static_cast<float>(k));
  }
  const auto out = OIIO::ImageOutput::create(file.string());
  ASSERT_TRUE(out && out->open(file.string(), spec));
  ASSERT_TRUE(out->write_image(OIIO::TypeDesc::FLOAT, pixels.data()));
  ASSERT_TRUE(out->close());
}

TEST(ReadFloatGrid, DepthOfALayerIsFoundByItsName) {
  const TemporaryFolder folder;
  const auto value = [&](const std::vector<std::string>& channels) {
    WriteLayers(folder / "layers.exr", channels);
    return ReadFloatGrid(folder / "layers.exr")(0, 0);
  };
  EXPECT_EQ(value({"R", "G", "B", "Z"}), 13);
  EXPECT_EQ(value({"R", "G", "B", "A"}), 10);
  // As Blender writes them; a normal has a Z of its own.
  EXPECT_EQ(value({"View.Combined.R", "View.Combined.G", "View.Combined.B", "View.Depth.Z",
                   "View.Normal.X", "View.Normal.Y", "View.Normal.Z"}),
            13);
  EXPECT_EQ(value({"a.R", "depth.V"}), 11);
  EXPECT_EQ(value({"a.R", "b.depth"}), 11);
  for (const std::vector<std::string>& channels :
       {std::vector<std::string>{"a.Depth.Z", "b.Depth.Z"}, {"View.R", "View.G", "View.B"}}) {
    WriteLayers(folder / "other.exr", channels);
    EXPECT_THAT(testing::MessageOf<Error>([&] { ReadFloatGrid(folder / "other.exr"); }),
                ::testing::HasSubstr("expected one channel of depth, called Z, Y, depth or "
                                     "LAYER.Depth.Z, found " +
                                     channels.front()));
  }
}

TEST(ReadFloatGrid, APartOfAPictureIsRejected) {
  const TemporaryFolder folder;
  WriteLayers(folder / "part.exr", {"Z"}, 4);
  EXPECT_THAT(
      testing::MessageOf<Error>([&] { ReadFloatGrid(folder / "part.exr"); }),
      ::testing::HasSubstr("expected pixels for the whole image of 8x3, found 4x3 of them from "
                           "(4, 0) on"));
}

TEST(ExrHalf, RoundsLikeOpenExrAndRejectsWhatDoesNotFit) {
  const TemporaryFolder folder;
  Random random(2);
  DepthImage depth = RandomDepth(random, 33, 17, 0.01f, 60000.0f);
  const DepthFormat format{DepthCoding::kExrHalf, 0.005, 65504, LengthUnit::kUnknown};
  const DepthImage rounded = RoundToCoding(depth, format);
  WriteExr(folder / "half.exr", depth.grid(), true);  // OpenEXR rounds here
  EXPECT_EQ(ReadFloatGrid(folder / "half.exr"), rounded.grid());
  for (const float bad : {65505.0f, 1e-5f}) {
    depth(2, 2) = bad;
    EXPECT_THROW(RoundToCoding(depth, format), Error);
  }
  depth(2, 2) = 1e6f;
  EXPECT_THROW(WriteExr(folder / "half.exr", depth.grid(), true), Error);
}

class DepthFiles : public ::testing::TestWithParam<DepthCoding> {};

TEST_P(DepthFiles, ReadBackWhatRoundToCodingSaysAndAreTheSameBytesTwice) {
  const TemporaryFolder folder;
  Random random(3);
  const DepthImage depth = RandomDepth(random, 24, 16, 0.5f, 40);
  // A range a little wider than the data, so that rounding stays inside it.
  const DepthFormat format{GetParam(), 0.4, 50, LengthUnit::kMetre};
  const auto file = folder / (std::string("depth") + ExtensionOf(GetParam()));
  WriteDepth(file, depth, format);
  const DepthImage back = ReadDepth(file, format, 24, 16);
  EXPECT_EQ(back, RoundToCoding(depth, format));
  EXPECT_EQ(RoundToCoding(back, format), back);  // rounding twice changes nothing
  const std::string first = ReadFile(file, 1 << 20);
  WriteDepth(file, back, format);
  EXPECT_EQ(ReadFile(file, 1 << 20), first);
  EXPECT_THROW(ReadDepth(file, format, 24, 17), Error);
  EXPECT_THROW(ReadDepth(folder / "absent", format, 24, 16), Error);
}

TEST_P(DepthFiles, EveryTruncatedPrefixIsAnError) {
  const TemporaryFolder folder;
  Random random(4);
  const DepthImage depth = RandomDepth(random, 8, 6, 0.5f, 40);
  const DepthFormat format{GetParam(), 0.4, 50, LengthUnit::kMetre};
  const auto file = folder / (std::string("depth") + ExtensionOf(GetParam()));
  WriteDepth(file, depth, format);
  testing::ExpectEveryPrefixIsAnError(file, 1, [&] { ReadDepth(file, format, 8, 6); });
}

TEST_P(DepthFiles, RejectDepthOutsideTheRange) {
  const TemporaryFolder folder;
  DepthImage depth(4, 4);
  depth(1, 2) = 3;
  const auto file = folder / (std::string("depth") + ExtensionOf(GetParam()));
  EXPECT_THROW(WriteDepth(file, depth, {GetParam(), 4, 5, LengthUnit::kMetre}), Error);
  EXPECT_FALSE(std::filesystem::exists(file));
}

INSTANTIATE_TEST_SUITE_P(AllCodings, DepthFiles,
                         ::testing::Values(DepthCoding::kExrFloat, DepthCoding::kExrHalf,
                                           DepthCoding::kPng16Millimetre,
                                           DepthCoding::kPng16InverseDepth,
                                           DepthCoding::kZstdInverseDepth),
                         [](const auto& coding) {
                           std::string name = NameOf(coding.param);
                           std::erase(name, '-');
                           return name;
                         });

TEST(DepthCoding, MillimetresNeedASetInMetres) {
  const TemporaryFolder folder;
  const DepthFormat format{DepthCoding::kPng16Millimetre, 1, 2, LengthUnit::kArbitrary};
  EXPECT_THROW(WriteDepth(folder / "d.png", DepthImage(2, 2), format), Error);
  EXPECT_EQ(DepthCodingFromName("exr-half"), DepthCoding::kExrHalf);
  EXPECT_THROW(DepthCodingFromName("exr"), UsageError);
}

TEST(RangeOf, CoversTheMapAlsoWhenItIsFlatOrEmpty) {
  DepthImage depth(2, 2);
  EXPECT_EQ(RangeOf(depth).near_z, 1);
  EXPECT_EQ(RangeOf(depth).far_z, 2);
  depth(0, 0) = 7.3f;
  EXPECT_EQ(RangeOf(depth).near_z, 7.3f);
  EXPECT_GT(RangeOf(depth).far_z, 7.3f);
  const auto range = RangeOf(depth);
  const auto codes = EncodeInverseDepth(depth, range.near_z, range.far_z);
  EXPECT_EQ(DecodeInverseDepth(codes, range.near_z, range.far_z), depth);
}

TEST(Sigma, KeepsEightBits) {
  const TemporaryFolder folder;
  Random random(5);
  Grid<float> sigma(30, 20);
  for (float& value : sigma.data()) value = static_cast<float>(std::exp(random.Uniform(-20, 5)));
  sigma(3, 3) = 0;
  WriteSigma(folder / "sigma.exr", sigma);
  const Grid<float> back = ReadSigma(folder / "sigma.exr", 30, 20);
  for (size_t i = 0; i < sigma.data().size(); ++i) {
    ASSERT_LE(std::abs(back.data()[i] - sigma.data()[i]), 0x1.0p-8f * sigma.data()[i]);
  }
  EXPECT_THROW(ReadSigma(folder / "sigma.exr", 30, 21), Error);
  testing::ExpectEveryPrefixIsAnError(folder / "sigma.exr", 7,
                                      [&] { ReadSigma(folder / "sigma.exr", 30, 20); });
  sigma(1, 1) = -1;
  EXPECT_THROW(WriteSigma(folder / "sigma.exr", sigma), Error);
  sigma(1, 1) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(WriteSigma(folder / "sigma.exr", sigma), Error);
}

TEST(ReadFloatGrid, RejectsIntegersAndReadPng16RejectsBytes) {
  const TemporaryFolder folder;
  WritePng16(folder / "a.png", Grid<std::uint16_t>(3, 2, 1, 500));
  EXPECT_EQ(ReadPng16(folder / "a.png")(2, 1), 500);
  EXPECT_THROW(ReadFloatGrid(folder / "a.png"), Error);
  EXPECT_THROW(ReadPng16(folder / "a.png", 5), Error);  // 6 pixels
  WriteMask(folder / "b.png", Mask(3, 2));
  EXPECT_THROW(ReadPng16(folder / "b.png"), Error);
}

}  // namespace
}  // namespace dtr::io
