#include "calib/bundle/metric_refine.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "calib/similarity.h"
#include "dtr/base/error.h"
#include "tests/calib/bundle/synthetic_bundle.h"
#include "tests/support/on_threads.h"

namespace dtr::calib {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::kChain;
using testing::MakeBundle;
using testing::ModelFrom;
using testing::SceneSpec;
using testing::Walk;

constexpr double kUnit = 2.5;  // metres that a unit of the models is

Eigen::Vector3d Draw(Random& random) {
  const double x = random.Normal(), y = random.Normal();
  return {x, y, random.Normal()};
}

// In another world, of another unit.
SfmModel Moved(const Bundle& bundle) {
  const Similarity world{
      1 / kUnit, Eigen::Quaterniond(0.8, 0.2, -0.4, 0.4).normalized(), {5, -7, 90}};
  return ModelFrom(testing::Moved(bundle, world));
}

// What structure from motion makes of it: adjusted to the observations alone, in another world.
SfmModel Found(const Bundle& truth, const LensCamera& lens) {
  Bundle start = truth;
  start.lenses[0] = lens;
  AdjustOptions options;
  options.lens = LensFreedom::kFixed;
  return Moved(Adjust(start, options).bundle);
}

std::vector<Eigen::Vector3d> CentresOf(const SfmModel& model) {
  std::vector<Eigen::Vector3d> centres;
  for (const SfmImage& image : model.images) {
    centres.push_back(image.cam_from_world.TargetOriginInSource());
  }
  return centres;
}

std::vector<Eigen::Vector3d> CentresOf(const Bundle& bundle) {
  return CentresOf(ModelFrom(bundle));
}

// All places, with noise.
KnownMetres Places(const Bundle& truth, double noise_m, std::uint64_t seed = 3) {
  Random random(seed);
  KnownMetres known;
  for (const Eigen::Vector3d& centre : CentresOf(truth)) {
    const int image = static_cast<int>(known.places.size());
    known.places.push_back({image, centre + noise_m * Draw(random), 0, 0});
  }
  return known;
}

struct Held {
  MetricStart start;
  Refined refined;
};

Held Hold(const SfmModel& model, const KnownMetres& known, const RefineOptions& options = {}) {
  Held held;
  held.start = StartInMetres(model, known, options);
  held.refined = RefineInMetres(known, held.start);
  return held;
}

void ExpectRejection(const SfmModel& model, const KnownMetres& known, const std::string& words) {
  try {
    Hold(model, known);
    FAIL() << "nothing was rejected: " << words;
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr(words));
  }
}

// Root mean square distance of the cameras from the truth, as they are and carried there as a
// whole.
double OffM(const SfmModel& model, const Bundle& truth) {
  return AlignmentRms({}, CentresOf(model), CentresOf(truth));
}

double BentM(const SfmModel& model, const Bundle& truth) {
  const auto centres = CentresOf(model), places = CentresOf(truth);
  return AlignmentRms(AlignPoints(centres, places), centres, places);
}

// Root mean square error of the lengths of `steps` steps, as a share of them.
double StepErrors(const SfmModel& model, const Bundle& truth, size_t steps) {
  const auto found = CentresOf(model), true_ones = CentresOf(truth);
  double squares = 0;
  for (size_t i = steps; i < found.size(); ++i) {
    squares += std::pow(
        (found[i] - found[i - steps]).norm() / (true_ones[i] - true_ones[i - steps]).norm() - 1, 2);
  }
  return std::sqrt(squares / static_cast<double>(found.size() - steps));
}

// A lens of other distortion than the true one's bends the walk: steadily, in one direction.
LensCamera WrongLens(LensCamera lens) {
  lens.params[3] += 0.05;
  return lens;
}

// For docs/accuracy/CALIBRATION.md.
void Tell(const char* what, const SfmModel& model, const Held& held, const Bundle& truth) {
  std::printf(
      "%s: cameras off the truth, RMS: %.3f m as a whole, %.3f m refined and as a whole, %.3f m "
      "with "
      "positions held\n",
      what, BentM(model, truth), BentM(Refine(model, {}).model, truth),
      OffM(held.refined.model, truth));
}

TEST(RefineInMetres, GpsStraightensAWalkThatALensHasBent) {
  const Bundle truth = MakeBundle(Walk());
  const SfmModel model = Found(truth, WrongLens(truth.lenses[0]));
  const KnownMetres known = Places(truth, 0.1);
  const Held held = Hold(model, known);
  Tell("bent by the lens, positions to 0.1 m", model, held, truth);
  EXPECT_GT(BentM(model, truth), 0.3) << "not bent: the test tells nothing";
  EXPECT_LT(OffM(held.refined.model, truth), 0.25 * BentM(model, truth));
  EXPECT_THAT(held.start.report.left_out, IsEmpty());
  EXPECT_NEAR(held.start.report.metres_per_unit, kUnit, 0.01 * kUnit);
  // What these places were drawn with; found to some 15 %, as many as they are.
  double flat = 0, up = 0;
  const auto centres = CentresOf(truth);
  for (size_t i = 0; i < known.places.size(); ++i) {
    const Eigen::Vector3d error = known.places[i].position_m - centres[i];
    flat += error.head<2>().squaredNorm() / (2 * kChain);
    up += error.z() * error.z() / kChain;
  }
  EXPECT_NEAR(held.start.report.sigma_flat_m / std::sqrt(flat), 1, 0.15);
  EXPECT_NEAR(held.start.report.sigma_up_m / std::sqrt(up), 1, 0.15);
}

