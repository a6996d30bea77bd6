#include "calib/bundle/plain/plain_adjust.h"

#include <ceres/jet.h>
#include <gtest/gtest.h>

#include "calib/bundle/covariance.h"
#include "calib/bundle/held_out.h"
#include "calib/bundle/plain/minimise.h"
#include "calib/bundle/plain/normal.h"
#include "calib/colmap/model_io.h"
#include "calib/models/fisheye.h"
#include "calib/models/lens_formula.h"
#include "dtr/base/error.h"
#include "tests/calib/bundle/synthetic_bundle.h"
#include "tests/support/on_threads.h"
#include "tests/support/test_data.h"

namespace dtr::calib {
namespace {

using testing::LargestDifference;
using testing::MakeBundle;
using testing::Perturbed;
using testing::Projections;
using testing::SceneSpec;

const LensCamera kPlainLenses[] = {
    {CameraModel::kSimplePinhole, 1000, 800, {900, 504, 397}},
    {CameraModel::kPinhole, 1000, 800, {900, 905, 504, 397}},
    {CameraModel::kSimpleRadial, 1000, 800, {900, 504, 397, -0.05}},
    {CameraModel::kRadial, 1000, 800, {900, 504, 397, -0.05, 0.01}},
    {CameraModel::kOpenCv, 1000, 800, {900, 905, 504, 397, -0.05, 0.01, 1e-3, -2e-3}},
    {CameraModel::kSimpleRadialFisheye, 1000, 800, {600, 504, 397, -0.05}},
    {CameraModel::kRadialFisheye, 1000, 800, {600, 504, 397, -0.05, 0.01}},
    {CameraModel::kOpenCvFisheye, 1000, 800, {600, 605, 504, 397, -0.05, 0.01, 2e-3, -1e-3}},
};

// Both solvers stop where a step promises 1e-11 of the cost: what is left of it is far below this.
constexpr double kSameCost = 1e-8;
constexpr double kSamePx = 1e-5;  // of noise of 0.3 px; seen: below 1e-6

double SquaredSum(const Bundle& bundle) {
  double sum = 0;
  for (const Eigen::Vector2d& r : Residuals(bundle)) sum += r.squaredNorm();
  return sum;
}

PlainOptions AllFree() {
  PlainOptions options;
  options.free_principal_point = true;
  options.cost_tolerance = 1e-12;
  return options;
}

TEST(PlainProjection, AgreesWithJetsOfTheFormula) {
  using Jet = ceres::Jet<double, 11>;
  for (const LensCamera& lens : kPlainLenses) {
    const auto count = lens.params.size();
    Jet params[8], p[3], expected[2];
    for (size_t i = 0; i < count; ++i) params[i] = Jet(lens.params[i], static_cast<int>(i));
    const double z = calib::IsFisheye(lens.model) ? -0.05 : 1.3;  // it sees behind its plane, too
    const double at[3] = {0.3, -0.2, z};
    for (int i = 0; i < 3; ++i) p[i] = Jet(at[i], 8 + i);
    ASSERT_TRUE(FormulaOf(lens.model, params).Project(p, expected));
    const plain::Intrinsics of = plain::IntrinsicsOf(lens.model, lens.params.data());
    double pixel[2], by_point[6], by_lens[2 * plain::kColumns];
    plain::Differentiate(of, at, pixel, by_point, by_lens);
    for (int k = 0; k < 2; ++k) {
      EXPECT_NEAR(pixel[k], expected[k].a, 1e-10);
      for (int i = 0; i < 3; ++i) EXPECT_NEAR(by_point[3 * k + i], expected[k].v[8 + i], 1e-9);
      for (size_t i = 0; i < count; ++i) {
        const auto column = plain::ColumnOf(lens.model, static_cast<int>(i));
        EXPECT_NEAR(by_lens[2 * column + k], expected[k].v[static_cast<long>(i)], 1e-9)
            << NameOf(lens.model) << " parameter " << i;
      }
    }
    const double behind[3] = {0.1, 0.1, -1};
    EXPECT_EQ(plain::Project(of, behind, pixel), calib::IsFisheye(lens.model));
  }
}

// On the axis of a fisheye the formula is 0 / 0.
TEST(PlainProjection, AFisheyesAxisHasTheDerivativesOfItsSurroundings) {
  const LensCamera& lens = *std::find_if(std::begin(kPlainLenses), std::end(kPlainLenses),
                                         [](const auto& l) { return IsFisheye(l.model); });
  const plain::Intrinsics of = plain::IntrinsicsOf(lens.model, lens.params.data());
  double pixel[2], on_axis[6], near[6], by_lens[2 * plain::kColumns];
  const double axis[3] = {0, 0, 2}, beside[3] = {1e-7, -1e-7, 2}, away[3] = {0, 0, -2};
  plain::Differentiate(of, axis, pixel, on_axis, by_lens);
  EXPECT_NEAR(pixel[0], 504, 1e-12);
  EXPECT_NEAR(on_axis[0], 300, 1e-9);
  plain::Differentiate(of, beside, pixel, near, by_lens);
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(on_axis[i], near[i], 1e-4);
  EXPECT_FALSE(plain::Project(of, away, pixel));
}

// The gradient of cameras, lenses and priors against differences of the cost, under Cauchy's loss.
TEST(PlainAdjust, GradientAgreesWithDifferencesOfTheCost) {
  for (const LensCamera& lens : kPlainLenses) {
    const Bundle bundle =
        Perturbed(MakeBundle({.images = 5, .points = 30, .lens = lens, .noise_px = 0.5}), 0.002);
    Normalised n = Normalised::Around(bundle);
    n.shift.assign(bundle.images.size(), {});
    plain::Settings settings;
    settings.cauchy_px = 2;
    settings.free_params.resize(1);
    for (int k = 0; k < ParameterCount(lens.model); ++k) settings.free_params[0].push_back(k);
    settings.shift_weights.assign(bundle.images.size(), 0.1);
    settings.lens_priors.push_back({0, false, FocalCount(lens.model), 500, 0.3});
    if (FocalCount(lens.model) == 2) settings.lens_priors.push_back({0, true, 0, 0.01, 300});
    const std::vector<bool> used(bundle.observations.size(), true);
    const plain::Problem problem(bundle, n, used, settings);
    const plain::Layout layout(problem);
    plain::NormalEquations normal(problem, layout);
    plain::Unknowns x{n.theta, n.motion, n.place, n.shift};
    normal.Build(x, 1e-4);
    constexpr double kStep = 1e-6;
    const auto difference = [&](double& unknown) {
      const double here = unknown;
      unknown = here + kStep;
      const double ahead = problem.CostAt(x);
      unknown = here - kStep;
      const double behind = problem.CostAt(x);
      unknown = here;
      return (ahead - behind) / (2 * kStep);
    };
    const double largest = normal.gradient().cwiseAbs().maxCoeff();
    const auto expect = [&](double& unknown, long at, const char* what) {
      EXPECT_NEAR(difference(unknown) / largest, normal.gradient()[at] / largest, 1e-6)
          << NameOf(lens.model) << " " << what << " " << at;
    };
    for (size_t i = 0; i < bundle.images.size(); ++i) {
      for (size_t k = 0; k < 6; ++k) {
        expect(x.motion[i][k], layout.offset(i) + static_cast<long>(k), "pose");
      }
      for (size_t k = 0; k < 2; ++k) {
        expect(x.shift[i][k], layout.offset(i) + 6 + static_cast<long>(k), "shift");
      }
    }
    for (size_t k = 0; k < lens.params.size(); ++k) {
      expect(x.theta[0][k], layout.offset(layout.LensNode(0)) + static_cast<long>(k), "lens");
    }
  }
}

TEST(PlainAdjust, FindsTheMinimumThatCeresFinds) {
  for (const LensCamera& lens : kPlainLenses) {
    const Bundle start =
        Perturbed(MakeBundle({.points = 300, .lens = lens, .noise_px = 0.3}), 0.01);
    AdjustOptions reference;
    reference.outlier_sigmas = 0;
    reference.by_ceres = true;
    reference.lens = LensFreedom::kAll;
    const Adjusted expected = Adjust(start, reference);
    Bundle found = start;
    const PlainResult result = AdjustPlain(AllFree(), {}, found);
    EXPECT_TRUE(result.converged);
    EXPECT_LT(result.iterations, 15);
    const double cost = SquaredSum(expected.bundle);
    EXPECT_NEAR(2 * result.cost / cost, 1, kSameCost) << NameOf(lens.model);
    EXPECT_NEAR(SquaredSum(found) / cost, 1, kSameCost) << NameOf(lens.model);
    EXPECT_LT(LargestDifference(Projections(found), Projections(expected.bundle)), kSamePx)
        << NameOf(lens.model);
  }
}

TEST(PlainAdjust, LongWalkIsSolvedSparsely) {
  SceneSpec spec = testing::Walk(0.3);
  spec.images = 160, spec.points = 3000;
  spec.point = [](Random& random) {
    const double x = random.Uniform(-4, 163), y = random.Uniform(5, 12);
    return Eigen::Vector3d(x, y, random.Uniform(-2, 5));
  };
  const Bundle start = Perturbed(MakeBundle(spec), 1e-3);
  AdjustOptions reference;
  reference.outlier_sigmas = 0;
  reference.by_ceres = true;
  reference.lens = LensFreedom::kNoPrincipalPoint;
  const Adjusted expected = Adjust(start, reference);
  Bundle found = start;
  PlainOptions options;
  options.cost_tolerance = 1e-12;
  EXPECT_TRUE(AdjustPlain(options, {}, found).converged);
  EXPECT_NEAR(SquaredSum(found) / SquaredSum(expected.bundle), 1, kSameCost);
  Normalised n = Normalised::Around(start);
  plain::Settings settings;
  settings.free_params = {{0, 3, 4}};
  const plain::Problem problem(start, n, std::vector<bool>(start.observations.size(), true),
                               settings);
  EXPECT_EQ(plain::Layout(problem).solution(), plain::Solution::kSparse);
}

// Photos of one object of which any two may see a common point, so that no order of elimination
// leaves few blocks.
Bundle ManyOfOneObject(int images) {
  constexpr double kObservationsPerPoint = 12;
  Bundle bundle = MakeBundle({.images = images, .points = 3 * images});
  Random random(11);
  std::erase_if(bundle.observations, [&](const BundleObservation&) {
    return random.Uniform() > kObservationsPerPoint / images;
  });
  return bundle;
}

TEST(PlainAdjust, ManyPhotosOfOneObjectAreSolvedIteratively) {
  const Bundle truth = ManyOfOneObject(560);
  const Bundle start = Perturbed(truth, 1e-3);
  Normalised n = Normalised::Around(start);
  plain::Settings settings;
  settings.free_params = {{0, 3, 4}};
  const plain::Problem problem(start, n, std::vector<bool>(start.observations.size(), true),
                               settings);
  const plain::Layout layout(problem);
  ASSERT_EQ(layout.solution(), plain::Solution::kIterative);
  EXPECT_LT(layout.storage(), 100 * layout.nodes()) << "no block of two images";

  Bundle found = start;
  EXPECT_TRUE(AdjustPlain({}, {}, found).converged);
  EXPECT_LT(LargestDifference(Projections(found), Projections(truth)), kSamePx);
  Bundle by_one = start, by_two = start;
  PlainOptions options;
  options.max_iterations = 2;
  AdjustPlain(options, {}, by_one);
  AdjustPlain(options, {}, by_two);
  EXPECT_EQ(LargestDifference(Projections(by_one), Projections(by_two)), 0);
}

TEST(PlainAdjust, SeparateLensesAndShiftsAreSolved) {
  Bundle start = Perturbed(MakeBundle({.points = 300, .noise_px = 0.3}), 0.003);
  for (size_t i = 0; i < start.images.size(); ++i) {
    start.images[i].lens = static_cast<int>(i);
    if (i > 0) start.lenses.push_back(start.lenses[0]);
  }
  AdjustOptions reference;
  reference.outlier_sigmas = 0;
  reference.by_ceres = true;
  reference.lens = LensFreedom::kAll;
  const Adjusted expected = Adjust(start, reference);
  Bundle found = start;
  EXPECT_TRUE(AdjustPlain(AllFree(), {}, found).converged);
  EXPECT_NEAR(SquaredSum(found) / SquaredSum(expected.bundle), 1, kSameCost);

  Bundle shifted = MakeBundle({.points = 400});
  const auto shift_of = [](int image) { return Eigen::Vector2d(6 * std::sin(2.4 * image), image); };
  for (BundleObservation& o : shifted.observations) o.pixel += shift_of(o.image);
  PlainOptions options = AllFree();
  options.principal_point_sigma_px = 1e4;
  EXPECT_TRUE(AdjustPlain(options, {}, shifted).converged);
  const Eigen::Vector2d apart = shifted.images[3].shift_px - shifted.images[0].shift_px;
  EXPECT_LT((apart - (shift_of(3) - shift_of(0))).norm(), 0.05);
}

TEST(PlainAdjust, TheSameBytesForAnyNumberOfThreads) {
  const Bundle start =
      Perturbed(MakeBundle({.images = 12, .points = 3000, .noise_px = 0.3}), 0.003);
  ASSERT_GT(start.observations.size(), 20000u) << "several parts";
  PlainOptions options;
  Bundle one = start, three = start;
  OnThreads(1, [&] { return AdjustPlain(options, {}, one); });
  OnThreads(3, [&] { return AdjustPlain(options, {}, three); });
  EXPECT_EQ(one.lenses[0].params, three.lenses[0].params);
  EXPECT_EQ(one.points, three.points);
  for (size_t i = 0; i < one.images.size(); ++i) {
    EXPECT_EQ(one.images[i].cam_from_world.translation, three.images[i].cam_from_world.translation);
  }
}

TEST(PlainAdjust, WhatIsFixedStays) {
  const Bundle start = Perturbed(MakeBundle({.noise_px = 0.3}), 0.003);
  PlainOptions options;
  options.fixed_images.assign(start.images.size(), false);
  options.fixed_images[1] = options.fixed_images[4] = true;
  options.fixed_lenses = {true};
  Bundle found = start;
  EXPECT_TRUE(AdjustPlain(options, {}, found).converged);
  EXPECT_EQ(found.lenses[0].params, start.lenses[0].params);
  const auto moved = [&](size_t i) {
    return (found.images[i].cam_from_world.TargetOriginInSource() -
            start.images[i].cam_from_world.TargetOriginInSource())
        .norm();
  };
  EXPECT_LT(moved(1), 1e-12);
  EXPECT_LT(moved(4), 1e-12);
  EXPECT_GT(moved(2), 1e-4);
}

TEST(PlainAdjust, PointsAloneGoWhereKnownCamerasSeeThem) {
  const Bundle truth = MakeBundle({});
  Bundle start = truth;
  Random random(3);
  for (Eigen::Vector4d& h : start.points)
    h.head<3>() += 0.2 * Eigen::Vector3d(random.Normal(), 1, 0);
  PlainOptions options;
  options.free_poses = false;
  options.fixed_lenses = {true};
  EXPECT_TRUE(AdjustPlain(options, {}, start).converged);
  for (size_t p = 0; p < truth.points.size(); ++p) {
    EXPECT_LT((start.points[p] - truth.points[p]).norm(), 1e-6) << p;
  }
}

TEST(PlainAdjust, OutliersHardlyMatterUnderCauchysLoss) {
  const Bundle truth = MakeBundle({.noise_px = 0.1});
  Bundle start = truth;
  for (size_t i = 0; i < start.observations.size(); i += 20) start.observations[i].pixel.x() += 60;
  PlainOptions options;
  options.cauchy_px = 0.3;
  EXPECT_TRUE(AdjustPlain(options, {}, start).converged);
  EXPECT_NEAR(start.lenses[0].params[0], 900, 1);
  Bundle squares = truth;
  squares.observations = start.observations;
  AdjustPlain({}, {}, squares);
  EXPECT_GT(std::abs(squares.lenses[0].params[0] - 900), 3) << "the loss makes the difference";
}

// Everything that Adjust does around its solves: the robust passes, the choice of outliers, what is
// known of lenses and of images' principal points, weighed by the noise that the solve before
// found: it depends on where the robust solve stopped.
TEST(PlainAdjust, AdjustGivesWhatItGivesByCeres) {
  for (const LensFreedom lens :
       {LensFreedom::kFixed, LensFreedom::kNoPrincipalPoint, LensFreedom::kAll,
        LensFreedom::kTangential, LensFreedom::kPrincipalPointPerImage,
        LensFreedom::kTangentialPerImage}) {
    Bundle start = Perturbed(MakeBundle({.points = 300, .noise_px = 0.3}), 0.003);
    for (size_t i = 0; i < start.observations.size(); i += 25) {
      start.observations[i].pixel.y() += 40;
    }
    AdjustOptions options;
    options.lens = lens;
    options.aspect_sigma = kKnownAspectSigma;
    options.principal_point_share = kKnownPrincipalPointShare;
    const Adjusted found = Adjust(start, options);
    options.by_ceres = true;
    const Adjusted expected = Adjust(start, options);
    EXPECT_TRUE(found.converged);
    EXPECT_EQ(found.used, expected.used) << NameOf(lens);
    EXPECT_NEAR(found.rms_px / expected.rms_px, 1, 1e-6) << NameOf(lens);
    EXPECT_NEAR(found.sigma_px / expected.sigma_px, 1, 1e-6) << NameOf(lens);
    EXPECT_LT(LargestDifference(Projections(found.bundle), Projections(expected.bundle)), 1e-3)
        << NameOf(lens);
  }
}

TEST(PlainAdjust, PlazaGivesWhatItGivesByCeres) {
  const auto folder = testing::DataFolder() / "plaza/sparse";
  DTR_REQUIRE_DATA(folder);
  Bundle start = SomePoints(BundleOf(colmap::ReadModel(folder)), 1000, 1);
  Random random(5);
  for (BundleObservation& o : start.observations) {
    const double x = random.Normal(), y = random.Normal();
    o.pixel += (random.Uniform(0, 1) < 0.03 ? 20 : 0.3) * Eigen::Vector2d(x, y);
  }
  start = Perturbed(start, 3e-3);
  AdjustOptions options;
  options.lens = LensFreedom::kAll;
  const Adjusted found = Adjust(start, options);
  options.by_ceres = true;
  const Adjusted expected = Adjust(start, options);
  EXPECT_EQ(found.used, expected.used);
  EXPECT_NEAR(found.rms_px / expected.rms_px, 1, kSameCost);
  const BundleCovariance covariance = CovarianceOf(expected, options);
  ASSERT_TRUE(covariance.computed && covariance.determined);
  for (long k = 0; k < 4; ++k) {
    const auto at = static_cast<size_t>(k);
    const double sigma =
        std::sqrt(covariance.matrix(covariance.lens_at[0] + k, covariance.lens_at[0] + k));
    EXPECT_LT(std::abs(found.bundle.lenses[0].params[at] - expected.bundle.lenses[0].params[at]),
              1e-3 * sigma);
  }
  EXPECT_LT(LargestDifference(Projections(found.bundle), Projections(expected.bundle)), 1e-3);
}

TEST(PlainAdjust, WhatIsKnownOfLensesHoldsFromAnyStart) {
  const Bundle bundle = MakeBundle({.points = 300, .noise_px = 0.3});
  AdjustOptions options;
  options.lens = LensFreedom::kTangential;
  options.aspect_sigma = 1e-4;
  options.principal_point_share = 1e-4;
  const Adjusted cold = Adjust(bundle, options);
  options.known_lenses = &bundle.lenses;
  Bundle elsewhere = bundle;
  elsewhere.lenses[0].params[1] += 3;
  for (const bool by_ceres : {false, true}) {
    options.by_ceres = by_ceres;
    const Adjusted warm = Adjust(elsewhere, options);
    for (size_t k = 0; k < 4; ++k) {
      EXPECT_NEAR(warm.bundle.lenses[0].params[k], cold.bundle.lenses[0].params[k], 1e-3) << k;
    }
    EXPECT_NEAR(warm.sigma_px, cold.sigma_px, 1e-7);
  }
  const std::vector<LensCamera> none;
  options.known_lenses = &none;
  EXPECT_THROW(Adjust(elsewhere, options), Error);
}

TEST(PlainAdjust, RejectsWhatItCannotSolve) {
  Bundle bundle = MakeBundle({});
  EXPECT_THROW(AdjustPlain({}, std::vector<bool>(3, true), bundle), Error);
  EXPECT_THROW(AdjustPlain({}, std::vector<bool>(bundle.observations.size()), bundle), Error);
  bundle.lenses[0] = {
      CameraModel::kFullOpenCv, 1000, 800, {900, 900, 504, 397, 0, 0, 0, 0, 0, 0, 0, 0}};
  EXPECT_THROW(AdjustPlain({}, {}, bundle), Error);
}

}  // namespace
}  // namespace dtr::calib
