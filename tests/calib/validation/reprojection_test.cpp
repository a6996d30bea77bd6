#include "calib/validation/reprojection.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <unordered_map>

#include "calib/colmap/model_io.h"
#include "calib/triangulate.h"
#include "dtr/base/error.h"
#include "dtr/base/random.h"
#include "tests/support/on_threads.h"
#include "tests/support/test_data.h"

namespace dtr::calib {
namespace {

constexpr double kExactPx = 1e-9;     // exact observations, double; 2e-12 seen
constexpr double kPlazaPx = 1e-3;     // plaza/sparse is printed with 4 decimals; 1.6e-4 seen
constexpr double kNoiseShare = 0.05;  // sampling error of an RMS over 3600 residuals is 1.2 %
constexpr double kSameFigure = 1e-6;  // relative; 3e-8 seen at a UTM offset, 1e-10 for scales
constexpr double kDerivative = 1e-5;  // relative; central differences

struct Calibration {
  std::vector<PinholeCamera> cameras;
  std::vector<Pose> poses;
  std::vector<std::string> names;
  SparseScene scene;
  ValidationReport Validate(const ValidateLimits& limits = {}, int threads = 0) const {
    return OnThreads(threads,
                     [&] { return ValidateReprojection(cameras, poses, scene, limits, names); });
  }
};

Pose LookAt(const Eigen::Vector3d& center, const Eigen::Vector3d& target) {
  const Eigen::Vector3d z = (target - center).normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d rotation;
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  const Eigen::Quaterniond q(rotation);
  return {q, -(q * center)};
}

/// Cameras on a 90 degree arc of radius 5 around points in a ball of radius 1, all seen by all.
Calibration Arc(int views, int points, double noise_px, const Eigen::Vector3d& offset = {0, 0, 0},
                double scale = 1) {
  Random random(11);
  Calibration c;
  for (int i = 0; i < views; ++i) {
    const double t = std::numbers::pi / 2 * i / (views - 1);
    const Eigen::Vector3d center(5 * std::cos(t), 5 * std::sin(t), 1 + 0.3 * random.Normal());
    c.cameras.emplace_back(800, 600, 700, 710, 405, 296);
    c.poses.push_back(LookAt(scale * center + offset, offset));
    c.names.push_back("view" + std::to_string(i));
  }
  for (int i = 0; i < points; ++i) {
    c.scene.points.push_back({scale * Eigen::Vector3d(random.Uniform(-1, 1), random.Uniform(-1, 1),
                                                      random.Uniform(-1, 1)) +
                              offset});
  }
  for (int v = 0; v < views; ++v) {
    const auto view = static_cast<size_t>(v);
    for (int i = 0; i < points; ++i) {
      const auto& p = c.scene.points[static_cast<size_t>(i)].p_in_world;
      c.scene.observations.push_back(
          {v, i,
           *c.cameras[view].PixelFromCam(c.poses[view] * p) +
               noise_px * Eigen::Vector2d(random.Normal(), random.Normal())});
    }
  }
  return c;
}

/// A COLMAP model on its undistorted grid.
Calibration FromColmap(const std::filesystem::path& folder) {
  const SfmModel model = colmap::ReadModel(folder);
  Calibration c;
  std::unordered_map<std::uint64_t, int> index;
  for (const auto& [id, point] : model.points) {
    index[id] = static_cast<int>(c.scene.points.size());
    c.scene.points.push_back({point.p_in_world});
  }
  for (const SfmImage& image : model.images) {
    const LensCamera& lens = model.cameras.at(image.camera_id);
    const PinholeCamera camera = lens.Pinhole();
    for (const SfmFeature& feature : image.features) {
      if (feature.point_id == SfmFeature::kNoPoint) continue;
      c.scene.observations.push_back({static_cast<int>(c.cameras.size()),
                                      index.at(feature.point_id),
                                      *camera.PixelFromCam(*lens.RayFromPixel(feature.pixel))});
    }
    c.cameras.push_back(camera);
    c.poses.push_back(image.cam_from_world);
    c.names.push_back(image.name);
  }
  return c;
}

PinholeCamera Changed(const PinholeCamera& c, double focal_factor, double shift_px) {
  return {c.width_px(),         c.height_px(), c.fx_px() * focal_factor, c.fy_px() * focal_factor,
          c.cx_px() + shift_px, c.cy_px()};
}

Check Outcome(const ValidationReport& report, const std::string& name) {
  for (const Check& check : report.tests) {
    if (check.name == name) return check;
  }
  throw std::out_of_range(name);
}

std::string Failures(const ValidationReport& report) {
  std::string text;
  for (const Check& c : report.tests) {
    if (!c.passed) text += c.name + " " + std::to_string(c.value) + ": " + c.reason + "\n";
  }
  return text;
}

TEST(Triangulate, HandWorkedPointOfTwoCameras) {
  // Two cameras side by side, 2 apart, looking along z: the point (1, 0, 4) lies between them.
  const PinholeCamera camera(200, 100, 100, 100, 100, 50);
  const Pose left, right{Eigen::Quaterniond::Identity(), {-2, 0, 0}};
  const std::vector<Observation> observations{MakeObservation(camera, left, {125, 50}),
                                              MakeObservation(camera, right, {75, 50})};
  const Triangulation found = Triangulate(observations, -1);
  ASSERT_EQ(found.status, TriangulationStatus::kConverged);
  EXPECT_LT((found.p_in_world - Eigen::Vector3d(1, 0, 4)).norm(), 1e-12);
}

TEST(Triangulate, ParallelRaysFixNoPoint) {
  const PinholeCamera camera(200, 100, 100, 100, 100, 50);
  const Pose left, right{Eigen::Quaterniond::Identity(), {-2, 0, 0}};
  const std::vector<Observation> observations{MakeObservation(camera, left, {100, 50}),
                                              MakeObservation(camera, right, {100, 50})};
  EXPECT_EQ(Triangulate(observations, -1).status, TriangulationStatus::kDegenerate);
  EXPECT_EQ(Triangulate(observations, 0).status, TriangulationStatus::kDegenerate);
}

TEST(Triangulate, RaysThatPartHaveNoPointInFront) {
  const PinholeCamera camera(200, 100, 100, 100, 100, 50);
  // They meet behind: turned round, both cameras see each other's side instead.
  const Pose back{Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitY())),
                  {0, 0, -3}};
  const std::vector<Observation> observations{MakeObservation(camera, Pose{}, {100, 20}),
                                              MakeObservation(camera, back, {100, 80})};
  EXPECT_NE(Triangulate(observations, -1).status, TriangulationStatus::kConverged);
}

