// tests/calib/validation/injected_faults.h -- honest calibrations, and ones spoiled in known ways
// by known amounts, drawn by seed.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <initializer_list>
#include <limits>
#include <string>
#include <vector>

#include "calib/validation/boards.h"
#include "calib/validation/projection.h"
#include "dtr/base/error.h"
#include "tests/calib/fault_tally.h"
#include "tests/calib/solve/synthetic_rig.h"

namespace dtr::calib::testing {

using dtr::testing::BrokenTest;
using dtr::testing::BrokenTests;
using dtr::testing::Tally;

inline constexpr double kCornerNoisePx = 0.1;

enum class FaultInjection {
  kFocal,
  kCentre,
  kDistortion,
  kSwappedCameras,
  kMovedCamera,
  kMirroredBoard,
  kSquareSize,
  kRollingShutter,
  kTimeOffset,
  kRepeatedViews,
  kFewViews,
  kClusteredViews,
  kFrontoParallel,
  kPureRotation,
  kZoomedViews,
  kExtraFreedom,
};
inline constexpr int kFaultInjections = 16;

/// A calibration to evaluate, and what should come of it.
struct FaultInjectionCase {
  std::string name, expected;  ///< the test that must break; "": any
  /// By which the test's figure is expected to exceed what noise makes of it, in its own sigmas;
  /// infinite for what is counted, not measured.
  double predicted_sigmas = std::numeric_limits<double>::infinity();
  ValidatedCalibration calibration;
  std::string refused;  ///< the solve named the degeneracy, so that there is no calibration
};

/// What is true, and the views that a solve is given.
struct Scene {
  std::vector<RigCamera> cameras;
  std::vector<RigView> views;  ///< exact
  std::vector<Pose> rig_from_board;
  bool moving = false;
};

inline Scene OneCamera(int count, std::uint64_t seed, double tilt_deg = 40) {
  const BoardModel models[] = {BoardModel::kBrown4, BoardModel::kPinhole, BoardModel::kBrown5};
  const BoardModel model = models[HashOf(seed, 3) % 3];
  Scene scene;
  scene.cameras.push_back({"cam", model, TypicalCamera(model), {}});
  const auto exact = ExactViews(scene.cameras[0].camera, count, seed, tilt_deg);
  for (const BoardView& view : exact.views) {
    scene.views.push_back({0, scene.views.size(), view, {}});
  }
  scene.rig_from_board = exact.cam_from_board;
  return scene;
}

inline Scene ThreeCameras(size_t frames, std::uint64_t seed, bool moving) {
  Scene scene;
  scene.cameras = RowOfCameras(3, 0.1);
  Rig rig = ExactRig(scene.cameras, frames, seed, moving, 2);
  scene.views = std::move(rig.views);
  scene.rig_from_board = std::move(rig.rig_from_board);
  scene.moving = moving;
  return scene;
}

inline RigSolution SolveScene(const Scene& scene, double noise_px, std::uint64_t seed) {
  Rig rig;
  rig.views = scene.views;
  RigOptions options;
  options.solve.cover_image = false;
  // Exact views stand for what noise is added to: their systematic errors are no outliers.
  if (noise_px == 0) options.solve.loss = Loss::kQuadratic;
  return SolveRig(kBoard, InputsOf(scene.cameras), NoisyViews(rig, noise_px, seed),
                  scene.rig_from_board.size(), options);
}

inline ValidatedCalibration CalibrationOf(const RigSolution& solution) {
  ValidatedCalibration calibration;
  calibration.board = kBoard;
  calibration.cameras = solution.rig.cameras;
  calibration.kept = solution.rig.views;
  calibration.kept_frames = solution.rig.rig_from_board.size();
  return calibration;
}

/// Where a board seen at `pose` is drawn, corner by corner, when its pose is another for each.
template <typename PoseAt>
void Redraw(const Scene& scene, const PoseAt& pose_at, RigView& view) {
  const RigCamera& camera = scene.cameras[view.camera];
  const LensMap lens(camera.camera);
  for (BoardCorner& corner : view.seen.corners) {
    const Pose rig_from_board = pose_at(corner);
    const auto pixel =
        lens.PixelFromCam(camera.cam_from_rig * (rig_from_board * kBoard.Corner(corner.id)));
    if (pixel) corner.pixel = *pixel;
  }
}

inline Pose Between(const Pose& a, const Pose& b, double share) {
  return {a.rotation.slerp(share, b.rotation), (1 - share) * a.translation + share * b.translation};
}

// How far beyond what noise does a pattern of exact views carries the F statistic of noisy ones, in
// its standard deviations; no more than the amplitude is beyond its own limit, five to one.
inline double PredictedSigmas(double amplitude_px, int freedom, int corners, double limit_px) {
  const double noncentrality =
      2.0 * corners * amplitude_px * amplitude_px / (kCornerNoisePx * kCornerNoisePx);
  const double sigmas = noncentrality / std::sqrt(2.0 * freedom);
  return std::min(sigmas, 5 * amplitude_px / limit_px);
}

// Moves unknowns of one camera by a drawn multiple of their standard deviations.
inline void Shift(const RigSolution& solution, std::initializer_list<int> indices, int at,
                  int count, Random& random, FaultInjectionCase& out,
                  const std::function<void(const Eigen::VectorXd&)>& apply) {
  Eigen::VectorXd shift = Eigen::VectorXd::Zero(solution.layout.size());
  const double sigmas = random.Uniform(1, 25);
  for (const int i : indices) {
    shift[i] = (random.Uniform() < 0.5 ? -1 : 1) * sigmas * std::sqrt(solution.covariance(i, i));
  }
  const Eigen::MatrixXd block = solution.covariance.block(at, at, count, count);
  const Eigen::VectorXd part = shift.segment(at, count);
  out.predicted_sigmas = std::sqrt(part.dot(block.inverse() * part));
  apply(shift);
}

inline void ShiftLens(const RigSolution& solution, std::initializer_list<int> which, Random& random,
                      FaultInjectionCase& out) {
  out.expected = "lens_difference_sigmas";
  out.calibration = CalibrationOf(solution);
  const int count = FreeParameterCount(solution.rig.cameras[0].model);
  Shift(solution, which, 0, count, random, out, [&](const Eigen::VectorXd& shift) {
    for (int i = 0; i < count; ++i) {
      out.calibration.cameras[0].camera.params[static_cast<size_t>(i)] += shift[i];
    }
  });
}

// Solves what may be degenerate; a solve that names why it rejects is a catch.
inline void SolveOrNameIt(const Scene& scene, std::uint64_t seed, FaultInjectionCase& out) {
  try {
    out.calibration = CalibrationOf(SolveScene(scene, kCornerNoisePx, seed));
  } catch (const Error& error) {
    out.refused = error.what();
  }
}

inline Scene FlatBoards(std::uint64_t seed, bool of_one_position) {
  Scene scene;
  scene.cameras.push_back({"cam", BoardModel::kPinhole, TypicalCamera(BoardModel::kPinhole), {}});
  Random random(seed);
  for (size_t i = 0; i < 15; ++i) {
    Pose pose;
    const double turn = of_one_position ? random.Uniform(-3, 3) : random.Uniform(-0.3, 0.3);
    const double tilt = random.Uniform(0, 3) * 3.14159 / 180;
    pose.rotation = Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitX()) *
                    Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ());
    const double share = of_one_position ? 0 : 1;
    pose.translation =
        Eigen::Vector3d(0.12 * share * random.Uniform(-1, 1), 0.08 * share * random.Uniform(-1, 1),
                        0.6 + 0.1 * share * random.Uniform(-1, 1)) -
        pose.rotation * MiddleOf(kBoard);
    RigView view{0, i, {"view" + std::to_string(i), {}, 0}, {}};
    for (int id = 0; id < kBoard.CornerCount(); ++id)
      view.seen.corners.push_back({id, Eigen::Vector2d::Zero()});
    scene.rig_from_board.push_back(pose);
    Redraw(
        scene, [&](const BoardCorner&) { return pose; }, view);
    scene.views.push_back(std::move(view));
  }
  return scene;
}

