// Stiff and extreme cases of bundle adjustment: the solution against the truth, in its own
// predicted standard deviations, or the degeneracy by its name. (`dtr selftest --stability` has
// more, against bounds in pixels.)
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/bundle/gauge.h"
#include "calib/triangulate.h"
#include "calib/validation/photos.h"
#include "tests/calib/bundle/synthetic_bundle.h"

namespace dtr::calib {
namespace {

using testing::LargestDifference;
using testing::LookAt;
using testing::MakeBundle;
using testing::Moved;
using testing::Perturbed;
using testing::Projections;
using testing::SceneSpec;

constexpr double kNoisePx = 0.3;
constexpr double kSamePx = 1e-6;         // what a world's unit may do to a pixel; 1e-11 seen
constexpr double kSameMinimumPx = 1e-4;  // where the solver stops, from anywhere; 5e-6 seen
const LensCamera kPinholeLens{CameraModel::kPinhole, 1000, 800, {900, 905, 504, 397}};

AdjustOptions With(LensFreedom lens) {
  AdjustOptions options;
  options.lens = lens;
  return options;
}

// What a solve makes of a scene, held against the truth that the scene was made from.
struct Held {
  Adjusted out;
  BundleCovariance covariance;
  double chi_squared = 0;  // of lens and poses together, over its degrees of freedom
  double chi_sigma = 0;    // its own standard deviation: sqrt(2 / degrees of freedom)
  double worst_lens = 0;   // largest error of a lens parameter in predicted standard deviations
};

// Squared errors of everything through the inverse covariance, which belongs to the truth's gauge.
// What moves the world as a whole is no error: these directions, in which the covariance has
// nothing, are left out.
void CompareWith(const Bundle& truth, Held& held) {
  const Bundle& found = held.out.bundle;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  const auto count = static_cast<double>(truth.images.size());
  for (const auto& image : truth.images) {
    middle += image.cam_from_world.TargetOriginInSource() / count;
  }
  double spread = 0;  // the covariance's gauge weighs turns and shifts in this unit
  for (const auto& image : truth.images) {
    spread += (image.cam_from_world.TargetOriginInSource() - middle).squaredNorm() / count;
  }
  spread = std::sqrt(spread);
  const BundleCovariance& c = held.covariance;
  Eigen::VectorXd error(c.matrix.rows()), unit = Eigen::VectorXd::Ones(c.matrix.rows());
  for (size_t k = 0; k < c.free_params[0].size(); ++k) {
    const long at = c.lens_at[0] + static_cast<long>(k);
    const auto param = static_cast<size_t>(c.free_params[0][k]);
    unit[at] = std::sqrt(c.matrix(at, at));
    error[at] = (found.lenses[0].params[param] - truth.lenses[0].params[param]) / unit[at];
    held.worst_lens = std::max(held.worst_lens, std::abs(error[at]));
  }
  for (size_t i = 0; i < truth.images.size(); ++i) {
    const Pose &a = truth.images[i].cam_from_world, &b = found.images[i].cam_from_world;
    const Eigen::AngleAxisd turn((b.rotation * a.rotation.conjugate()).normalized());
    error.segment<3>(c.image_at[i]) = turn.angle() * turn.axis();
    error.segment<3>(c.image_at[i] + 3) =
        (b.TargetOriginInSource() - a.TargetOriginInSource()) / spread;
    unit.segment<3>(c.image_at[i] + 3).setConstant(spread);
  }
  const Eigen::VectorXd per_unit = unit.cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(per_unit.asDiagonal() * c.matrix *
                                                             per_unit.asDiagonal());
  const long freedom = error.size() - c.gauge_freedom;
  for (long k = c.gauge_freedom; k < error.size(); ++k) {
    held.chi_squared += std::pow(eigen.eigenvectors().col(k).dot(error), 2) /
                        eigen.eigenvalues()[k] / static_cast<double>(freedom);
  }
  held.chi_sigma = std::sqrt(2.0 / static_cast<double>(freedom));
}

// Solves from `start` and expects the truth within what is predicted. 4 sigmas of chi-squared, and
// of each of a handful of lens parameters, are exceeded by chance once in some thousand cases.
Held ExpectTheTruth(const Bundle& truth, const Bundle& start, LensFreedom lens,
                    double noise_px = kNoisePx) {
  Held held{Adjust(start, With(lens)), {}};
  MoveToGaugeOf(truth, held.out.bundle);
  held.covariance = CovarianceOf(held.out, With(lens));
  EXPECT_TRUE(held.out.converged);
  EXPECT_TRUE(held.covariance.computed && held.covariance.determined) << held.covariance.weakest;
  const auto all = static_cast<double>(start.observations.size());
  const double freedom = 2 * all - 3.0 * static_cast<double>(start.points.size()) - 60;
  EXPECT_NEAR(held.out.sigma_px, noise_px, noise_px * 4 / std::sqrt(2 * freedom));
  if (!held.covariance.determined) return held;
  CompareWith(truth, held);
  EXPECT_NEAR(held.chi_squared, 1, 4 * held.chi_sigma);
  EXPECT_LT(held.worst_lens, 4);
  for (const auto& point : held.out.bundle.points) EXPECT_TRUE(point.allFinite());
  return held;
}

const Degeneracy* Find(const std::vector<Degeneracy>& all, const std::string& name) {
  const auto found = std::ranges::find(all, name, &Degeneracy::name);
  return found == all.end() ? nullptr : &*found;
}

void ExpectHarmless(const Held& held, const char* name) {
  const auto all = FindDegeneracies(held.out, held.covariance, BundleLimits{}.max_focal_share);
  const Degeneracy* found = Find(all, name);
  ASSERT_NE(found, nullptr) << name;
  EXPECT_FALSE(found->harmful) << found->detail;
}

PhotosValidation ExpectNamed(const Bundle& bundle, std::initializer_list<const char*> names) {
  const PhotosValidation judgement = ValidatePhotos(bundle, {});
  EXPECT_FALSE(AllPassed(judgement.tests));
  for (const Check& test : judgement.tests) EXPECT_FALSE(std::isnan(test.value)) << test.name;
  EXPECT_TRUE(std::ranges::any_of(names, [&](const char* name) {
    const Degeneracy* found = Find(judgement.degeneracies, name);
    return found != nullptr && found->harmful;
  })) << ToJson(judgement);
  return judgement;
}

// The scene without noise, and with it.
std::pair<Bundle, Bundle> TrueAndSeen(SceneSpec spec, double noise_px = kNoisePx) {
  spec.noise_px = 0;
  Bundle truth = MakeBundle(spec);
  spec.noise_px = noise_px;
  return {std::move(truth), MakeBundle(spec)};
}

// Of each point the observations of two images, drawn by chance.
Bundle OfTwo(Bundle bundle) {
  std::vector<BundleObservation> kept;
  Random random(3);
  const auto& all = bundle.observations;
  for (size_t begin = 0, end = 0; begin < all.size(); begin = end) {
    while (end < all.size() && all[end].point == all[begin].point) ++end;
    const int count = static_cast<int>(end - begin), a = random.Index(count);
    const int b = (a + 1 + random.Index(count - 1)) % count;
    for (const int k : {std::min(a, b), std::max(a, b)}) {
      kept.push_back(all[begin + static_cast<size_t>(k)]);
    }
  }
  bundle.observations = std::move(kept);
  return bundle;
}

TEST(Stiff, TracksOfTwoGiveTheTruth) {
  const auto [truth, seen] = TrueAndSeen({.points = 800});
  const Bundle twos = OfTwo(seen);
  ASSERT_EQ(twos.observations.size(), 2 * twos.points.size());
  ExpectHarmless(ExpectTheTruth(truth, Perturbed(twos, 0.01), LensFreedom::kAll), "tracks_of_two");
}

// Images that share points with the next one alone: nothing tells how far one pair's cameras stand
// apart by the next pair's.
TEST(Stiff, AChainOfTracksOfTwoIsNamed) {
  ExpectNamed(
      MakeBundle(
          {.points = 500, .lens = kPinholeLens, .noise_px = kNoisePx, .max_observations = 2}),
      {"tracks_of_two"});
}

// Three cameras that see the scene from places 0.1 degrees apart.
SceneSpec NarrowRays() {
  SceneSpec spec{.images = 3, .points = 300, .lens = kPinholeLens};
  spec.pose = [](int i, int) {
    const double aside = 6 * std::tan(0.05 * std::numbers::pi / 180);
    return LookAt({aside * (i - 1), -6, aside * (i == 1)}, {0, 0, 0});
  };
  return spec;
}

TEST(Stiff, RaysATenthOfADegreeApartGiveTheTruthWhereTheLensIsKnown) {
  const auto [truth, seen] = TrueAndSeen(NarrowRays(), 0.02);
  const Held held = ExpectTheTruth(truth, seen, LensFreedom::kFixed, 0.02);
  ExpectHarmless(held, "small_angles");
}

TEST(Stiff, RaysATenthOfADegreeApartAreNamedWhereTheLensIsNot) {
  ExpectNamed(TrueAndSeen(NarrowRays(), 0.02).second, {"small_angles", "pure_rotation"});
}

TEST(Stiff, OneObservationAMillionPixelsOffIsLeftOutAndMovesNothing) {
  const auto [truth, seen] = TrueAndSeen({});
  const Held clean = ExpectTheTruth(truth, seen, LensFreedom::kAll);
  for (const Eigen::Vector2d& off : {Eigen::Vector2d(1e6, 0), Eigen::Vector2d(-6e5, 8e5)}) {
    Bundle spoiled = seen;
    spoiled.observations[5].pixel += off;
    Held held = ExpectTheTruth(truth, spoiled, LensFreedom::kAll);
    for (size_t i = 0; i < held.out.used.size(); ++i) {
      EXPECT_EQ(held.out.used[i], i != 5 && clean.out.used[i]) << i;
    }
    held.chi_squared = 0;
    CompareWith(clean.out.bundle, held);
    // Squared, over 46 unknowns: of 1600 observations one less moves them by 1 sigma or so, all
    // together.
    EXPECT_LT(held.chi_squared, 0.1);
  }
}

TEST(Stiff, AStartThirtyPercentOffEndsAtTheSameMinimum) {
  const auto [truth, seen] = TrueAndSeen({});
  const Held best = ExpectTheTruth(truth, seen, LensFreedom::kAll);
  std::vector<Bundle> starts(2, seen);
  starts[0].lenses[0].params[0] *= 0.7;
  starts[1].lenses[0].params[0] *= 1.3;
  // Poses and points, too: places by 0.3 units of a box of 4, turns by 2 degrees.
  starts.push_back(Perturbed(seen, 0.3));
  for (const Bundle& start : starts) {
    const Held held = ExpectTheTruth(truth, start, LensFreedom::kAll);
    EXPECT_LT(LargestDifference(Projections(best.out.bundle), Projections(held.out.bundle)),
              kSameMinimumPx);
  }
}

// Focal lengths of thousands of px beside coefficients of 1e-3 and 1e-8.
TEST(Stiff, TheUnitOfTheWorldChangesNothingForALensOfMixedMagnitudes) {
  SceneSpec spec{
      .lens = {
          CameraModel::kOpenCv, 4000, 3200, {3600, 3620, 2016, 1588, -0.05, 1e-3, 1e-8, -1e-8}}};
  const auto [truth, seen] = TrueAndSeen(spec);
  const Held here = ExpectTheTruth(truth, seen, LensFreedom::kAll);
  EXPECT_GT(here.covariance.condition, 1);
  for (const double scale : {1e-6, 1e-3, 1e3, 1e6}) {
    Similarity scaled;
    scaled.scale = scale;
    const Adjusted there = Adjust(Moved(seen, scaled), With(LensFreedom::kAll));
    const double condition = CovarianceOf(there, With(LensFreedom::kAll)).condition;
    EXPECT_NEAR(condition / here.covariance.condition, 1, 1e-3);
    EXPECT_LT(LargestDifference(Projections(here.out.bundle), Projections(there.bundle)), kSamePx);
  }
}

TEST(Stiff, APlaneIsNamedAndGivesTheTruthWhereItIsSeenFromTheSides) {
  SceneSpec spec{.points = 400, .lens = kPinholeLens};
  spec.point = [](Random& random) {
    const double x = random.Uniform(-2, 2);
    return Eigen::Vector3d(x, 0, random.Uniform(-1.5, 1.5));
  };
  // The noise is little: what a plane leaves open bends within more (chi-squared of 40 draws is
  // 1.00 with this, 1.15 with 0.3 px and 1.46 with 0.3 px and 100 points).
  const auto [truth, seen] = TrueAndSeen(spec, 0.05);
  const Held held = ExpectTheTruth(truth, Perturbed(seen, 0.01), LensFreedom::kAll, 0.05);
  ExpectHarmless(held, "planar_scene");
  spec.images = 6;
  spec.pose = [](int i, int) {  // focal length and distance are one
    const Eigen::Vector3d centre(0.5 * (i % 3) - 0.5, -6, 0.5 * (i / 3));
    return LookAt(centre, centre + Eigen::Vector3d::UnitY());
  };
  ExpectNamed(TrueAndSeen(spec).second, {"planar_scene"});
}

TEST(Stiff, ForwardMotionIsNamedAndGivesTheTruthWhereTheLensIsKnown) {
  SceneSpec spec{.points = 400, .lens = kPinholeLens};
  spec.pose = [](int i, int) { return LookAt({0, -9.0 + 0.5 * i, 0.5}, {0, 0, 0.5}); };
  const auto [truth, seen] = TrueAndSeen(spec);
  const Held held = ExpectTheTruth(truth, Perturbed(seen, 0.01), LensFreedom::kFixed);
  ExpectHarmless(held, "forward_motion");
  ExpectNamed(seen, {"forward_motion"});
}

TEST(Stiff, CentresOnALineAreNamedAndGiveTheTruth) {
  SceneSpec spec{.points = 400, .lens = kPinholeLens};
  spec.pose = [](int i, int) { return LookAt({0.4 * i - 1.4, -6, 1}, {0, 0, 0}); };
  const auto [truth, seen] = TrueAndSeen(spec);
  ExpectHarmless(ExpectTheTruth(truth, Perturbed(seen, 0.01), LensFreedom::kAll),
                 "collinear_centres");
}

// Photos 0 and 1 are of one place and direction: the same camera, with noise of its own.
SceneSpec WithTheSameCameraTwice() {
  SceneSpec spec{.points = 400, .lens = kPinholeLens};
  spec.pose = [](int i, int n) { return testing::ArcPose(std::max(i, 1), n); };
  return spec;
}

TEST(Stiff, TwoIdenticalCamerasAmongOthersGiveTheTruth) {
  const auto [truth, seen] = TrueAndSeen(WithTheSameCameraTwice());
  const Held held = ExpectTheTruth(truth, Perturbed(seen, 0.01), LensFreedom::kAll);
  EXPECT_TRUE(FindDegeneracies(held.out, held.covariance, BundleLimits{}.max_focal_share).empty())
      << "two photos from one position are no copies of each other";
}

TEST(Stiff, TheSamePhotoTwiceAmongOthersIsNamed) {
  Bundle bundle = MakeBundle(WithTheSameCameraTwice());  // no noise: the same observations
  bundle.images[0].name = "first.jpg", bundle.images[1].name = "again.jpg";
  const PhotosValidation judgement = ExpectNamed(bundle, {"duplicate_images"});
  EXPECT_EQ(Find(judgement.degeneracies, "duplicate_images")->detail, "first.jpg = again.jpg");
}

// Nothing but one place: no point has a distance.
TEST(Stiff, TwoIdenticalCamerasAloneAreNamed) {
  SceneSpec spec{.images = 2, .points = 400, .lens = kPinholeLens, .noise_px = kNoisePx};
  spec.pose = [](int, int) { return testing::ArcPose(3, 8); };
  ExpectNamed(MakeBundle(spec), {"pure_rotation"});
}

// A point by two known cameras: its errors along and across the rays are those of its covariance.
TEST(Stiff, APointThatTwoRaysATenthOfADegreeApartPlaceErrsAsPredicted) {
  const PinholeCamera camera = kPinholeLens.Pinhole();
  const Eigen::Vector3d p(0.1, 0.2, -0.1);
  const double aside = 6 * std::tan(0.05 * std::numbers::pi / 180);
  const Pose left = LookAt({-aside, -6, 0}, {0, 0, 0}), right = LookAt({aside, -6, 0}, {0, 0, 0});
  constexpr int kDraws = 2000;
  constexpr double kPointNoisePx = 0.01;  // distance errs by 0.9 %: still a normal law
  Random random(5);
  double chi_squared = 0;
  for (int k = 0; k < kDraws; ++k) {
    std::vector<Observation> observations;
    for (const Pose& pose : {left, right}) {
      const Eigen::Vector2d noise(random.Normal(), random.Normal());
      observations.push_back(
          MakeObservation(camera, pose, *camera.PixelFromCam(pose * p) + kPointNoisePx * noise));
    }
    const Triangulation found = Triangulate(observations, -1);
    ASSERT_EQ(found.status, TriangulationStatus::kConverged);
    const Eigen::Vector3d error = found.p_in_world - p;
    chi_squared += error.dot(found.covariance.ldlt().solve(error)) /
                   (kPointNoisePx * kPointNoisePx * 3 * kDraws);
  }
  EXPECT_NEAR(chi_squared, 1, 4 * std::sqrt(2.0 / (3 * kDraws)));
}

}  // namespace
}  // namespace dtr::calib