TEST(Triangulate, OneWrongObservationAmongManyDoesNotCarryThePointAway) {
  Calibration c = Arc(8, 1, 0);
  std::vector<Observation> observations;
  for (size_t i = 0; i < 8; ++i) {
    observations.push_back(
        MakeObservation(c.cameras[i], c.poses[i], c.scene.observations[i].pixel));
  }
  observations[3] = MakeObservation(c.cameras[3], c.poses[3],
                                    c.scene.observations[3].pixel + Eigen::Vector2d(40, -25));
  const Triangulation found = Triangulate(observations, -1);
  ASSERT_EQ(found.status, TriangulationStatus::kConverged);
  Eigen::Vector2d residual;
  ASSERT_TRUE(PixelResidual(observations[0], found.p_in_world, &residual, nullptr));
  EXPECT_LT(residual.norm(), 1.0);  // without Huber: 6.5 px
}

TEST(PixelResidual, DerivativeIsThatOfTheValue) {
  Random random(4);
  const Calibration c = Arc(4, 20, 0);
  for (const SparseObservation& o : c.scene.observations) {
    const auto view = static_cast<size_t>(o.view);
    const Observation observation = MakeObservation(c.cameras[view], c.poses[view], o.pixel);
    const Eigen::Vector3d p =
        c.scene.points[static_cast<size_t>(o.point)].p_in_world +
        0.1 * Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal());
    Eigen::Vector2d residual, up, down;
    Eigen::Matrix<double, 2, 3> jacobian;
    ASSERT_TRUE(PixelResidual(observation, p, &residual, &jacobian));
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d step = 1e-5 * Eigen::Vector3d::Unit(k);
      ASSERT_TRUE(PixelResidual(observation, p + step, &up, nullptr));
      ASSERT_TRUE(PixelResidual(observation, p - step, &down, nullptr));
      // The residual is observed minus predicted; the derivative is that of the prediction.
      EXPECT_LT(((up - down) / 2e-5 + jacobian.col(k)).norm(), kDerivative * jacobian.norm());
    }
  }
}