inline Scene Clustered(std::uint64_t seed) {
  Scene scene = OneCamera(400, seed, 40);
  Scene near;
  near.cameras = scene.cameras;
  for (size_t i = 0; i < scene.views.size() && near.views.size() < 14; ++i) {
    RigView view = scene.views[i];
    const bool inside = std::all_of(
        view.seen.corners.begin(), view.seen.corners.end(),
        [](const BoardCorner& corner) { return corner.pixel.x() < 420 && corner.pixel.y() < 300; });
    if (!inside) continue;
    view.frame = near.views.size();
    near.rig_from_board.push_back(scene.rig_from_board[i]);
    near.views.push_back(std::move(view));
  }
  return near;
}

// A quarter of the views are zoomed.
inline Scene Zoomed(std::uint64_t seed, double zoom) {
  Scene scene = OneCamera(20, seed);
  const std::vector<double>& params = scene.cameras[0].camera.params;
  const Eigen::Vector2d centre(params[2], params[3]);
  for (size_t i = 0; i < scene.views.size(); i += 4) {
    for (BoardCorner& corner : scene.views[i].seen.corners) {
      corner.pixel = centre + zoom * (corner.pixel - centre);
    }
  }
  return scene;
}

// A fisheye's four coefficients, of corners in the middle of the image alone.
inline Scene MiddleOfFisheye(std::uint64_t seed, double outermost_px) {
  Scene scene;
  const LensCamera camera = TypicalCamera(BoardModel::kFisheye);
  scene.cameras.push_back({"cam", BoardModel::kFisheye, camera, {}});
  const auto exact = ExactViews(camera, 24, seed, 40);
  scene.rig_from_board = exact.cam_from_board;
  for (size_t frame = 0; frame < exact.views.size(); ++frame) {
    BoardView view = exact.views[frame];
    std::erase_if(view.corners, [&](const BoardCorner& corner) {
      return (corner.pixel - Eigen::Vector2d(320, 240)).norm() > outermost_px;
    });
    if (view.corners.size() >= 9) scene.views.push_back({0, frame, std::move(view), {}});
  }
  return scene;
}