TEST(RefineInMetres, GpsHoldsAWalkThatNoiseHasBentWhateverTheLensesAreAllowed) {
  const Bundle truth = MakeBundle(Walk(4));
  const SfmModel model = Found(truth, truth.lenses[0]);
  for (const bool known : {false, true}) {
    RefineOptions options;
    if (known) options.known_lenses = {{1, truth.lenses[0]}};
    const Held held = Hold(model, Places(truth, 0.05), options);
    Tell("bent by noise, positions to 0.05 m", model, held, truth);
    EXPECT_LT(OffM(held.refined.model, truth), 0.5 * BentM(model, truth));
  }
}

TEST(RefineInMetres, BracketsOfOnePositionConvergeWithTheirPositions) {
  const Bundle truth = MakeBundle(testing::Brackets());
  const Held held = Hold(Moved(testing::Perturbed(truth, 0.005)), Places(truth, 0.1));
  EXPECT_LT(OffM(held.refined.model, truth), 0.1);
  EXPECT_LT(held.refined.solve.iterations, 150);
}

TEST(RefineInMetres, AWrongPlaceIsNamedAndLeftOut) {
  const Bundle truth = MakeBundle(Walk());
  const SfmModel model = Found(truth, WrongLens(truth.lenses[0]));
  KnownMetres known = Places(truth, 0.1);
  known.places[7].position_m += Eigen::Vector3d(0, 4, 0);
  known.places[30].position_m += Eigen::Vector3d(300, 0, 20);
  const Held held = Hold(model, known);
  Tell("bent by the lens, positions to 0.1 m and two wrong", model, held, truth);
  EXPECT_EQ(held.start.report.left_out, (std::vector<int>{7, 30}));
  EXPECT_LT(OffM(held.refined.model, truth), 0.25 * BentM(model, truth));
}

// What a receiver says of itself is taken: places that claim more are nearer.
TEST(RefineInMetres, StatedErrorsAreTaken) {
  const Bundle truth = MakeBundle(Walk());
  const SfmModel model = Found(truth, truth.lenses[0]);
  KnownMetres known = Places(truth, 0.02);
  for (KnownPlace& place : known.places) place.sigma_flat_m = place.sigma_up_m = 0.02;
  const Held held = Hold(model, known);
  EXPECT_EQ(held.start.report.sigma_flat_m, 0);
  for (const PositionPrior& p : held.start.options.positions) {
    EXPECT_EQ(p.sigma, Eigen::Vector3d::Constant(0.02));
  }
  EXPECT_LT(OffM(held.refined.model, truth), 0.02);
}

TEST(RefineInMetres, DistancesSetTheUnitAndStretchWhatHasShrunk) {
  constexpr double kTapeM = 0.005;
  double before = 0, after = 0;
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    SceneSpec spec = Walk(4);
    spec.seed = seed;
    const Bundle truth = MakeBundle(spec);
    const SfmModel model = Found(truth, truth.lenses[0]);
    const auto centres = CentresOf(truth);
    KnownMetres known;
    for (const auto& [a, b] : {std::pair(0, 13), std::pair(13, 26), std::pair(26, 39)}) {
      const double length_m =
          (centres[static_cast<size_t>(a)] - centres[static_cast<size_t>(b)]).norm();
      known.distances.push_back({"`distance`", a, b, length_m, kTapeM});
    }
    RefineOptions options;
    options.known_lenses = {{1, truth.lenses[0]}};
    options.covariance = seed == 1;
    const Held held = Hold(model, known, options);
    for (size_t i = 0; i < known.distances.size(); ++i) {
      EXPECT_NEAR(held.start.report.found_m[i], known.distances[i].length_m, 5 * kTapeM);
    }
    EXPECT_NEAR(held.start.report.relative_sigma, kTapeM / std::sqrt(3 * 13.0 * 13.0), 2e-5);
    before += std::pow(StepErrors(held.start.model, truth, 13), 2);
    after += std::pow(StepErrors(held.refined.model, truth, 13), 2);
    if (seed != 1) continue;
    const auto json = nlohmann::json::parse(ToJson(held.refined))["covariance"];
    EXPECT_EQ(json["gauge_freedom"], 6);
  }
  EXPECT_LT(after, 0.6 * before) << "between the ends of what was measured, too";
}

