#include "calib/bundle/adjust.h"

#include <gtest/gtest.h>

#include "calib/bundle/normalised.h"
#include "dtr/base/error.h"
#include "tests/calib/bundle/synthetic_bundle.h"

namespace dtr::calib {
namespace {

using testing::ArcPose;
using testing::LargestDifference;
using testing::LookAt;
using testing::MakeBundle;
using testing::Moved;
using testing::Perturbed;
using testing::Projections;
using testing::SceneSpec;

constexpr double kSamePx = 1e-6;  // the bound of issue "stiff cases"; seen: below 1e-8

AdjustOptions With(LensFreedom lens) {
  AdjustOptions options;
  options.lens = lens;
  return options;
}

// Largest difference between the cost's derivatives and central differences, relative to the
// largest derivative of its block.
double WorstDerivativeError(const ceres::CostFunction& cost,
                            std::vector<std::vector<double>> blocks) {
  const auto at = [&](double* residual, double** jacobians) {
    std::vector<const double*> pointers;
    for (const auto& block : blocks) pointers.push_back(block.data());
    EXPECT_TRUE(cost.Evaluate(pointers.data(), residual, jacobians));
  };
  std::vector<std::vector<double>> analytic;
  for (const auto& block : blocks) analytic.emplace_back(2 * block.size());
  std::vector<double*> jacobians;
  for (auto& block : analytic) jacobians.push_back(block.data());
  double residual[2];
  at(residual, jacobians.data());
  constexpr double kStep = 1e-6;  // cube root of rounding, for unknowns of order one
  double worst = 0;
  for (size_t b = 0; b < blocks.size(); ++b) {
    const auto [low, high] = std::minmax_element(analytic[b].begin(), analytic[b].end());
    const double scale = std::max(std::abs(*low), std::abs(*high));
    for (size_t k = 0; k < blocks[b].size(); ++k) {
      const double here = blocks[b][k];
      double ahead[2], behind[2];
      blocks[b][k] = here + kStep;
      at(ahead, nullptr);
      blocks[b][k] = here - kStep;
      at(behind, nullptr);
      blocks[b][k] = here;
      for (size_t row = 0; row < 2; ++row) {
        const double numeric = (ahead[row] - behind[row]) / (2 * kStep);
        worst =
            std::max(worst, std::abs(numeric - analytic[b][row * blocks[b].size() + k]) / scale);
      }
    }
  }
  return worst;
}

TEST(ObservationCost, DerivativesAgreeWithDifferencesForEveryLens) {
  const std::pair<CameraModel, std::vector<double>> lenses[] = {
      {CameraModel::kSimplePinhole, {900, 500, 400}},
      {CameraModel::kPinhole, {900, 905, 500, 400}},
      {CameraModel::kSimpleRadial, {900, 500, 400, 0.05}},
      {CameraModel::kRadial, {900, 500, 400, 0.05, -0.01}},
      {CameraModel::kOpenCv, {900, 905, 500, 400, 0.05, -0.01, 1e-3, -2e-3}},
      {CameraModel::kOpenCvFisheye, {500, 505, 500, 400, 0.02, -0.01, 1e-3, -2e-4}},
      {CameraModel::kFullOpenCv,
       {900, 905, 500, 400, .05, -.01, 1e-3, -2e-3, .01, .02, -.01, .003}},
      {CameraModel::kSimpleRadialFisheye, {500, 500, 400, 0.05}},
      {CameraModel::kRadialFisheye, {500, 500, 400, 0.05, -0.01}},
      {CameraModel::kThinPrismFisheye,
       {500, 505, 500, 400, .02, -.01, 1e-3, -2e-3, .001, .002, 1e-3, 2e-3}},
  };
  const PoseFrame pose{ArcPose(1, 5).rotation.toRotationMatrix(),
                       ArcPose(1, 5).TargetOriginInSource()};
  for (const double weight : {1.0, 1e-3, 0.0}) {  // a near point, a far one, one at infinity
    const Eigen::Vector3d near(0.3, 0.2, -0.4);
    Eigen::Vector4d place = near.homogeneous();
    if (weight < 1) place << near - pose.centre, weight;
    const PointFrame point = FrameAround(place, ArcPose(3, 5).TargetOriginInSource());
    for (const auto& [model, params] : lenses) {
      const LensFrame lens = FrameAround({model, 1000, 800, params}, 0.6);
      const auto cost = ObservationCost(lens, pose, point, {480, 410});
      const double theta[kMaxParams] = {0.01, -0.02, 0.015, 0.01, 0.02, -0.01, 0.01, 0.01};
      const std::vector<double> motion{0.02, -0.01, 0.03, 0.05, 0.02, -0.04};
      const std::vector<double> place_shift{0.01, -0.02, 0.003};
      std::vector<std::vector<double>> blocks{{theta, theta + params.size()}, motion, place_shift};
      EXPECT_LT(WorstDerivativeError(*cost, blocks), 1e-6)
          << NameOf(model) << ", weight " << weight;
      const auto shifted = ObservationCost(lens, pose, point, {480, 410}, {nullptr, 540});
      blocks.push_back({0.01, -0.02});
      EXPECT_LT(WorstDerivativeError(*shifted, blocks), 1e-6)
          << NameOf(model) << " with a shift, weight " << weight;
    }
  }
}

TEST(Adjust, ExactObservationsGiveTheTruthBackFromAStartThatIsOff) {
  const Bundle truth = MakeBundle({});
  const Adjusted out = Adjust(Perturbed(truth, 0.02), With(LensFreedom::kAll));
  EXPECT_TRUE(out.converged);
  EXPECT_LT(out.rms_px, 1e-6);
  EXPECT_NEAR(out.bundle.lenses[0].params[0], 900, 1e-4);
  EXPECT_NEAR(out.bundle.lenses[0].params[1], 504, 1e-4);
}

TEST(Adjust, KnownLensIsNotMoved) {
  const Bundle truth = MakeBundle({.noise_px = 0.3});
  const Adjusted out = Adjust(truth, With(LensFreedom::kFixed));
  EXPECT_EQ(out.bundle.lenses[0].params, truth.lenses[0].params);
}

TEST(Adjust, PrincipalPointStaysWhereItIsWantedToStay) {
  const Bundle truth = MakeBundle({.noise_px = 0.3});
  const Adjusted out = Adjust(truth, With(LensFreedom::kNoPrincipalPoint));
  EXPECT_EQ(out.bundle.lenses[0].params[1], 504);
  EXPECT_EQ(out.bundle.lenses[0].params[2], 397);
  EXPECT_NE(out.bundle.lenses[0].params[0], 900);
}

TEST(Adjust, ShiftsOfImagesAreToldFromTurns) {
  const Bundle truth = MakeBundle({.points = 400});
  Bundle start = truth;
  const auto shift_of = [](int image) {
    return Eigen::Vector2d(6 * std::sin(2.4 * image), 5 * std::cos(1.7 * image));
  };
  for (BundleObservation& o : start.observations) o.pixel += shift_of(o.image);
  const Adjusted out = Adjust(start, With(LensFreedom::kPrincipalPointPerImage));
  EXPECT_TRUE(out.converged);
  EXPECT_LT(out.rms_px, 1e-4) << "exact observations; only the weak hold on the shifts is felt";
  for (int i = 0; i < static_cast<int>(truth.images.size()); ++i) {
    const Eigen::Vector2d apart =
        out.bundle.images[static_cast<size_t>(i)].shift_px - out.bundle.images[0].shift_px;
    EXPECT_LT((apart - (shift_of(i) - shift_of(0))).norm(), 0.05) << i;
  }
  AdjustOptions fixed = With(LensFreedom::kPrincipalPointPerImage);
  fixed.fix_poses = true;
  EXPECT_THROW(Adjust(start, fixed), Error);
}

TEST(Adjust, SigmaIsTheNoiseThatWasAdded) {
  const Adjusted out =
      Adjust(MakeBundle({.points = 1000, .noise_px = 0.4}), With(LensFreedom::kAll));
  EXPECT_NEAR(out.sigma_px, 0.4, 0.4 * 0.02);  // 6000 observations and more: 1 % is one sigma
}

// The mean over many draws, whatever is free: every unknown is counted once.
TEST(Adjust, SigmaCountsTheUnknownsThatAreFree) {
  constexpr int kDraws = 60;
  constexpr double kNoise = 0.2;
  AdjustOptions poses_known, free = With(LensFreedom::kAll), placed = With(LensFreedom::kFixed);
  poses_known.lens = LensFreedom::kFixed;
  poses_known.fix_poses = true;
  for (AdjustOptions* options : {&poses_known, &free, &placed}) options->outlier_sigmas = 0;
  double sums[3] = {};
  for (std::uint64_t seed = 1; seed <= kDraws; ++seed) {
    const Bundle bundle = MakeBundle({.images = 6, .points = 20, .noise_px = kNoise, .seed = seed});
    AdjustOptions known = placed;
    Random random(seed);
    for (int i = 0; i < 6; ++i) {
      const Eigen::Vector3d centre =
          bundle.images[static_cast<size_t>(i)].cam_from_world.TargetOriginInSource();
      const double x = random.Normal(), y = random.Normal();
      constexpr double kKnown = 1e-4;  // nearer than the observations say: it counts
      known.positions.push_back({i, centre + kKnown * Eigen::Vector3d(x, y, random.Normal()),
                                 Eigen::Vector3d::Constant(kKnown)});
    }
    int k = 0;
    for (const AdjustOptions* options : {&poses_known, &free, &known}) {
      sums[k++] += Adjust(bundle, *options).sigma_px / (kDraws * kNoise);
    }
  }
  // 60 draws of some 150 numbers: the mean is known to 0.8 %, and a lens is 5 of them.
  constexpr double kMean = 0.02;
  EXPECT_NEAR(sums[0], 1, kMean);
  EXPECT_NEAR(sums[1], 1, kMean);
  EXPECT_NEAR(sums[2], 1, kMean);
}

TEST(Adjust, AsManyUnknownsAsNumbersSayNothingOfSigma) {
  const Bundle bundle = MakeBundle({.images = 2, .points = 4, .noise_px = 0.1});
  AdjustOptions options = With(LensFreedom::kFixed);
  options.outlier_sigmas = 0;
  EXPECT_EQ(Adjust(bundle, options).sigma_px, std::numeric_limits<double>::infinity());
}

TEST(Adjust, WorldOffsetChangesNothing) {
  const Bundle at_home = MakeBundle({.noise_px = 0.3});
  Similarity far_away;
  far_away.translation << 5e5, 4.5e6, 100;
  const auto here = Adjust(at_home, With(LensFreedom::kAll));
  const auto there = Adjust(Moved(at_home, far_away), With(LensFreedom::kAll));
  EXPECT_LT(LargestDifference(Projections(here.bundle), Projections(there.bundle)), kSamePx);
}

TEST(Adjust, GaugeOfTheStartIsKept) {
  const Bundle start = MakeBundle({.noise_px = 0.3});
  const Bundle out = Adjust(start, With(LensFreedom::kAll)).bundle;
  Eigen::Vector3d shift = Eigen::Vector3d::Zero(), largest = shift;
  double growth = 0;
  for (size_t i = 0; i < start.images.size(); ++i) {
    const Pose &a = start.images[i].cam_from_world, &b = out.images[i].cam_from_world;
    const Eigen::Vector3d c = b.TargetOriginInSource(), v = c - a.TargetOriginInSource();
    shift += v;
    growth += c.dot(v);
    largest = largest.cwiseMax(v.cwiseAbs());
  }
  // What moves the world as a whole is gone; what remains is what the noise does to each camera.
  EXPECT_LT(shift.norm(), 1e-9);
  EXPECT_LT(std::abs(growth), 1e-3 * largest.norm());
  EXPECT_GT(largest.norm(), 1e-4);
}

TEST(Adjust, TheSameBitsEveryTime) {
  const Bundle start = Perturbed(MakeBundle({.noise_px = 0.3}), 0.01);
  const Bundle a = Adjust(start, With(LensFreedom::kAll)).bundle;
  const Bundle b = Adjust(start, With(LensFreedom::kAll)).bundle;
  EXPECT_EQ(a.lenses[0].params, b.lenses[0].params);
  for (size_t i = 0; i < a.points.size(); ++i) EXPECT_EQ(a.points[i], b.points[i]);
}

TEST(Adjust, PointsAtInfinityAreNothingSpecial) {
  Bundle bundle = MakeBundle({.noise_px = 0.1});
  const LensCamera& lens = bundle.lenses[0];
  Random random(5);
  const size_t before = bundle.points.size();
  for (int k = 0; k < 40; ++k) {
    const double x = random.Uniform(-0.3, 0.3);
    const Eigen::Vector3d direction(x, 1, random.Uniform(-0.4, 0.1));
    const int point = static_cast<int>(bundle.points.size());
    for (int i = 0; i < 8; ++i) {
      const auto pixel = lens.PixelFromCam(
          bundle.images[static_cast<size_t>(i)].cam_from_world.rotation * direction);
      if (pixel) bundle.observations.push_back({i, point, *pixel});
    }
    Eigen::Vector4d h;
    h << direction, 0;
    bundle.points.push_back(h);
    bundle.point_ids.push_back(bundle.points.size());
  }
  const auto out = Adjust(Perturbed(bundle, 1e-3), With(LensFreedom::kAll));
  EXPECT_TRUE(out.converged);
  EXPECT_LT(out.rms_px, 0.2);
  for (size_t p = before; p < out.bundle.points.size(); ++p) {
    const Eigen::Vector4d& h = out.bundle.points[p];
    EXPECT_TRUE(h.allFinite());
    EXPECT_LT(std::abs(h[3]) / h.head<3>().norm(), 1e-3);  // a thousand units away or beyond
  }
}

TEST(Adjust, PositionsThatAreKnownDecideTheGauge) {
  const Bundle truth = MakeBundle({.noise_px = 0.1});
  Similarity world;
  world.scale = 1.02;
  world.translation << 0.3, -0.2, 0.1;
  AdjustOptions options = With(LensFreedom::kFixed);
  for (int i = 0; i < 8; ++i) {
    options.positions.push_back(
        {i, world * truth.images[static_cast<size_t>(i)].cam_from_world.TargetOriginInSource(),
         Eigen::Vector3d::Constant(1e-3)});
  }
  const Bundle out = Adjust(truth, options).bundle;
  for (size_t i = 0; i < 8; ++i) {
    EXPECT_LT(
        (out.images[i].cam_from_world.TargetOriginInSource() - options.positions[i].centre).norm(),
        3e-3);
  }
}

TEST(Adjust, AKnownDistanceDecidesTheScale) {
  const Bundle truth = MakeBundle({.noise_px = 0.1});
  AdjustOptions options = With(LensFreedom::kFixed);
  options.distances = {{0, 7, 20.0, 1e-3}};
  const Bundle out = Adjust(truth, options).bundle;
  EXPECT_NEAR((out.images[0].cam_from_world.TargetOriginInSource() -
               out.images[7].cam_from_world.TargetOriginInSource())
                  .norm(),
              20.0, 1e-3);
}

TEST(Adjust, RejectsWhatCannotBeMeant) {
  Bundle bundle = MakeBundle({});
  Bundle broken = bundle;
  broken.observations[3].pixel.x() = std::nan("");
  EXPECT_THROW(Adjust(broken, {}), Error);
  broken = bundle;
  broken.observations[3].point = 100000;
  EXPECT_THROW(Adjust(broken, {}), Error);
  broken = bundle;
  broken.images.resize(1);
  EXPECT_THROW(Adjust(broken, {}), Error);
  AdjustOptions options;
  options.positions = {{99, Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()}};
  EXPECT_THROW(Adjust(bundle, options), Error);
}

}  // namespace
}  // namespace dtr::calib
