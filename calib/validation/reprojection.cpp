#include "calib/validation/reprojection.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "calib/triangulate.h"
#include "dtr/base/error.h"
#include "dtr/base/order_statistics.h"
#include "dtr/base/parallel_for.h"

namespace dtr::calib {
namespace {

constexpr double kMinAngle =
    1.0 * std::numbers::pi / 180;  // COLMAP's stereo rejects below 1 degree
/// The point's predicted error in the tested camera, in units of the observation's own. At 2 the
/// residual of an honest camera is sqrt(1 + 4) = 2.2 times the noise at worst; beyond, residuals
/// tell about the triangulation and no longer about the camera.
constexpr double kMaxAmplification = 2.0;
/// Ratios between cameras are not looked at below this: feature detectors do no better.
constexpr double kFinePx = 0.25;
constexpr int kMinTrack = 3;  // two cameras to triangulate, one to test

enum class Fate { kRepeated, kShortTrack, kWeak, kImpossible, kTested };

/// Outcome for one observation.
struct ObservationTest {
  Fate fate = Fate::kRepeated;
  Eigen::Vector2d held_out_px = Eigen::Vector2d::Zero();
  bool stored_in_front = false;
  Eigen::Vector2d stored_px = Eigen::Vector2d::Zero();
};

void CheckInput(std::span<const PinholeCamera> cameras, std::span<const Pose> poses,
                const SparseScene& scene, std::span<const std::string> names,
                const std::vector<bool>& held_out) {
  if (cameras.size() != poses.size() || cameras.size() != names.size() ||
      (!held_out.empty() && held_out.size() != cameras.size())) {
    throw Error(
        fmt::format("validate: expected as many poses, names and roles as cameras ({}), found {}, "
                    "{} and {}",
                    cameras.size(), poses.size(), names.size(), held_out.size()));
  }
  for (size_t i = 0; i < poses.size(); ++i) {
    if (!poses[i].rotation.coeffs().allFinite() || !poses[i].translation.allFinite()) {
      throw Error(fmt::format("validate: camera {} has a pose that is not finite", names[i]));
    }
  }
  for (size_t i = 0; i < scene.points.size(); ++i) {
    if (!scene.points[i].p_in_world.allFinite()) {
      throw Error(fmt::format("validate: sparse point {} is not finite", i));
    }
  }
  for (size_t i = 0; i < scene.observations.size(); ++i) {
    const SparseObservation& o = scene.observations[i];
    if (o.view < 0 || o.view >= static_cast<int>(cameras.size()) || o.point < 0 ||
        o.point >= static_cast<int>(scene.points.size()) || !o.pixel.allFinite()) {
      throw Error(
          fmt::format("validate: observation {} names view {} of {} and point {} of {}; "
                      "check the sparse file",
                      i, o.view, cameras.size(), o.point, scene.points.size()));
    }
  }
}

/// Observations (indices) of each point, one per camera: of a feature matched twice in one image
/// the first counts, since the second would vouch for its own camera.
std::vector<std::vector<int>> Tracks(const SparseScene& scene) {
  std::vector<std::vector<int>> tracks(scene.points.size());
  for (size_t i = 0; i < scene.observations.size(); ++i) {
    const SparseObservation& o = scene.observations[i];
    std::vector<int>& track = tracks[static_cast<size_t>(o.point)];
    const bool again = std::any_of(track.begin(), track.end(), [&](int other) {
      return scene.observations[static_cast<size_t>(other)].view == o.view;
    });
    if (!again) track.push_back(static_cast<int>(i));
  }
  return tracks;
}

/// Largest angle between two rays of a track without one of its observations. The widest pair of
/// all answers for every observation not in it, so only its two members need a second search.
class WidestAngle {
 public:
  explicit WidestAngle(std::span<const Observation> observations) : observations_(observations) {
    Search(-1, &a_, &b_);
  }
  double Without(int left_out) const {
    int a = a_, b = b_;
    if (left_out == a || left_out == b) Search(left_out, &a, &b);
    if (a < 0) return 0;
    const Eigen::Vector3d &u = observations_[static_cast<size_t>(a)].direction,
                          &v = observations_[static_cast<size_t>(b)].direction;
    return std::atan2(u.cross(v).norm(), u.dot(v));
  }

