#include "datasets/render_truth.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "datasets/layout.h"
#include "dtr/base/error.h"
#include "dtr/base/random.h"
#include "tests/support/on_threads.h"

namespace dtr::datasets {
namespace {

using Eigen::Vector3d;

PhotoOptions Quick() {
  PhotoOptions options;
  options.supersampling = 1;
  return options;
}

TEST(RenderTruth, DepthCarriedToANeighbourAgreesWithItsDepth) {
  // Float rounding of the stored depths is 6e-8; interpolating 1/z on planes adds nothing to it.
  constexpr double kMedianRelative = 1e-6;
  constexpr double kSameSurface = 0.01;  // relative: beyond, something else is seen
  const Scene scene = MakeScene("courtyard", 1);
  const PinholeCamera camera = MakeCamera(240, 160);
  const std::vector<Pose> poses = MakeLayout(scene, "arc", 16);
  const Pose b_from_a = poses[8] * poses[7].Inverse();
  const DepthImage a = RenderDepth(scene, camera, poses[7]);
  const DepthImage b = RenderDepth(scene, camera, poses[8]);
  std::vector<double> errors;
  for (int y = 0; y < a.height(); ++y) {
    for (int x = 0; x < a.width(); ++x) {
      const Vector3d p =
          b_from_a * camera.CamFromPixel({x + 0.5, y + 0.5}, a(x, y), DepthKind::kPlaneZ);
      const auto pixel = camera.PixelFromCam(p);
      if (!pixel) continue;
      const double u = pixel->x() - 0.5, v = pixel->y() - 0.5;
      const int i = static_cast<int>(std::floor(u)), j = static_cast<int>(std::floor(v));
      if (i < 0 || j < 0 || i + 1 >= b.width() || j + 1 >= b.height()) continue;
      const double inverse = (1 - (v - j)) * ((1 - (u - i)) / b(i, j) + (u - i) / b(i + 1, j)) +
                             (v - j) * ((1 - (u - i)) / b(i, j + 1) + (u - i) / b(i + 1, j + 1));
      const double error = std::abs(inverse * p.z() - 1);
      if (error < kSameSurface) errors.push_back(error);
    }
  }
  ASSERT_GT(errors.size(), 20000u);
  std::nth_element(errors.begin(), errors.begin() + static_cast<long>(errors.size() / 2),
                   errors.end());
  EXPECT_LT(errors[errors.size() / 2], kMedianRelative);
}

TEST(RenderTruth, PicturesDoNotDependOnTheNumberOfThreads) {
  const Scene scene = MakeScene("courtyard", 1);
  const PinholeCamera camera = MakeCamera(90, 60);
  const std::vector<Pose> poses = MakeLayout(scene, "arc", 4);
  PhotoOptions options = Quick();
  options.noise_sigma = 3;
  options.lens = {-0.1, 0.02};
  const auto photo = [&] { return RenderPhoto(scene, camera, poses[1], options); };
  const auto depth = [&] { return RenderDepth(scene, camera, poses[1]); };
  const auto visible = [&] { return VisibilityMask(scene, camera, poses[1], poses, 2); };
  EXPECT_EQ(OnThreads(1, photo), OnThreads(2, photo));
  EXPECT_EQ(OnThreads(1, depth), OnThreads(2, depth));
  EXPECT_EQ(OnThreads(1, visible), OnThreads(2, visible));
}

TEST(RenderTruth, NoiseHasTheAskedSigmaAndNoBias) {
  const Scene scene = MakeScene("plane", 1);
  const PinholeCamera camera = MakeCamera(240, 160);
  const Pose pose = MakeLayout(scene, "arc", 2)[0];
  PhotoOptions noisy = Quick();
  noisy.noise_sigma = 5;
  noisy.seed = 7;
  const ImageRgb8 clean = RenderPhoto(scene, camera, pose, Quick());
  const ImageRgb8 photo = RenderPhoto(scene, camera, pose, noisy);
  double sum = 0, sum2 = 0;
  int count = 0;
  for (size_t i = 0; i < clean.data().size(); ++i) {
    if (clean.data()[i] < 40 || clean.data()[i] > 215) continue;  // clipping would cut the tails
    const double difference = static_cast<double>(photo.data()[i]) - clean.data()[i];
    sum += difference;
    sum2 += difference * difference;
    ++count;
  }
  ASSERT_GT(count, 50000);
  const double mean = sum / count, sigma = std::sqrt(sum2 / count - mean * mean);
  // Both photos are rounded to 8 bits: variance 1/12 each. Five standard errors otherwise.
  EXPECT_NEAR(mean, 0, 5 * 5 / std::sqrt(count));
  EXPECT_NEAR(sigma, std::sqrt(25 + 2.0 / 12), 5 * 5 / std::sqrt(2.0 * count));
  noisy.seed = 8;
  EXPECT_NE(photo, RenderPhoto(scene, camera, pose, noisy));
}

TEST(RenderTruth, GainMultipliesLinearLight) {
  const Scene scene = MakeScene("courtyard", 1);
  const PinholeCamera camera = MakeCamera(120, 80);
  const Pose pose = MakeLayout(scene, "arc", 4)[1];
  PhotoOptions darker = Quick();
  darker.gain = 0.5;
  const ImageRgb8 full = RenderPhoto(scene, camera, pose, Quick());
  const ImageRgb8 half = RenderPhoto(scene, camera, pose, darker);
  const auto linear = [](int level) {
    const double v = level / 255.0;
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  };
  for (size_t i = 0; i < full.data().size(); ++i) {
    if (full.data()[i] > 250) continue;  // may be clipped
    // Each level is rounded by half; the slope of the transfer function turns that into light.
    const double slack = (linear(full.data()[i] + 1) - linear(full.data()[i])) / 2 + 1e-3;
    ASSERT_NEAR(linear(half.data()[i]), 0.5 * linear(full.data()[i]), slack);
  }
}

TEST(RenderTruth, DistortedPhotoShowsTheIdealOnesPixelsWhereTheLensPutsThem) {
  const Scene scene = MakeScene("plane", 1);
  const PinholeCamera camera = MakeCamera(240, 160);
  const Pose pose = MakeLayout(scene, "arc", 2)[0];
  PhotoOptions options = Quick();
  options.supersampling = 4;
  const ImageRgb8 ideal = RenderPhoto(scene, camera, pose, options);
  options.lens = {-0.15, 0.03};
  const ImageRgb8 distorted = RenderPhoto(scene, camera, pose, options);
  double error = 0, error_if_ignored = 0;
  int count = 0;
  for (int y = 8; y < 152; ++y) {
    for (int x = 8; x < 232; ++x) {
      const Vector3d ray = camera.RayFromPixel({x + 0.5, y + 0.5});
      const double r2 = ray.head<2>().squaredNorm();
      const double factor = 1 + r2 * (options.lens.k1 + options.lens.k2 * r2);
      const double u = camera.fx_px() * factor * ray.x() + camera.cx_px() - 0.5;
      const double v = camera.fy_px() * factor * ray.y() + camera.cy_px() - 0.5;
      const int i = static_cast<int>(std::floor(u)), j = static_cast<int>(std::floor(v));
      if (!distorted.Contains(i, j) || !distorted.Contains(i + 1, j + 1)) continue;
      const double value =
          (1 - (v - j)) * ((1 - (u - i)) * distorted(i, j, 1) + (u - i) * distorted(i + 1, j, 1)) +
          (v - j) * ((1 - (u - i)) * distorted(i, j + 1, 1) + (u - i) * distorted(i + 1, j + 1, 1));
      error += std::abs(value - ideal(x, y, 1));
      error_if_ignored += std::abs(static_cast<double>(distorted(x, y, 1)) - ideal(x, y, 1));
      ++count;
    }
  }
  ASSERT_GT(count, 25000);
  EXPECT_LT(error / count, 0.25 * error_if_ignored / count);
}

TEST(RenderTruth, LensThatFoldsTheImageOverIsRejected) {
  const Scene scene = MakeScene("plane", 1);
  const PinholeCamera camera = MakeCamera(24, 16);
  PhotoOptions options = Quick();
  options.lens = {-0.9, 0};
  EXPECT_THROW(RenderPhoto(scene, camera, Pose{}, options), UsageError);
  options.lens = {std::nan(""), 0};
  EXPECT_THROW(RenderPhoto(scene, camera, Pose{}, options), UsageError);
  options = Quick();
  options.noise_sigma = -1;
  EXPECT_THROW(RenderPhoto(scene, camera, Pose{}, options), UsageError);
  options = Quick();
  options.gain = 0;
  EXPECT_THROW(RenderPhoto(scene, camera, Pose{}, options), UsageError);
  options = Quick();
  options.supersampling = 0;
  EXPECT_THROW(RenderPhoto(scene, camera, Pose{}, options), UsageError);
}

TEST(RenderTruth, VisibilityFollowsFromDepthMapsAwayFromEdges) {
  // An independent way to the same mask: compare z with the neighbours' depth maps.
  const Scene scene = MakeScene("courtyard", 1);
  const PinholeCamera camera = MakeCamera(180, 120);
  const std::vector<Pose> all = MakeLayout(scene, "arc", 8);
  const std::vector<Pose> others = {all[2], all[4], all[6]};
  const Mask mask = VisibilityMask(scene, camera, all[3], others, 2);
  const DepthImage depth = RenderDepth(scene, camera, all[3]);
  std::vector<DepthImage> theirs;
  for (const Pose& other : others) theirs.push_back(RenderDepth(scene, camera, other));
  int agree = 0, unseen = 0;
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 180; ++x) {
      const Vector3d p = all[3].Inverse() *
                         camera.CamFromPixel({x + 0.5, y + 0.5}, depth(x, y), DepthKind::kPlaneZ);
      int seen = 0;
      for (size_t k = 0; k < others.size(); ++k) {
        const Vector3d q = others[k] * p;
        const auto pixel = camera.PixelFromCam(q);
        if (!pixel || !camera.Contains(*pixel)) continue;
        const float z = theirs[k](static_cast<int>(pixel->x()), static_cast<int>(pixel->y()));
        if (std::abs(z / q.z() - 1) < 0.03) ++seen;
      }
      agree += (seen >= 2) == (mask(x, y) == 255) ? 1 : 0;
      unseen += mask(x, y) == 0 ? 1 : 0;
    }
  }
  EXPECT_GT(agree, 0.96 * 180 * 120);
  EXPECT_GT(unseen, 500);
}

