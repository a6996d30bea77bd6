// Depth from photos as files come: grey, of 16 bits, with an alpha channel.
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include "dtr/io/image_io.h"
#include "datasets/exact/stereo_quality.h"
#include "tests/support/test_data.h"

namespace dtr::stereo {
namespace {

namespace fs = std::filesystem;
using testing::Facing;
using testing::Shot;

/// What the rig photographs is grey: one channel says it all.
void WriteGrey(const fs::path& file, const ImageRgb8& image) {
  Mask grey(image.width(), image.height());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) grey(x, y) = image(x, y, 1);
  }
  io::WriteMask(file, grey);
}

void WriteSixteenBits(const fs::path& file, const ImageRgb8& image) {
  std::vector<std::uint16_t> values;
  for (const std::uint8_t value : image.data()) {
    values.push_back(static_cast<std::uint16_t>(257 * value));
  }
  const auto out = OIIO::ImageOutput::create(file.string());
  const OIIO::ImageSpec spec(image.width(), image.height(), 3, OIIO::TypeDesc::UINT16);
  ASSERT_TRUE(out && out->open(file.string(), spec));
  ASSERT_TRUE(out->write_image(OIIO::TypeDesc::UINT16, values.data()) && out->close());
}

/// Alpha that would change every grey value if it were multiplied in.
void WriteAlpha(const fs::path& file, const ImageRgb8& image) {
  io::WriteImageWithAlpha(file, image, Mask(image.width(), image.height(), 1, 100));
}

TEST(PhotoKinds, GreySixteenBitAndAlphaPhotosGiveTheDepthOfEightBitColour) {
  const PinholeCamera camera(96, 72, 84, 84, 48, 36);
  std::vector<Shot> shots =
      testing::ShotsOf(testing::Slanted(), camera, {Facing({0, 0, 0}), Facing({0.4, 0, 0})});
  const auto estimate = [&] {
    return testing::EstimateFirstBy("patchmatch", testing::ViewsOf(shots), {2.5, 8}, 2);
  };
  const DepthEstimate expected = estimate();
  const std::vector<Shot> originals = shots;
  const dtr::testing::TemporaryFolder folder;
  for (const auto& write : {WriteGrey, WriteSixteenBits, WriteAlpha}) {
    for (size_t i = 0; i < shots.size(); ++i) {
      const fs::path file = folder / (std::to_string(i) + ".png");
      write(file, originals[i].image);
      shots[i].image = io::ReadImage(file);
    }
    const DepthEstimate found = estimate();
    EXPECT_EQ(found.depth, expected.depth);
    EXPECT_EQ(found.inverse_depth_sigma, expected.inverse_depth_sigma);
  }
}

}  // namespace
}  // namespace dtr::stereo
