// Bundle adjustment where numbers, geometry or data are at their limits.
#include <algorithm>
#include <numbers>

#include "calib/validation/photos.h"
#include "cli/selftest/cases.h"
#include "datasets/exact/bundle.h"
#include "dtr/base/error.h"

namespace dtr::selftest {
namespace {

using calib::Adjust;
using calib::Adjusted;
using calib::AdjustOptions;
using calib::Bundle;
using calib::CameraModel;
using calib::LensCamera;
using calib::LensFreedom;
using calib::Similarity;
using testing::bundle::LargestDifference;
using testing::bundle::LookAt;
using testing::bundle::MakeBundle;
using testing::bundle::Moved;
using testing::bundle::Perturbed;
using testing::bundle::Projections;
using testing::bundle::SceneSpec;

constexpr const char* kBundleStage = "Bundle adjustment";

Adjusted Solve(const Bundle& start, LensFreedom lens, Outcome& outcome) {
  AdjustOptions options;
  options.lens = lens;
  Adjusted out = Adjust(start, options);
  for (const auto& point : out.bundle.points) outcome.LookAtAll(point);
  for (const auto& each : out.bundle.lenses) outcome.LookAtAll(each.params);
  for (const auto& image : out.bundle.images) {
    outcome.LookAtAll(image.cam_from_world.translation);
    outcome.LookAtAll(image.cam_from_world.rotation.coeffs());
  }
  outcome.Look(out.sigma_px);
  outcome.Look(out.rms_px);
  return out;
}

/// Largest change of a predicted pixel when the world is scaled and moved before the solve. The
/// start is off, by the same in both worlds: the solver has to find its way in either.
double ChangeInWorld(const Bundle& at_home, const Similarity& moved, Outcome& outcome) {
  const Bundle start = Perturbed(at_home, 0.01);
  const Adjusted here = Solve(start, LensFreedom::kAll, outcome);
  const Adjusted there = Solve(Moved(start, moved), LensFreedom::kAll, outcome);
  outcome.Add(AtLeast("way of the solve, px: the largest change of a predicted pixel",
                      LargestDifference(Projections(start), Projections(here.bundle)), 10,
                      "a start that is the solution would show nothing"));
  return LargestDifference(Projections(here.bundle), Projections(there.bundle));
}

Outcome Scaled(double scale) {
  Outcome outcome;
  Similarity scaled;
  scaled.scale = scale;
  const Bundle home = MakeBundle({.noise_px = 0.3});
  outcome.Add(AtMost("largest change of a predicted pixel, px",
                     ChangeInWorld(home, scaled, outcome), 1e-6,
                     "a millionth of a pixel: rounding, not another solution"));
  return outcome;
}

Outcome FarFromTheOrigin() {
  Outcome outcome;
  Similarity moved;
  moved.translation << 1e7, -1e7, 1e7;
  const Bundle home = MakeBundle({.noise_px = 0.3}), there = Moved(home, moved);
  // What writing the same world with its numbers rounded at 1e7 does to a pixel, without a solve.
  const double rounding_px = LargestDifference(Projections(home), Projections(there));
  outcome.Add(AtMost("change of a predicted pixel over that of writing the world at 1e7",
                     ChangeInWorld(home, moved, outcome) / rounding_px, 4,
                     "written once and solved: two roundings of poses, two of points"));
  outcome.Add(AtMost("that of writing the world at 1e7, px", rounding_px, 1e-5,
                     "positions at 1e7 are multiples of 2e-9; 900 px of focal length at 4 units"));
  return outcome;
}

/// Errors of a lens's parameters over those that noise of `noise_px` explains: RMS against noise.
void AddNoiseLevel(const Adjusted& out, double noise_px, Outcome& outcome) {
  outcome.Add(Exactly("converged", out.converged, 1, "the solver ends at a minimum"));
  outcome.Add(AtMost("sigma of the observations over the noise added", out.sigma_px / noise_px, 1.1,
                     "1 where the solution is the best one; 2000 observations scatter by 2 %"));
}

void AddFocalError(const Adjusted& out, double truth_px, double bound, const char* reason,
                   Outcome& outcome) {
  outcome.Add(AtMost("error of the focal length, share",
                     std::abs(out.bundle.lenses[0].params[0] / truth_px - 1), bound, reason));
}

// One focal length of 9000 px beside coefficients of 0.01; points from 4 to 40 000 units away; a
// start that is off.
Outcome MixedMagnitudes() {
  Outcome outcome;
  SceneSpec spec{.points = 400,
                 .lens = {CameraModel::kOpenCv,
                          8000,
                          6000,
                          {9000, 9020, 4010, 2990, -0.05, 0.01, 2e-4, -1e-4}},
                 .noise_px = 0.3};
  spec.point = [](Random& random) {
    const double x = random.Uniform(-2, 2), z = random.Uniform(-1.5, 1.5);
    const double far = random.Index(2) == 0 ? 1 : std::pow(10, random.Uniform(0, 4));
    return Eigen::Vector3d(x * far, random.Uniform(-2, 2) + 6 * (far - 1), z * far);
  };
  const Adjusted out = Solve(Perturbed(MakeBundle(spec), 0.01), LensFreedom::kAll, outcome);
  AddNoiseLevel(out, 0.3, outcome);
  AddFocalError(out, 9000, 1e-3, "0.3 px of noise in 2000 observations and more; seen: below 1e-4",
                outcome);
  return outcome;
}

Outcome NearlyFlat() {
  Outcome outcome;
  SceneSpec spec{.points = 400, .noise_px = 0.3};
  spec.point = [](Random& random) {  // a slab of 4 x 3 units, a thousandth thick
    const double x = random.Uniform(-2, 2), y = random.Uniform(-1e-3, 1e-3);
    return Eigen::Vector3d(x, y, random.Uniform(-1.5, 1.5));
  };
  const Adjusted out =
      Solve(Perturbed(MakeBundle(spec), 0.01), LensFreedom::kNoPrincipalPoint, outcome);
  AddNoiseLevel(out, 0.3, outcome);
  AddFocalError(out, 900, 0.01, "seen from directions 80 degrees apart, a plane gives it to 1 %",
                outcome);
  return outcome;
}

bool Names(const calib::PhotosValidation& validation, std::initializer_list<const char*> names) {
  return std::ranges::any_of(validation.degeneracies, [&](const calib::Degeneracy& d) {
    return std::ranges::any_of(names, [&](const char* name) { return d.name == name; });
  });
}

const LensCamera kPinhole{CameraModel::kSimplePinhole, 1000, 800, {900, 500, 400}};

/// What the validation says of data that cannot decide: a named reason and a failed test.
Outcome Undecided(const SceneSpec& spec, std::initializer_list<const char*> names) {
  Outcome outcome;
  const Bundle bundle = MakeBundle(spec);
  Solve(bundle, LensFreedom::kNoPrincipalPoint, outcome);
  const calib::PhotosValidation validation = calib::ValidatePhotos(bundle, {});
  for (const Check& test : validation.tests) outcome.not_finite += std::isnan(test.value);
  outcome.Add(Exactly("the validation names the degeneracy", Names(validation, names), 1,
                      "what the views cannot decide is reported, not guessed"));
  outcome.Add(Exactly("the validation passes the calibration", AllPassed(validation.tests), 0,
                      "numbers that nothing supports must not pass"));
  for (const calib::Degeneracy& d : validation.degeneracies) {
    if (d.harmful) outcome.rejection = d.name + ": " + d.detail;
  }
  return outcome;
}

Outcome FlatFacedSquarely() {
  SceneSpec spec{.images = 6, .points = 200, .lens = kPinhole, .noise_px = 0.3};
  spec.pose = [](int i, int) {  // parallel views of a wall: focal length and distance are one
    const Eigen::Vector3d c(0.5 * (i % 3) - 0.5, -6, 0.5 * (i / 3));
    return LookAt(c, c + Eigen::Vector3d::UnitY());
  };
  spec.point = [](Random& random) {
    const double x = random.Uniform(-2, 2);
    return Eigen::Vector3d(x, 0, random.Uniform(-1.5, 1.5));
  };
  return Undecided(spec, {"planar_scene"});
}

Outcome CentresOnALine() {
  Outcome outcome;
  SceneSpec spec{.images = 8, .points = 400, .lens = kPinhole, .noise_px = 0.3};
  spec.pose = [](int i, int) {
    return LookAt({-1.4 + 0.4 * i, -6 + 1e-6 * (i % 2), 1}, {0, 0, 0});
  };
  const Adjusted out =
      Solve(Perturbed(MakeBundle(spec), 0.01), LensFreedom::kNoPrincipalPoint, outcome);
  AddNoiseLevel(out, 0.3, outcome);
  AddFocalError(out, 900, 0.01, "the points are no line: everything is determined", outcome);
  return outcome;
}

// Points within a millionth of a line: every camera may turn about it.
Outcome PointsOnALine() {
  SceneSpec spec{.images = 6, .points = 200, .lens = kPinhole, .noise_px = 0.3};
  spec.point = [](Random& random) {
    const double y = 1e-6 * random.Normal();
    return Eigen::Vector3d(random.Uniform(-2, 2), y, 1e-6 * random.Normal());
  };
  return Undecided(spec, {"collinear_points"});
}

// 1 degree across: 57 296 px of focal length for 1000 px.
Outcome NarrowLens() {
  Outcome outcome;
  const double focal = 500 / std::tan(0.5 * std::numbers::pi / 180);
  SceneSpec spec{.points = 400,
                 .lens = {CameraModel::kSimplePinhole, 1000, 800, {focal, 500, 400}},
                 .noise_px = 0.3};
  spec.point = [](Random& random) {
    const double x = random.Uniform(-0.04, 0.04), y = random.Uniform(-0.04, 0.04);
    return Eigen::Vector3d(x, y, random.Uniform(-0.03, 0.03));
  };
  const Bundle truth = MakeBundle(spec);
  Bundle start = Perturbed(truth, 1e-3);  // some 20 px off in an image of 0.1 units
  start.lenses = truth.lenses;  // known: so narrow a lens cannot be told from its distance
  outcome.Add(AtLeast("largest error of a predicted pixel at the start, px",
                      LargestDifference(Projections(start), Projections(truth)), 10,
                      "a start that is the solution would show nothing"));
  const Adjusted out = Solve(start, LensFreedom::kFixed, outcome);
  AddNoiseLevel(out, 0.3, outcome);
  return outcome;
}

Outcome NarrowLensFree() {
  SceneSpec spec{.images = 3, .points = 200, .lens = kPinhole, .noise_px = 0.02};
  spec.pose = [](int i, int) {  // 0.1 degrees at the scene's distance
    const Eigen::Vector3d c(0.0052 * i, -6, 0.003 * (i == 1));
    return LookAt(c, {0, 0, 0});
  };
  return Undecided(spec, {"small_angles", "pure_rotation"});
}

// 190 degrees across: points beside and behind the cameras' plane, all around.
Outcome FisheyeOf190Degrees() {
  Outcome outcome;
  const double half = 95 * std::numbers::pi / 180, focal = 500 / half;
  SceneSpec spec{.points = 400,
                 .lens = {CameraModel::kOpenCvFisheye,
                          1000,
                          1000,
                          {focal, focal, 500, 500, 0.01, -0.002, 0, 0}},
                 .noise_px = 0.3};
  spec.pose = [](int i, int) {
    return LookAt({0.8 * (i % 3) - 0.8, 0.7 * (i / 3) - 0.7, 0.4 * (i % 2)},
                  {0.5 * (i % 2), 20, 0.3 * (i % 3)});
  };
  spec.point = [](Random& random) {
    const Eigen::Vector3d direction(random.Normal(), random.Normal(), random.Normal());
    return Eigen::Vector3d(direction.normalized() * random.Uniform(4, 8));
  };
  const Bundle truth = MakeBundle(spec);
  long long behind = 0;
  for (const auto& observation : truth.observations) {
    const Pose& pose = truth.images[static_cast<size_t>(observation.image)].cam_from_world;
    const Eigen::Vector3d p = truth.points[static_cast<size_t>(observation.point)].head<3>();
    behind += (pose * p).z() < 0;
  }
  outcome.Add(AtLeast("observations beyond 90 degrees", static_cast<double>(behind), 20,
                      "the case is about them"));
  const Adjusted out = Solve(Perturbed(truth, 0.01), LensFreedom::kNoPrincipalPoint, outcome);
  AddNoiseLevel(out, 0.3, outcome);
  AddFocalError(out, focal, 0.005, "observations all around leave the focal length no freedom",
                outcome);
  return outcome;
}

Outcome HalfAreOutliers() {
  Outcome outcome;
  Bundle spoiled = MakeBundle({.points = 400, .noise_px = 0.1});
  Random random(3);
  for (auto& observation : spoiled.observations) {
    if (random.Uniform() < 0.5) continue;
    const double x = random.Uniform(-80, 80);
    observation.pixel += Eigen::Vector2d(x, random.Uniform(-80, 80));
  }
  const Adjusted out = Solve(Perturbed(spoiled, 0.02), LensFreedom::kNoPrincipalPoint, outcome);
  outcome.Add(
      AtMost("sigma of the observations that count, px", out.sigma_px, 0.3,
             "0.1 px of noise, and wrong observations that agree by chance within 5 sigmas"));
  AddFocalError(out, 900, 5.0 / 900,
                "half of the observations decide as well as all, but for sqrt(2)", outcome);
  return outcome;
}

Outcome AMillionPixelsOff() {
  Outcome outcome;
  const Bundle clean = MakeBundle({.noise_px = 0.1});
  Bundle spoiled = clean;
  spoiled.observations[5].pixel.x() += 1e6;
  const Adjusted good = Solve(clean, LensFreedom::kAll, outcome);
  const Adjusted out = Solve(spoiled, LensFreedom::kAll, outcome);
  outcome.Add(Exactly("the observation counts", out.used[5], 0, "it agrees with nothing"));
  outcome.Add(AtMost("change of the focal length, px",
                     std::abs(out.bundle.lenses[0].params[0] - good.bundle.lenses[0].params[0]),
                     0.1, "one observation of 1600 less"));
  return outcome;
}

Outcome FocalThirtyPercentOff() {
  Outcome outcome;
  Bundle start = MakeBundle({});
  start.lenses[0].params[0] *= 1.3;
  const Adjusted out = Solve(start, LensFreedom::kAll, outcome);
  AddFocalError(out, 900, 1e-6, "exact observations: what is left is where the solver stops",
                outcome);
  return outcome;
}

Outcome AllThirtyPercentOff() {
  Outcome outcome;
  const Bundle truth = MakeBundle({.noise_px = 0.3});
  const Adjusted best = Solve(truth, LensFreedom::kNoPrincipalPoint, outcome);
  const Adjusted out = Solve(Perturbed(truth, 0.3), LensFreedom::kNoPrincipalPoint, outcome);
  AddNoiseLevel(out, 0.3, outcome);
  outcome.Add(AtMost("largest change of a predicted pixel, px",
                     LargestDifference(Projections(best.bundle), Projections(out.bundle)), 0.01,
                     "the same minimum; the solver stops when the cost falls by less than 1e-6 of "
                     "itself or so"));
  return outcome;
}

Outcome BrokenNumbers() {
  Outcome outcome;
  Bundle broken = MakeBundle({});
  broken.observations[3].pixel.x() = std::nan("");
  ExpectRejection(outcome, "an observation at NaN", [&] { Adjust(broken, {}); });
  return outcome;
}

}  // namespace

std::vector<Case> BundleCases() {
  const auto scaled = [](double scale) { return [scale]() { return Scaled(scale); }; };
  return {{kBundleStage, "world in a unit of 1e-6", true, scaled(1e-6)},
          {kBundleStage, "world in a unit of 1e6", true, scaled(1e6)},
          {kBundleStage, "world 1e7 units from its origin", true, FarFromTheOrigin},
          {kBundleStage, "mixed magnitudes: f 9000 px, depths 1 : 10 000", true, MixedMagnitudes},
          {kBundleStage, "nearly planar: a slab 4 x 3 x 0.002", true, NearlyFlat},
          {kBundleStage, "a plane faced squarely, intrinsics unknown", true, FlatFacedSquarely},
          {kBundleStage, "camera centres on a line", true, CentresOnALine},
          {kBundleStage, "points on a line", false, PointsOnALine},
          {kBundleStage, "a camera of 1 degree, known", true, NarrowLens},
          {kBundleStage, "rays 0.1 degrees apart, intrinsics unknown", true, NarrowLensFree},
          {kBundleStage, "a fisheye camera of 190 degrees", true, FisheyeOf190Degrees},
          {kBundleStage, "half of the observations are outliers, 2 % off at the start", true,
           HalfAreOutliers},
          {kBundleStage, "one observation a million pixels off", true, AMillionPixelsOff},
          {kBundleStage, "focal length 30 % off at the start", true, FocalThirtyPercentOff},
          {kBundleStage, "everything 30 % off at the start", true, AllThirtyPercentOff},
          {kBundleStage, "an observation that is no number", true, BrokenNumbers}};
}

}  // namespace dtr::selftest