TEST(RenderTruth, TextureMaskFollowsTheStandardDeviation) {
  ImageRgb8 photo(40, 30, 3, 100);
  for (int y = 0; y < 30; ++y) {
    for (int x = 20; x < 40; ++x) {
      // A checkerboard of +-3 on the upper half, of +-5 below: deviations 3 and 5 levels.
      const int amplitude = y < 15 ? 3 : 5;
      for (int c = 0; c < 3; ++c) {
        photo(x, y, c) = static_cast<std::uint8_t>(100 + ((x + y) % 2 ? amplitude : -amplitude));
      }
    }
  }
  const Mask mask = TextureMask(photo);
  EXPECT_EQ(mask(5, 5), 0);
  EXPECT_EQ(mask(30, 5), 0);
  EXPECT_EQ(mask(30, 25), 255);
  EXPECT_EQ(mask(39, 29), 255);
  EXPECT_EQ(mask(0, 0), 0);
}

TEST(RenderTruth, TexturelessWallIsTexturelessAndTheRestIsNot) {
  const Scene scene = MakeScene("courtyard", 1);
  const PinholeCamera camera = MakeCamera(240, 160);
  PhotoOptions options;
  const Mask mask =
      TextureMask(RenderPhoto(scene, camera, MakeLayout(scene, "arc", 16)[1], options));
  const double textured =
      static_cast<double>(std::count(mask.data().begin(), mask.data().end(), 255)) /
      static_cast<double>(mask.data().size());
  EXPECT_GT(textured, 0.75);
  EXPECT_LT(textured, 0.98);
}

TEST(RenderTruth, SetHoldsConsistentViews) {
  const Scene scene = MakeScene("stairs", 1);
  const std::vector<Pose> poses = MakeLayout(scene, "arc", 5);
  PhotoOptions options = Quick();
  options.noise_sigma = 2;
  const DtrSet set = RenderTruthSet(scene, MakeCamera(60, 40), poses, options);
  ASSERT_EQ(set.frames.size(), 1u);
  ASSERT_EQ(set.frames[0].views.size(), 5u);
  for (size_t i = 0; i < 5; ++i) {
    const View& view = set.frames[0].views[i];
    EXPECT_EQ(view.cam_from_world.translation, poses[i].translation);
    EXPECT_GT(view.near_z, 0);
    EXPECT_GT(view.far_z, view.near_z);
    EXPECT_GT(view.reference_baseline, 0);
    EXPECT_EQ(view.depth, RenderDepth(scene, view.camera, poses[i]));
  }
  EXPECT_NE(set.frames[0].views[0].image, set.frames[0].views[1].image);
  EXPECT_EQ(set.frames[0].views[3].name, "0003.jpg");
}

}  // namespace
}  // namespace dtr::datasets