 private:
  void Search(int left_out, int* a, int* b) const {
    double smallest = std::numeric_limits<double>::infinity();
    *a = *b = -1;
    for (int i = 0; i < static_cast<int>(observations_.size()); ++i) {
      for (int j = 0; j < i; ++j) {
        if (i == left_out || j == left_out) continue;
        const double cosine = observations_[static_cast<size_t>(i)].direction.dot(
            observations_[static_cast<size_t>(j)].direction);
        if (cosine < smallest) {
          smallest = cosine;
          *a = j;
          *b = i;
        }
      }
    }
  }
  std::span<const Observation> observations_;
  int a_ = -1, b_ = -1;
};

void TestTrack(std::span<const Observation> observations, std::span<ObservationTest*> tests) {
  if (observations.size() < kMinTrack) return;
  const WidestAngle widest(observations);
  for (size_t i = 0; i < observations.size(); ++i) {
    ObservationTest& test = *tests[i];
    const int left_out = static_cast<int>(i);
    if (widest.Without(left_out) < kMinAngle) {
      test.fate = Fate::kWeak;
      continue;
    }
    const Triangulation point = Triangulate(observations, left_out);
    if (point.status == TriangulationStatus::kDegenerate) {
      test.fate = Fate::kWeak;
      continue;
    }
    Eigen::Matrix<double, 2, 3> jacobian;
    if (point.status == TriangulationStatus::kBehind ||
        !PixelResidual(observations[i], point.p_in_world, &test.held_out_px, &jacobian)) {
      test.fate = Fate::kImpossible;
      continue;
    }
    const double amplification =
        std::sqrt((jacobian * point.covariance * jacobian.transpose()).trace() / 2);
    test.fate = amplification <= kMaxAmplification ? Fate::kTested : Fate::kWeak;
  }
}

size_t RegionOf(const PinholeCamera& camera, const Eigen::Vector2d& pixel) {
  const int row = CellOf(pixel.y(), camera.height_px(), kRegionsPerAxis);
  return static_cast<size_t>(row * kRegionsPerAxis +
                             CellOf(pixel.x(), camera.width_px(), kRegionsPerAxis));
}

/// The camera for which `value` is largest among those with enough observations; -1 if none.
template <typename Value>
int Worst(const std::vector<CameraValidation>& cameras, int min_count, const Value& value) {
  int worst = -1;
  for (int i = 0; i < static_cast<int>(cameras.size()); ++i) {
    if (cameras[static_cast<size_t>(i)].held_out.count < min_count) continue;
    if (worst < 0 ||
        value(cameras[static_cast<size_t>(i)]) > value(cameras[static_cast<size_t>(worst)])) {
      worst = i;
    }
  }
  return worst;
}

/// The worst camera's RMS in units of the typical one's: finds a single bad camera among good ones
/// long before it reaches an absolute limit.
Check OutOfLine(const ValidationReport& report, int worst, const ValidateLimits& limits) {
  std::vector<double> rms;
  for (const CameraValidation& camera : report.cameras) {
    if (camera.held_out.count >= limits.min_observations) rms.push_back(camera.held_out.rms_px);
  }
  if (rms.empty()) {
    return NotTested("worst_camera_ratio", limits.max_camera_ratio,
                     "no camera has enough observations to test");
  }
  const double typical = UpperMedian(rms);
  const CameraValidation& camera = report.cameras[static_cast<size_t>(worst)];
  return AtMost("worst_camera_ratio", camera.held_out.rms_px / std::max(typical, kFinePx),
                limits.max_camera_ratio,
                fmt::format("camera {}: RMS {:.3g} px where the typical camera has {:.3g} px",
                            camera.name, camera.held_out.rms_px, typical));
}

std::string Listed(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return list;
}

Check Untested(const ValidationReport& report, const ValidateLimits& limits) {
  const bool none = report.untested.empty();
  std::string reason = none ? fmt::format("every camera has at least {} tested observations",
                                          limits.min_observations)
                            : fmt::format("fewer than {} tested observations: {}",
                                          limits.min_observations, Listed(report.untested));
  if (!report.kept_apart.empty()) {
    reason += fmt::format("; not asked of held-out photos that took no part: {}",
                          Listed(report.kept_apart));
  }
  return AtMost("cameras_untested", static_cast<double>(report.untested.size()), 0,
                std::move(reason));
}

void AddTests(const ValidateLimits& limits, ValidationReport* report) {
  constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
  const ResidualStats& all = report->held_out;
  const ResidualStats& stored = report->stored;
  std::vector<Check>& tests = report->tests;

  tests.push_back(
      AtMost("held_out_rms_px", all.count > 0 ? all.rms_px : kNothing, limits.max_rms_px,
             fmt::format("{} observations predicted from the other cameras; median {:.3g} "
                         "px, 95 % within {:.3g} px, worst {:.3g} px",
                         all.count, all.median_px, all.p95_px, all.worst_px)));
  const int worst = Worst(report->cameras, limits.min_observations,
                          [](const CameraValidation& c) { return c.held_out.rms_px; });
  tests.push_back(
      worst < 0
          ? NotTested("worst_camera_rms_px", limits.max_camera_rms_px,
                      "no camera has enough observations to test")
          : AtMost("worst_camera_rms_px",
                   report->cameras[static_cast<size_t>(worst)].held_out.rms_px,
                   limits.max_camera_rms_px,
                   fmt::format("camera {}", report->cameras[static_cast<size_t>(worst)].name)));
  tests.push_back(OutOfLine(*report, worst, limits));
  tests.push_back(AtMost("stored_rms_px", stored.count > 0 ? stored.rms_px : kNothing,
                         limits.max_stored_rms_px,
                         fmt::format("{} observations of the points as stored", stored.count)));
  tests.push_back(AtMost("mean_residual_px", stored.count > 0 ? stored.mean_px.norm() : kNothing,
                         limits.max_mean_px,
                         fmt::format("stored points miss by ({:.3g}, {:.3g}) px on average; half a "
                                     "pixel would mean a wrong pixel convention",
                                     stored.mean_px.x(), stored.mean_px.y())));
  const int shifted = Worst(report->cameras, limits.min_observations,
                            [](const CameraValidation& c) { return c.stored.mean_px.norm(); });
  if (shifted >= 0) {
    const CameraValidation& camera = report->cameras[static_cast<size_t>(shifted)];
    tests.push_back(AtMost("worst_camera_mean_residual_px", camera.stored.mean_px.norm(),
                           limits.max_camera_mean_px,
                           fmt::format("camera {}: ({:.3g}, {:.3g}) px on average", camera.name,
                                       camera.stored.mean_px.x(), camera.stored.mean_px.y())));
  }
  int impossible = 0;
  for (const CameraValidation& camera : report->cameras) impossible += camera.impossible;
  const int judged = impossible + all.count;
  tests.push_back(AtMost("impossible_share",
                         judged > 0 ? static_cast<double>(impossible) / judged : kNothing,
                         limits.max_impossible_share,
                         fmt::format("{} of {} observations have no point in front of the cameras "
                                     "that explains them",
                                     impossible, judged)));
  tests.push_back(Untested(*report, limits));
}

/// Every n-th of the arrows, so that no more than kMaxArrows are left.
void ThinOut(std::vector<ResidualArrow>& arrows) {
  const size_t step = (arrows.size() + kMaxArrows - 1) / kMaxArrows;
  if (step < 2) return;
  size_t kept = 0;
  for (size_t i = 0; i < arrows.size(); i += step) arrows[kept++] = arrows[i];
  arrows.resize(kept);
}

}  // namespace

ValidationReport ValidateReprojection(std::span<const PinholeCamera> cameras,
                                      std::span<const Pose> cam_from_world,
                                      const SparseScene& scene, const ValidateLimits& limits,
                                      std::span<const std::string> names,
                                      const std::vector<bool>& held_out) {
  CheckInput(cameras, cam_from_world, scene, names, held_out);
  const std::vector<std::vector<int>> tracks = Tracks(scene);
  std::vector<ObservationTest> tests(scene.observations.size());

  constexpr int kBlock = 64;  // points per work item, so that handing out costs nothing
  const int points = static_cast<int>(tracks.size());
  ParallelFor(0, (points + kBlock - 1) / kBlock, [&](int block) {
    for (int p = block * kBlock; p < std::min(points, (block + 1) * kBlock); ++p) {
      std::vector<Observation> observations;
      std::vector<ObservationTest*> track_tests;
      for (const int index : tracks[static_cast<size_t>(p)]) {
        const SparseObservation& o = scene.observations[static_cast<size_t>(index)];
        const auto view = static_cast<size_t>(o.view);
        observations.push_back(MakeObservation(cameras[view], cam_from_world[view], o.pixel));
        track_tests.push_back(&tests[static_cast<size_t>(index)]);
        ObservationTest& test = *track_tests.back();
        test.fate = Fate::kShortTrack;
        test.stored_in_front =
            PixelResidual(observations.back(), scene.points[static_cast<size_t>(p)].p_in_world,
                          &test.stored_px, nullptr);
      }
      TestTrack(observations, track_tests);
    }
  });

  ValidationReport report;
  report.cameras.resize(cameras.size());
  std::vector<std::vector<Eigen::Vector2d>> predicted(cameras.size()), stored(cameras.size());
  std::vector<Eigen::Vector2d> all_predicted, all_stored;
  std::vector<bool> observed(cameras.size(), false);
  std::array<std::vector<Eigen::Vector2d>, kRegionsPerAxis * kRegionsPerAxis> regions;
  for (size_t i = 0; i < tests.size(); ++i) {
    const auto view = static_cast<size_t>(scene.observations[i].view);
    const ObservationTest& test = tests[i];
    CameraValidation& camera = report.cameras[view];
    observed[view] = true;
    if (test.fate == Fate::kRepeated) continue;
    camera.short_tracks += test.fate == Fate::kShortTrack;
    camera.weak_geometry += test.fate == Fate::kWeak;
    camera.impossible += test.fate == Fate::kImpossible || !test.stored_in_front;
    if (test.fate == Fate::kTested) {
      predicted[view].push_back(test.held_out_px);
      all_predicted.push_back(test.held_out_px);
      camera.arrows.push_back({scene.observations[i].pixel, -test.held_out_px});
      regions[RegionOf(cameras[view], scene.observations[i].pixel)].push_back(test.held_out_px);
    }
    if (test.stored_in_front) {
      stored[view].push_back(test.stored_px);
      all_stored.push_back(test.stored_px);
    }
  }
  for (size_t i = 0; i < cameras.size(); ++i) {
    CameraValidation& camera = report.cameras[i];
    camera.name = names[i];
    camera.held_out = Summarise(predicted[i]);
    camera.stored = Summarise(stored[i]);
    ThinOut(camera.arrows);
    if (camera.held_out.count >= limits.min_observations) continue;
    const bool apart = !held_out.empty() && held_out[i] && !observed[i];
    (apart ? report.kept_apart : report.untested).push_back(camera.name);
  }
  report.held_out = Summarise(all_predicted);
  report.stored = Summarise(all_stored);
  for (size_t i = 0; i < regions.size(); ++i) report.regions[i] = Summarise(regions[i]);
  AddTests(limits, &report);
  return report;
}

}  // namespace dtr::calib