TEST(Validate, ExactObservationsLeaveNothing) {
  const ValidationReport report = Arc(6, 100, 0).Validate();
  EXPECT_TRUE(report.passed()) << Failures(report);
  EXPECT_EQ(report.held_out.count, 600);
  EXPECT_LT(report.held_out.worst_px, kExactPx);
  EXPECT_LT(report.stored.worst_px, kExactPx);
}

TEST(Validate, NoiseComesBackAsItWasPutIn) {
  constexpr double kNoisePx = 0.5;
  const ValidationReport report = Arc(12, 300, kNoisePx).Validate();
  EXPECT_TRUE(report.passed()) << Failures(report);
  // Stored points are true: the residual is the noise, sqrt(2) for two axes. Held out, the noise
  // of a point fixed by 11 others comes on top: for each axis about 3/22 of the variance.
  EXPECT_NEAR(report.stored.rms_px, kNoisePx * std::sqrt(2.0), kNoiseShare * kNoisePx);
  EXPECT_NEAR(report.held_out.rms_px, kNoisePx * std::sqrt(2.0 * (1 + 3.0 / 22)),
              kNoiseShare * kNoisePx);
}

TEST(Validate, NeitherOriginNorScaleOfTheWorldMatters) {
  const double reference = Arc(6, 100, 0.5).Validate().held_out.rms_px;
  for (const double scale : {1e-3, 1e3}) {
    EXPECT_NEAR(Arc(6, 100, 0.5, {0, 0, 0}, scale).Validate().held_out.rms_px / reference, 1,
                kSameFigure);
  }
  EXPECT_NEAR(Arc(6, 100, 0.5, {5e5, 4.5e6, 100}).Validate().held_out.rms_px / reference, 1,
              kSameFigure);
}

TEST(Validate, SameReportForAnyNumberOfThreads) {
  const Calibration c = Arc(6, 500, 0.7);
  EXPECT_EQ(ToJson(c.Validate({}, 1)), ToJson(c.Validate({}, 3)));
}

TEST(Validate, HalfAPixelOnKnownPosesIsASystematicMean) {
  Calibration c = Arc(6, 200, 0.3);
  for (auto& o : c.scene.observations) o.pixel += Eigen::Vector2d(0.5, 0.5);
  const ValidationReport report = c.Validate();
  EXPECT_FALSE(Outcome(report, "mean_residual_px").passed);
  EXPECT_NEAR(report.stored.mean_px.x(), 0.5, 0.03);
  EXPECT_NEAR(report.stored.mean_px.y(), 0.5, 0.03);
}

TEST(Validate, RegionsShowWhereTheLensDoesNotFit) {
  Calibration c = Arc(6, 400, 0);
  for (auto& o : c.scene.observations) {  // only the bottom right ninth is off
    if (o.pixel.x() > 800 * 2 / 3.0 && o.pixel.y() > 600 * 2 / 3.0) o.pixel.x() += 2;
  }
  const ValidationReport report = c.Validate();
  for (size_t i = 0; i < 8; ++i) {
    EXPECT_GT(report.regions[8].rms_px, 1.5 * report.regions[i].rms_px) << i;
  }
}