inline void RollingShutter(std::uint64_t seed, Random& random, FaultInjectionCase& out) {
  Scene scene = OneCamera(20, seed);
  const double speed = random.Uniform(0.0005, 0.012);  // of the way to the board, per image
  for (RigView& view : scene.views) {
    const Pose pose = scene.rig_from_board[view.frame];
    const Eigen::Vector3d way =
        speed * pose.translation.norm() *
        Eigen::Vector3d(random.Normal(), random.Normal(), 0.5 * random.Normal());
    const Eigen::Vector3d turn =
        2 * speed * Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal());
    Redraw(
        scene,
        [&](const BoardCorner& corner) {
          const double late = corner.pixel.y() / 480 - 0.5;
          const Eigen::Vector3d w = late * turn;
          Pose moved = pose;
          moved.rotation = Eigen::AngleAxisd(w.norm(), w.normalized()) * pose.rotation;
          moved.translation = pose.translation + late * way;
          return moved;
        },
        view);
  }
  out.expected = "rolling_shutter_px";
  const RigSolution exact = SolveScene(scene, 0, 0);
  const PatternTest test = TestRollingShutter(kBoard, exact);
  out.predicted_sigmas =
      PredictedSigmas(test.amplitude_px, test.freedom, exact.corners, BoardLimits{}.max_pattern_px);
  out.calibration = CalibrationOf(SolveScene(scene, kCornerNoisePx, seed));
}

inline void TimeOffset(std::uint64_t seed, Random& random, FaultInjectionCase& out) {
  Scene scene = ThreeCameras(24, seed, true);
  const double late = random.Uniform(0.002, 0.05);
  for (RigView& view : scene.views) {
    if (view.camera != 2 || view.frame + 1 >= scene.rig_from_board.size()) continue;
    const Pose pose =
        Between(scene.rig_from_board[view.frame], scene.rig_from_board[view.frame + 1], late);
    Redraw(
        scene, [&](const BoardCorner&) { return pose; }, view);
  }
  out.expected = "time_offset_sigmas";
  const PatternTest exact = TestTimeOffset(SolveScene(scene, 0, 0));
  out.calibration = CalibrationOf(SolveScene(scene, kCornerNoisePx, seed));
  const PatternTest noisy = TestTimeOffset(SolveScene(scene, kCornerNoisePx, seed));
  out.predicted_sigmas = std::min(std::abs(exact.coefficients.at(1)) / noisy.sigmas.at(1),
                                  5 * exact.effects_px.at(1) / BoardLimits{}.max_pattern_px);
}

