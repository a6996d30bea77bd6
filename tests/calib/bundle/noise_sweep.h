// tests/calib/bundle/noise_sweep.h -- models of every noise, from none to 3 px, honest and spoiled.
#pragma once
#include <Eigen/Geometry>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "calib/validation/photos.h"
#include "calib/validation/reprojection.h"
#include "tests/calib/bundle/synthetic_bundle.h"
#include "tests/calib/fault_tally.h"

namespace dtr::testing {

/// Standard deviations of a pixel's coordinate: exact, rounding of double and of float, of text
/// files, what features have, and what poor ones have.
inline const std::vector<double> kNoisesPx = {
    0, 1e-12, 1e-10, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 0.03, 0.1, 0.3, 1, 3};

/// A few of them, for what takes long.
inline const std::vector<double> kFewNoisesPx = {0, 1e-9, 1e-6, 1e-4, 1e-3, 1e-2, 0.1, 3};

enum class SceneKind {
  kArc,        ///< eight cameras along an arc
  kRing,       ///< ten cameras around the scene
  kThrees,     ///< of an arc, but every point is seen by three cameras only
  kOrbit,      ///< of an arc at one height, looking at its middle: leaves principal points open
  kTurntable,  ///< all the way round at one height, pixels that are not square
  kMixed,      ///< by two to all of them, most by two, as in field/validate_exact
};
inline const std::vector<SceneKind> kSceneKinds = {SceneKind::kArc,       SceneKind::kRing,
                                                   SceneKind::kThrees,    SceneKind::kOrbit,
                                                   SceneKind::kTurntable, SceneKind::kMixed};

inline std::string NameOf(SceneKind kind) {
  const char* names[] = {"arc", "ring", "threes", "orbit", "turntable", "mixed"};
  return names[static_cast<int>(kind)];
}

inline const calib::LensCamera kPinholeOfSweep{
    calib::CameraModel::kPinhole, 1000, 800, {900, 900, 500, 400}};

/// Leaves of three points out of five two observations, by any two of the cameras.
inline void KeepPairsOfMost(std::uint64_t seed, calib::Bundle& bundle) {
  std::vector<std::vector<int>> seen_by(bundle.points.size());
  for (const auto& o : bundle.observations) {
    seen_by[static_cast<size_t>(o.point)].push_back(o.image);
  }
  for (size_t p = 0; p < seen_by.size(); ++p) {
    Random random(HashOf(seed, static_cast<std::uint64_t>(p)));
    if (p % 5 >= 3) continue;
    while (seen_by[p].size() > 2) {
      seen_by[p].erase(seen_by[p].begin() + random.Index(static_cast<int>(seen_by[p].size())));
    }
  }
  std::erase_if(bundle.observations, [&](const auto& o) {
    const auto& images = seen_by[static_cast<size_t>(o.point)];
    return std::find(images.begin(), images.end(), o.image) == images.end();
  });
}

/// The true cameras with noisy observations, as somebody's exact model is imported.
inline calib::Bundle NoisyScene(SceneKind kind, double noise_px, std::uint64_t seed,
                                int points = 300) {
  SceneSpec spec{.points = points, .lens = kPinholeOfSweep, .noise_px = noise_px, .seed = seed};
  if (kind == SceneKind::kRing) {
    spec.images = 10;
    spec.pose = [](int i, int n) {
      const double angle = 2 * EIGEN_PI * i / n;
      return LookAt({6 * std::sin(angle), -6 * std::cos(angle), 1.0 + 0.8 * (i % 3)},
                    Eigen::Vector3d::Zero());
    };
  }
  if (kind == SceneKind::kOrbit) {
    spec.images = 6;
    spec.pose = [](int i, int n) {
      const double angle = -0.5 + 1.0 * i / (n - 1);
      return LookAt({6 * std::sin(angle), -6 * std::cos(angle), 1.0}, Eigen::Vector3d::Zero());
    };
  }
  if (kind == SceneKind::kTurntable) {
    spec.images = 10;
    spec.lens.params[1] *= 1.1;
    spec.pose = [](int i, int n) {
      const double angle = 2 * EIGEN_PI * i / n;
      return LookAt({6 * std::sin(angle), -6 * std::cos(angle), 2.0}, Eigen::Vector3d::Zero());
    };
  }
  if (kind == SceneKind::kThrees) spec.max_observations = 3;
  calib::Bundle bundle = MakeBundle(spec);
  if (kind == SceneKind::kMixed) KeepPairsOfMost(seed, bundle);
  return bundle;
}

/// What a fault does to pixels, so that it is clear above the noise and above what is negligible.
inline double ClearlySeenPx(double noise_px) { return 4 + 20 * noise_px; }

enum class Fault { kMovedCamera, kTurnedCamera, kFocalLength, kPrincipalPoint, kSwapped };
inline const std::vector<Fault> kFaults = {Fault::kMovedCamera, Fault::kTurnedCamera,
                                           Fault::kFocalLength, Fault::kPrincipalPoint,
                                           Fault::kSwapped};

inline std::string NameOf(Fault fault) {
  const char* names[] = {"moved camera", "turned camera", "focal length", "principal point",
                         "swapped observations"};
  return names[static_cast<int>(fault)];
}

inline calib::Bundle WithFault(calib::Bundle bundle, Fault fault, double by_px) {
  constexpr double kDistance = 6, kReachPx = 300;  // of the scene; of most observations
  calib::LensCamera& lens = bundle.lenses[0];
  Pose& pose = bundle.images[2].cam_from_world;
  switch (fault) {
    case Fault::kMovedCamera:  // along the axis, which turning cannot make up for
      pose.translation += by_px / kReachPx * kDistance * Eigen::Vector3d::UnitZ();
      break;
    case Fault::kTurnedCamera: {
      const Eigen::AngleAxisd turn(by_px / lens.params[0], Eigen::Vector3d(1, 1, 0).normalized());
      pose.rotation = (turn * pose.rotation).normalized();
      pose.translation = turn * pose.translation;
      break;
    }
    case Fault::kFocalLength:
      lens.params[0] *= 1 + by_px / kReachPx;
      lens.params[1] *= 1 + by_px / kReachPx;
      break;
    case Fault::kPrincipalPoint:
      lens.params[2] += 2 * by_px;
      break;
    case Fault::kSwapped: {  // of one photo every tenth pixel with the next
      std::vector<calib::BundleObservation*> of_image;
      for (calib::BundleObservation& o : bundle.observations) {
        if (o.image == 2) of_image.push_back(&o);
      }
      for (size_t i = 0; i + 1 < of_image.size(); i += 10) {
        std::swap(of_image[i]->pixel, of_image[i + 1]->pixel);
      }
      break;
    }
  }
  return bundle;
}

/// All tests of `dtr validate` that need no depth. Absolute limits on residuals are the user's to
/// set: here they follow the noise.
inline std::vector<Check> ValidationOf(const calib::Bundle& bundle, double noise_px) {
  calib::ValidateLimits limits;
  const double scale = std::max(1.0, noise_px / 0.4);
  limits.max_rms_px *= scale;
  limits.max_camera_rms_px *= scale;
  limits.max_stored_rms_px *= scale;
  limits.max_mean_px *= scale;
  limits.max_camera_mean_px *= scale;
  std::vector<PinholeCamera> cameras;
  std::vector<Pose> poses;
  std::vector<std::string> names;
  for (const calib::BundleImage& image : bundle.images) {
    cameras.push_back(bundle.lenses[static_cast<size_t>(image.lens)].Pinhole());
    poses.push_back(image.cam_from_world);
    names.push_back(image.name);
  }
  SparseScene scene;
  for (const Eigen::Vector4d& p : bundle.points) scene.points.push_back({p.hnormalized()});
  for (const auto& o : bundle.observations) {
    scene.observations.push_back({o.image, o.point, o.pixel});
  }
  std::sort(scene.observations.begin(), scene.observations.end(), [](const auto& a, const auto& b) {
    return std::pair(a.view, a.point) < std::pair(b.view, b.point);
  });
  std::vector<Check> tests =
      calib::ValidateReprojection(cameras, poses, scene, limits, names).tests;
  calib::BundleLimits judge;
  judge.max_image_shift_px *= scale;
  const calib::PhotosValidation judgement = calib::ValidatePhotos(bundle, judge);
  tests.insert(tests.end(), judgement.tests.begin(), judgement.tests.end());
  return tests;
}

}  // namespace dtr::testing