// Places that do not tell the scale are what they are beside a distance that does: they turn and
// shift the whole as far as they can, and bend nothing.
TEST(RefineInMetres, VaguePlacesTurnAndShiftWhatADistanceScales) {
  constexpr double kPlacesM = 1.5;
  const Bundle truth = MakeBundle({.points = 400, .noise_px = 0.3});
  const SfmModel model = Moved(truth);
  const auto centres = CentresOf(truth);
  const double length_m = (centres[0] - centres[7]).norm();
  double turns = 0;
  int kept = 0;
  constexpr int kDraws = 6;
  for (std::uint64_t seed = 1; seed <= kDraws; ++seed) {
    KnownMetres known = Places(truth, kPlacesM, seed);
    ExpectRejection(model, known, "scale: expected a scale known to 10 %, found one to ");
    known.distances = {{"`distance` A,B", 0, 7, length_m, 0.001}};
    const Held held = Hold(model, known);
    const MetricReport& report = held.start.report;
    EXPECT_FALSE(report.places_tell_scale);
    EXPECT_GT(report.places_relative_sigma, 0.1);
    EXPECT_NEAR(report.relative_sigma, 0.001 / length_m, 1e-4);
    EXPECT_TRUE(held.start.options.positions.empty()) << "they hold nothing";
    EXPECT_NEAR(held.start.places[0].sigma.x() / kPlacesM, 1, 0.7) << "of 24 numbers";
    EXPECT_LT(BentM(held.refined.model, truth), 0.01);
    const Similarity off = AlignPoints(CentresOf(held.refined.model), centres);
    EXPECT_NEAR(off.scale, 1, 0.005);
    const double turn_rad = Eigen::AngleAxisd(off.rotation).angle();
    turns += std::pow(turn_rad / report.turn_sigma_rad, 2) / kDraws;
    kept += static_cast<int>(held.start.places.size());
    known.distances[0].length_m = 10 * length_m;
    ExpectRejection(model, known, "expected a distance that agrees with the photos' GPS, found ");
  }
  // Three axes, of which the one known worst is predicted.
  EXPECT_GT(turns, 0.5);
  EXPECT_LT(turns, 3);
  EXPECT_GE(kept, 7 * kDraws);
}

TEST(RefineInMetres, TheGaugeIsThatOfThePlaces) {
  const Bundle truth = MakeBundle({.points = 400, .noise_px = 0.3});
  RefineOptions options;
  options.covariance = true;
  const Held held = Hold(ModelFrom(truth), Places(truth, 0.01), options);
  const auto json = nlohmann::json::parse(ToJson(held.refined))["covariance"];
  EXPECT_EQ(json["gauge_freedom"], 0);
  EXPECT_EQ(json["determined"], true);
}

TEST(RefineInMetres, TheSameForAnyNumberOfThreads) {
  const Bundle truth = MakeBundle({.points = 400, .noise_px = 0.3});
  RefineOptions options;
  std::optional<ThreadLimit> limit;
  limit.emplace(1);
  const Held one = Hold(ModelFrom(truth), Places(truth, 0.05), options);
  limit.emplace(4);
  const Held four = Hold(ModelFrom(truth), Places(truth, 0.05), options);
  EXPECT_EQ(ToJson(one.refined), ToJson(four.refined));
  EXPECT_EQ(CentresOf(one.refined.model), CentresOf(four.refined.model));
}

TEST(RefineInMetres, WhatContradictsIsRejected) {
  const Bundle truth = MakeBundle({.points = 400, .noise_px = 0.3});
  const SfmModel model = ModelFrom(truth);
  const auto centres = CentresOf(truth);
  const auto apart = [&](int a, int b) {
    return (centres[static_cast<size_t>(a)] - centres[static_cast<size_t>(b)]).norm();
  };
  KnownMetres known = Places(truth, 0.02);
  known.distances = {{"`distance` A,B", 0, 7, 1.5 * apart(0, 7), 0.01}};
  ExpectRejection(model, known,
                  "`distance` A,B: expected a distance that agrees with the photos' GPS");
  known.places.clear();
  known.distances = {{"one", 0, 7, apart(0, 7), 0.001}, {"other", 1, 6, 2 * apart(1, 6), 0.001}};
  ExpectRejection(model, known, "expected distances that agree");
  known.distances[1].length_m = 1.01 * apart(1, 6);
  ExpectRejection(model, known, "expected a distance that the photos agree with");
  // Places that claim what they do not keep: photos bend before such claims.
  known = Places(truth, 0.3);
  for (KnownPlace& place : known.places) place.sigma_flat_m = place.sigma_up_m = 1e-4;
  ExpectRejection(model, known,
                  "expected photos that agree with the positions and distances given");
  // Nothing to choose lenses by: nothing would be held.
  ExpectRejection(ModelFrom(MakeBundle({.points = 50})), Places(truth, 0.02),
                  "expected a model that positions and distances can constrain, found none");
}

}  // namespace
}  // namespace dtr::calib