inline FaultInjectionCase Spoiled(FaultInjection kind, std::uint64_t seed) {
  Random random(HashOf(seed, 0x5ab0));
  FaultInjectionCase out;
  switch (kind) {
    case FaultInjection::kFocal:
      out.name = "focal length";
      ShiftLens(SolveScene(OneCamera(20, seed), kCornerNoisePx, seed), {0, 1}, random, out);
      break;
    case FaultInjection::kCentre:
      out.name = "principal point";
      ShiftLens(SolveScene(OneCamera(20, seed), kCornerNoisePx, seed), {2, 3}, random, out);
      break;
    case FaultInjection::kDistortion: {
      out.name = "distortion";
      Scene scene = OneCamera(20, 3 * (seed / 3));
      if (scene.cameras[0].model == BoardModel::kPinhole) scene = OneCamera(20, seed + 1);
      for (std::uint64_t s = seed; scene.cameras[0].model == BoardModel::kPinhole; ++s) {
        scene = OneCamera(20, s);
      }
      ShiftLens(SolveScene(scene, kCornerNoisePx, seed), {4}, random, out);
      break;
    }
    case FaultInjection::kSwappedCameras: {
      out.name = "swapped cameras";
      out.expected = "place_difference_sigmas";
      out.calibration =
          CalibrationOf(SolveScene(ThreeCameras(16, seed, false), kCornerNoisePx, seed));
      auto& cameras = out.calibration.cameras;
      std::swap(cameras[1].cam_from_rig, cameras[2].cam_from_rig);
      break;
    }
    case FaultInjection::kMovedCamera: {
      out.name = "moved camera";
      out.expected = "place_difference_sigmas";
      const RigSolution solution = SolveScene(ThreeCameras(16, seed, false), kCornerNoisePx, seed);
      out.calibration = CalibrationOf(solution);
      const int at = solution.layout.PlaceAt(1);
      Shift(solution, {at + 1}, at, 6, random, out, [&](const Eigen::VectorXd& shift) {
        const Eigen::Vector3d w = shift.segment<3>(at);
        Pose& place = out.calibration.cameras[1].cam_from_rig;
        place.rotation = Eigen::AngleAxisd(w.norm(), w.normalized()) * place.rotation;
      });
      break;
    }
    case FaultInjection::kMirroredBoard: {
      out.name = "mirrored board";
      out.expected = "boards_from_behind";
      Scene scene = OneCamera(20, seed);
      for (RigView& view : scene.views) {
        for (BoardCorner& corner : view.seen.corners) {
          corner.id += kBoard.columns - 1 - 2 * (corner.id % kBoard.columns);
        }
        std::sort(view.seen.corners.begin(), view.seen.corners.end(),
                  [](const auto& a, const auto& b) { return a.id < b.id; });
      }
      SolveOrNameIt(scene, seed, out);
      break;
    }
    case FaultInjection::kSquareSize: {
      out.name = "square size of a rig";
      out.expected = "rig_scale_sigmas";
      const RigSolution solution = SolveScene(ThreeCameras(16, seed, false), kCornerNoisePx, seed);
      out.calibration = CalibrationOf(solution);
      Eigen::VectorXd direction = Eigen::VectorXd::Zero(solution.layout.size());
      for (size_t c = 1; c < 3; ++c) {
        direction.segment<3>(solution.layout.PlaceAt(c) + 3) =
            solution.rig.cameras[c].cam_from_rig.translation;
      }
      const double sigma =
          std::sqrt(direction.dot(solution.covariance * direction)) / direction.squaredNorm();
      out.predicted_sigmas = random.Uniform(1, 25);
      for (size_t c = 1; c < 3; ++c) {
        out.calibration.cameras[c].cam_from_rig.translation *= 1 + out.predicted_sigmas * sigma;
      }
      break;
    }
    case FaultInjection::kRollingShutter:
      out.name = "rolling shutter";
      RollingShutter(seed, random, out);
      break;
    case FaultInjection::kTimeOffset:
      out.name = "time offset";
      TimeOffset(seed, random, out);
      break;
    case FaultInjection::kRepeatedViews: {
      out.name = "repeated views";
      out.expected = "repeated_views";
      const RigSolution solution = SolveScene(OneCamera(12, seed), kCornerNoisePx, seed);
      out.calibration = CalibrationOf(solution);
      const size_t more = 1 + static_cast<size_t>(random.Index(8));
      for (size_t i = 0; i < more; ++i) {
        RigView view = out.calibration.kept[i];
        view.frame = out.calibration.kept_frames++;
        view.seen.name += " again";
        out.calibration.kept.push_back(std::move(view));
      }
      break;
    }
    case FaultInjection::kFewViews:
      out.name = "few views";
      out.expected = "min_views";
      SolveOrNameIt(OneCamera(4 + random.Index(4), seed), seed, out);
      break;
    case FaultInjection::kClusteredViews:
      out.name = "clustered views";
      out.expected = "min_coverage";
      SolveOrNameIt(Clustered(seed), seed, out);
      break;
    case FaultInjection::kFrontoParallel:
      out.name = "fronto-parallel boards";
      out.expected = "min_tilt_deg";
      SolveOrNameIt(FlatBoards(seed, false), seed, out);
      break;
    case FaultInjection::kPureRotation:
      out.name = "board turned in its plane";
      out.expected = "min_tilt_deg";
      SolveOrNameIt(FlatBoards(seed, true), seed, out);
      break;
    case FaultInjection::kZoomedViews:
      out.name = "zoomed views";
      SolveOrNameIt(Zoomed(seed, random.Uniform(1.01, 1.2)), seed, out);
      break;
    case FaultInjection::kExtraFreedom:
      out.name = "terms that the corners leave open";
      out.expected = "undetermined_terms";
      SolveOrNameIt(MiddleOfFisheye(seed, random.Uniform(100, 140)), seed, out);
      break;
  }
  return out;
}