TEST(Validate, CountsWhatCannotBeTested) {
  Calibration c = Arc(4, 30, 0);
  // A point of two views, a feature matched twice in one image, and three observations from one
  // place.
  c.scene.points.push_back(c.scene.points[0]);
  c.scene.observations.push_back({0, 30, c.scene.observations[0].pixel});
  c.scene.observations.push_back({1, 30, c.scene.observations[30].pixel});
  c.scene.observations.push_back({1, 0, {3, 3}});
  for (int i = 0; i < 3; ++i) {
    c.cameras.push_back(c.cameras[0]);
    c.poses.push_back(c.poses[0]);
    c.poses.back().translation += Eigen::Vector3d(1e-3 * i, 0, 0);
    c.names.push_back("twin" + std::to_string(i));
    c.scene.observations.push_back({4 + i, 31, {400.0 - i * 0.1, 300}});
  }
  c.scene.points.push_back({{0, 0, 0}});
  const ValidationReport report = c.Validate();
  EXPECT_EQ(report.cameras[0].short_tracks, 1);
  EXPECT_EQ(report.cameras[1].short_tracks, 1);
  EXPECT_EQ(report.cameras[1].held_out.count, 30);
  EXPECT_EQ(report.cameras[5].weak_geometry, 1);
  EXPECT_EQ(report.held_out.count, 120);
  EXPECT_THAT(report.untested, ::testing::ElementsAre("twin0", "twin1", "twin2"));
  EXPECT_FALSE(Outcome(report, "cameras_untested").passed);
  EXPECT_NE(Outcome(report, "cameras_untested").reason.find("twin1"), std::string::npos);
}

TEST(Validate, StrictlyHeldOutCamerasAreKeptApartAndOthersAreNot) {
  Calibration c = Arc(8, 60, 0);
  // Without an observation: 2 and 5. With 7 observations, too few to evaluate: 3.
  std::erase_if(c.scene.observations, [](const SparseObservation& o) {
    return o.view == 2 || o.view == 5 || (o.view == 3 && o.point >= 7);
  });
  const auto validate = [&](std::vector<bool> held_out) {
    return ValidateReprojection(c.cameras, c.poses, c.scene, {}, c.names, held_out);
  };
  const ValidationReport open = validate({});
  EXPECT_THAT(open.untested, ::testing::ElementsAre("view2", "view3", "view5"));
  EXPECT_TRUE(open.kept_apart.empty());
  // A source without an observation, or a held-out camera with a few, is as suspect as before.
  const ValidationReport two = validate({false, false, true, true, true, false, false, false});
  EXPECT_THAT(two.untested, ::testing::ElementsAre("view3", "view5"));
  EXPECT_THAT(two.kept_apart, ::testing::ElementsAre("view2"));
  EXPECT_FALSE(Outcome(two, "cameras_untested").passed);

  std::erase_if(c.scene.observations, [](const SparseObservation& o) { return o.view == 3; });
  const ValidationReport all = validate({false, false, true, true, false, true, false, false});
  EXPECT_TRUE(all.passed()) << Failures(all);
  EXPECT_THAT(Outcome(all, "cameras_untested").reason, ::testing::HasSubstr("view2, view3, view5"));
  EXPECT_EQ(nlohmann::json::parse(ToJson(all))["kept_apart"].size(), 3u);
  EXPECT_THROW(validate({true}), Error);
}

TEST(Validate, NoEvidenceIsNotAPass) {
  Calibration c = Arc(4, 30, 0);
  c.scene.observations.clear();
  const ValidationReport report = c.Validate();
  EXPECT_FALSE(report.passed());
  const auto json = nlohmann::json::parse(ToJson(report));
  EXPECT_EQ(json["passed"], false);
  EXPECT_TRUE(json["tests"][0]["value"].is_null());
}

TEST(Validate, PointsBehindTheCamerasAreCounted) {
  Calibration c = Arc(4, 30, 0);
  for (int i = 0; i < 3; ++i) c.scene.points[static_cast<size_t>(i)].p_in_world *= -100;
  for (int i = 0; i < 3; ++i)
    c.scene.points[static_cast<size_t>(i)].p_in_world += 50 * Eigen::Vector3d(1, 1, 0);
  EXPECT_FALSE(Outcome(c.Validate(), "impossible_share").passed);
}

TEST(Validate, ImpossibleInputIsRejected) {
  const Calibration good = Arc(4, 10, 0);
  Calibration c = good;
  c.scene.observations[5].point = 10;
  EXPECT_THROW(c.Validate(), Error);
  c = good;
  c.scene.observations[5].view = -1;
  EXPECT_THROW(c.Validate(), Error);
  c = good;
  c.scene.observations[5].pixel.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(c.Validate(), Error);
  c = good;
  c.scene.points[2].p_in_world.z() = std::numeric_limits<double>::infinity();
  EXPECT_THROW(c.Validate(), Error);
  c = good;
  c.poses[1].translation.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(c.Validate(), Error);
  c = good;
  c.names.pop_back();
  EXPECT_THROW(c.Validate(), Error);
}

