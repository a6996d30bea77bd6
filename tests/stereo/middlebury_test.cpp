// Real rectified pairs with measured disparity (Scharstein and Szeliski, IJCV 2002 and CVPR 2003).
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "dtr/io/image_io.h"
#include "stereo/sgbm/sgbm_engine.h"
#include "tests/support/test_data.h"

namespace dtr::stereo {
namespace {

/// Neither focal length nor baseline is published; any will do, depth is evaluated as disparity.
constexpr double kFocal = 500, kBaseline = 1;

struct Pair {
  const char* name;
  double grey_per_px;     ///< coding of the truth
  double largest_px;      ///< largest true disparity
  double max_bad_share;   ///< pixels with truth whose depth is off by more than 2 px, of those kept
  double min_kept_share;  ///< pixels with truth that get depth
};

/// Bounds: measured 2026-11 plus a third for other versions of OpenCV. Occluded pixels have truth
/// too; they should be holes, so not all of the truth can be kept.
class Middlebury : public ::testing::TestWithParam<Pair> {};

TEST_P(Middlebury, FewPixelsAreOffByMoreThanTwoPixels) {
  const auto folder = testing::DataFolder() / "stereo_middlebury" / GetParam().name;
  DTR_REQUIRE_DATA(folder);
  const ImageRgb8 left = io::ReadImage(folder / "im2.png");
  const ImageRgb8 right = io::ReadImage(folder / "im6.png");
  const ImageRgb8 truth = io::ReadImage(folder / "disp2.png");
  const PinholeCamera camera(left.width(), left.height(), kFocal, kFocal, 0.5 * left.width(),
                             0.5 * left.height());
  const Pose beside{Eigen::Quaterniond::Identity(), {-kBaseline, 0, 0}};
  const StereoView views[] = {{camera, {}, &left, nullptr}, {camera, beside, &right, nullptr}};
  const int neighbours[] = {1};
  const DepthRange range{kFocal * kBaseline / (GetParam().largest_px + 4), kFocal * kBaseline / 1};
  const DepthEstimate e = SgbmEngine().Estimate(views, 0, neighbours, range, {});

  int known = 0, kept = 0, bad = 0;
  for (int y = 0; y < truth.height(); ++y) {
    for (int x = 0; x < truth.width(); ++x) {
      if (truth(x, y) == 0) continue;
      ++known;
      if (DepthImage::IsHole(e.depth(x, y))) continue;
      ++kept;
      const double disparity = kFocal * kBaseline / e.depth(x, y);
      bad += std::abs(disparity - truth(x, y) / GetParam().grey_per_px) > 2;
    }
  }
  const double bad_share = static_cast<double>(bad) / kept;
  const double kept_share = static_cast<double>(kept) / known;
  RecordProperty("bad_share", std::to_string(bad_share));
  std::printf("%s: %.2f %% kept, of these %.2f %% off by more than 2 px\n", GetParam().name,
              100 * kept_share, 100 * bad_share);
  EXPECT_LT(bad_share, GetParam().max_bad_share);
  EXPECT_GT(kept_share, GetParam().min_kept_share);
}

INSTANTIATE_TEST_SUITE_P(Pairs, Middlebury,
                         ::testing::Values(Pair{"teddy", 4, 56, 0.09, 0.85},
                                           Pair{"venus", 8, 20, 0.022, 0.9},
                                           Pair{"tsukuba", 16, 16, 0.055, 0.9}),
                         [](const auto& pair_info) { return std::string(pair_info.param.name); });

}  // namespace
}  // namespace dtr::stereo