inline FaultInjectionCase Honest(std::uint64_t seed) {
  FaultInjectionCase out;
  const int kind = static_cast<int>(HashOf(seed, 1) % 3);
  out.name = kind == 0 ? "one camera" : kind == 1 ? "rig" : "moving rig";
  const Scene scene = kind == 0 ? OneCamera(24, seed) : ThreeCameras(24, seed, kind == 2);
  out.calibration = CalibrationOf(SolveScene(scene, kCornerNoisePx, seed));
  return out;
}

inline void ValidateFaultInjection(FaultInjection kind, std::uint64_t seed, Tally& tally) {
  const FaultInjectionCase spoiled = Spoiled(kind, seed);
  if (!(spoiled.predicted_sigmas >= 5)) {
    ++tally.not_detectable;
    std::printf("not detectable: %s, %.1f predicted sigmas\n", spoiled.name.c_str(),
                spoiled.predicted_sigmas);
    return;
  }
  std::string broken;
  bool caught = false;
  if (!spoiled.refused.empty()) {
    broken = "rejected: " + spoiled.refused;
    for (const char* word : {"parallel", "not determined", "do not determine", "folds back"}) {
      caught = caught || spoiled.refused.find(word) != std::string::npos;
    }
  } else {
    const BoardValidation report = ValidateBoards(spoiled.calibration, {}, {});
    broken = BrokenTests(report.tests);
    caught = spoiled.expected.empty() ? !report.passed()
                                      : BrokenTest(report.tests, spoiled.expected) != nullptr;
  }
  ++(caught ? tally.caught : tally.missed);
  std::printf("%s: %s, %.1f predicted sigmas: %s\n", caught ? "caught" : "MISSED",
              spoiled.name.c_str(), spoiled.predicted_sigmas, broken.c_str());
}

inline void ValidateHonest(std::uint64_t seed, Tally& tally) {
  const FaultInjectionCase honest = Honest(seed);
  const BoardValidation report = ValidateBoards(honest.calibration, {}, {});
  ++tally.honest;
  tally.honest_passed += report.passed() ? 1 : 0;
  std::printf("honest %s: %s\n", honest.name.c_str(), BrokenTests(report.tests).c_str());
}

}  // namespace dtr::calib::testing