TEST(Validate, JsonSurvivesHostileNames) {
  Calibration c = Arc(4, 30, 0);
  c.names[1] = "\"}\xff\n<b>";
  const auto json = nlohmann::json::parse(ToJson(c.Validate()));
  EXPECT_EQ(json["cameras"].size(), 4u);
  EXPECT_EQ(json["passed"], true);
  for (const auto& test : json["tests"]) {
    for (const char* key : {"name", "value", "limit", "passed", "reason"}) {
      EXPECT_TRUE(test.contains(key)) << key;
    }
  }
}

/// One line per validation result: docs/accuracy/CALIBRATION.md's tables are made of them.
bool PassesTold(const char* what, const ValidationReport& report) {
  std::cout << "  " << what;
  for (const Check& c : report.tests) std::cout << "  " << c.name << " " << c.value;
  std::cout << (report.passed() ? "  passed\n" : "  FAILED\n");
  return report.passed();
}

/// The three real models: exact, good, and fair.
class RealModel : public ::testing::TestWithParam<const char*> {};

TEST_P(RealModel, PassesAsItIsAndFailsWhenSpoiled) {
  const auto folder = testing::DataFolder() / GetParam();
  DTR_REQUIRE_DATA(folder);
  const Calibration honest = FromColmap(folder);
  const ValidationReport report = honest.Validate();
  EXPECT_TRUE(PassesTold("as it is", report)) << Failures(report);

  Calibration c = honest;
  for (auto& camera : c.cameras) camera = Changed(camera, 1.02, 0);
  EXPECT_FALSE(PassesTold("focal length + 2 %, all cameras", c.Validate()));
  c = honest;
  c.cameras[3] = Changed(c.cameras[3], 1.02, 0);
  EXPECT_FALSE(PassesTold("focal length + 2 %, one camera", c.Validate()));
  c = honest;
  for (auto& camera : c.cameras) camera = Changed(camera, 1, 20);
  EXPECT_FALSE(PassesTold("principal point + 20 px, all cameras", c.Validate()));
  c = honest;
  c.cameras[3] = Changed(c.cameras[3], 1, 20);
  EXPECT_FALSE(PassesTold("principal point + 20 px, one camera", c.Validate()));
  c = honest;
  for (auto& o : c.scene.observations) o.pixel += Eigen::Vector2d(0.5, 0.5);
  const ValidationReport slipped = c.Validate();
  EXPECT_FALSE(PassesTold("half a pixel", slipped));
  EXPECT_FALSE(Outcome(slipped, "mean_residual_px").passed);
  c = honest;
  c.poses[5].rotation = Eigen::AngleAxisd(0.003, Eigen::Vector3d::UnitY()) * c.poses[5].rotation;
  EXPECT_FALSE(PassesTold("one camera turned by 0.17 degrees", c.Validate()));
  c = honest;
  std::swap(c.poses[3], c.poses[4]);
  const ValidationReport swapped = c.Validate();
  EXPECT_FALSE(PassesTold("two poses swapped", swapped));
  const std::string blamed = Outcome(swapped, "worst_camera_rms_px").reason;
  EXPECT_TRUE(blamed.find(c.names[3]) != std::string::npos ||
              blamed.find(c.names[4]) != std::string::npos)
      << blamed;
}

INSTANTIATE_TEST_SUITE_P(Shared, RealModel,
                         ::testing::Values("plaza/sparse", "sceaux_dense/sparse",
                                           "beer_colmap_model/sparse/0"));

TEST(Validate, PlazaIsExactToItsPrintedDigits) {
  const auto folder = testing::DataFolder() / "plaza" / "sparse";
  DTR_REQUIRE_DATA(folder);
  const ValidationReport report = FromColmap(folder).Validate();
  EXPECT_GT(report.held_out.count, 30000);
  EXPECT_LT(report.held_out.worst_px, kPlazaPx);
}

}  // namespace
}  // namespace dtr::calib
