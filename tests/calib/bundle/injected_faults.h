// tests/calib/bundle/injected_faults.h -- photo sets spoiled by seed, and whether that is found.
#pragma once
#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <iostream>

#include "calib/bundle/covariance.h"
#include "calib/bundle/gauge.h"
#include "calib/bundle/lens_patterns.h"
#include "calib/bundle/shutter.h"
#include "calib/validation/photos.h"
#include "tests/calib/bundle/synthetic_bundle.h"
#include "tests/calib/fault_tally.h"

namespace dtr::testing {

using namespace calib;  // NOLINT: the tests' own short-hand

inline const LensCamera kPinholeLens{CameraModel::kPinhole, 1000, 800, {900, 905, 504, 397}};

inline AdjustOptions AllFree() {
  AdjustOptions options;
  options.lens = LensFreedom::kAll;
  return options;
}

// A set as `dtr build` leaves it: adjusted to its own noisy observations. What is seen fills the
// images: where nothing is seen, no fault of the lens shows.
inline Bundle Honest(std::uint64_t seed, int points = 300) {
  SceneSpec spec{
      .images = 7, .points = points, .lens = kPinholeLens, .noise_px = 0.3, .seed = seed};
  spec.point = [](Random& random) {
    const double x = random.Uniform(-2.2, 2.2), y = random.Uniform(-2, 2);
    return Eigen::Vector3d(x, y, random.Uniform(-2, 2));
  };
  return Adjust(MakeBundle(spec), AllFree()).bundle;
}

inline constexpr int kFaultInjections = 11;

// How many standard deviations a stored calibration is off, as the honest one's covariance has it.
struct Faulty {
  Bundle bundle;
  double sigmas = 0;
  std::string test, word;  // that must fail (empty: any), and what its reason must name
};

inline Eigen::Vector3d Direction(Random& random) {
  const double x = random.Normal(), y = random.Normal();
  return Eigen::Vector3d(x, y, random.Normal()).normalized();
}

// The observations as a camera sees them that turns, by up to this from an image's first row to its
// last, while the rows are read; the turn is each image's own.
inline void ReadRowByRow(double largest_turn_rad, Random& random, Bundle& bundle) {
  std::vector<Eigen::Vector3d> turns;
  for (size_t i = 0; i < bundle.images.size(); ++i) {
    turns.push_back(random.Uniform(0, largest_turn_rad) * Direction(random));
  }
  for (BundleObservation& o : bundle.observations) {
    const BundleImage& image = bundle.images[static_cast<size_t>(o.image)];
    const LensCamera& lens = bundle.lenses[static_cast<size_t>(image.lens)];
    const Eigen::Vector3d p =
        image.cam_from_world * bundle.points[static_cast<size_t>(o.point)].hnormalized();
    const Eigen::Vector3d turn =
        (o.pixel.y() / lens.height_px - 0.5) * turns[static_cast<size_t>(o.image)];
    const auto still = lens.PixelFromCam(p);
    const auto turned = lens.PixelFromCam(Eigen::AngleAxisd(turn.norm(), turn.normalized()) * p);
    if (still && turned) o.pixel += *turned - *still;
  }
}

// The observations as a lens draws them that waves, by this much, twice across its image, as a
// bent pane before it does: slower waves are what distortion follows.
inline void Ripple(double height_px, Bundle& bundle) {
  for (BundleObservation& o : bundle.observations) {
    const BundleImage& image = bundle.images[static_cast<size_t>(o.image)];
    const LensCamera& lens = bundle.lenses[static_cast<size_t>(image.lens)];
    const double x = 4 * EIGEN_PI * o.pixel.x() / lens.width_px;
    const double y = 4 * EIGEN_PI * o.pixel.y() / lens.height_px;
    o.pixel += height_px * Eigen::Vector2d(std::sin(y), std::sin(x));
  }
}

// Two of the photos were zoomed, and the set was adjusted with one camera for all.
inline Bundle WithZoomedPhotos(const Bundle& honest, int image, double zoom) {
  Bundle bundle = honest;
  const int other = (image + 3) % static_cast<int>(honest.images.size());
  for (BundleObservation& o : bundle.observations) {
    if (o.image != image && o.image != other) continue;
    const LensCamera& lens = honest.lenses[0];
    const Eigen::Vector2d centre(lens.params[2], lens.params[3]);
    o.pixel = centre + zoom * (o.pixel - centre);
  }
  return Adjust(bundle, AllFree()).bundle;
}

// Every photo has a camera of its own, whose principal point started off by up to this share of
// the image's width; all else was adjusted to the observations.
inline Bundle WithCameraPerPhoto(const Bundle& honest, double share, Random& random) {
  Bundle bundle = honest;
  bundle.lenses.assign(honest.images.size(), honest.lenses[0]);
  for (size_t i = 0; i < bundle.images.size(); ++i) {
    bundle.images[i].lens = static_cast<int>(i);
    for (const size_t k : {2, 3}) {
      bundle.lenses[i].params[k] += random.Uniform(-share, share) * honest.lenses[0].width_px;
    }
  }
  AdjustOptions options;
  options.lens = LensFreedom::kFocal;  // the principal points stay
  return Adjust(bundle, options).bundle;
}

// How far the worst camera is off: one that stands elsewhere moves all in the gauge that is nearest
// to what is stored, and itself the less.
inline double SigmasOfPose(const Bundle& honest, const Bundle& stored,
                           const BundleCovariance& covariance) {
  Bundle fresh = honest;
  MoveToGaugeOf(stored, fresh);
  double most = 0;
  for (size_t i = 0; i < honest.images.size(); ++i) {
    const Pose &from = stored.images[i].cam_from_world, &to = fresh.images[i].cam_from_world;
    const Eigen::AngleAxisd turn((to.rotation * from.rotation.conjugate()).normalized());
    Eigen::Matrix<double, 6, 1> d;
    d << turn.angle() * turn.axis(), to.TargetOriginInSource() - from.TargetOriginInSource();
    const Eigen::MatrixXd variance = covariance.OfImage(static_cast<int>(i));
    most = std::max(most, std::sqrt(d.dot(variance.ldlt().solve(d))));
  }
  return most;
}

// A pattern's strength: what is left of it in exact observations, over its limit; 5 where it
// reaches that. Poses, lens and points follow the rest of it.
template <typename Spoil, typename Test>
double SigmasOfPattern(const Bundle& honest, const Spoil& spoil, const Test& test,
                       double limit_px) {
  Bundle exact = honest;
  const auto pixels = Projections(honest);
  for (size_t i = 0; i < pixels.size(); ++i) exact.observations[i].pixel = pixels[i];
  spoil(exact);
  const Adjusted adjusted = Adjust(exact, AllFree());
  return 5 * test(adjusted, CovarianceOf(adjusted, AllFree())).fit.amplitude_px / limit_px;
}

inline Faulty FaultInjection(const Bundle& honest, int kind, Random& random) {
  Faulty s{honest, 0, "", ""};
  // With distortion, as whoever validates undistorted views has to allow for.
  Bundle distorted = honest;
  distorted.lenses[0].model = CameraModel::kOpenCv;
  distorted.lenses[0].params.resize(8, 0);
  const BundleCovariance covariance = CovarianceOf(Adjust(distorted, AllFree()), AllFree());
  const double wanted = random.Uniform(8, 40);
  const int image = random.Index(static_cast<int>(honest.images.size()));
  Pose& pose = s.bundle.images[static_cast<size_t>(image)].cam_from_world;
  std::vector<double>& params = s.bundle.lenses[0].params;
  const Eigen::MatrixXd of_lens = covariance.OfLens(distorted, 0);
  const Eigen::MatrixXd of_image = covariance.OfImage(image);
  switch (kind) {
    case 0:  // focal lengths
      s.sigmas = wanted;
      params[0] += wanted * std::sqrt(of_lens(0, 0));
      params[1] += wanted * std::sqrt(of_lens(0, 0));
      s.test = "lens_difference_sigmas";
      s.word = "px: stored";
      break;
    case 1:  // principal point
      s.sigmas = wanted;
      params[2] += wanted * std::sqrt(of_lens(2, 2));
      s.test = "lens_difference_sigmas";
      s.word = "px: stored";
      break;
    case 2: {  // a camera is moved
      const Eigen::Vector3d d = Direction(random);
      const Eigen::Matrix3d m = of_image.bottomRightCorner<3, 3>();
      const double length = wanted / std::sqrt(d.dot(m.inverse() * d));
      pose.translation -= pose.rotation * (length * d);
      s.sigmas = SigmasOfPose(honest, s.bundle, covariance);
      s.test = "camera_difference_sigmas";
      s.word = honest.images[static_cast<size_t>(image)].name;
      break;
    }
    case 3: {  // a camera is turned
      const Eigen::Vector3d d = Direction(random);
      const Eigen::Matrix3d m = of_image.topLeftCorner<3, 3>();
      const double angle = wanted / std::sqrt(d.dot(m.inverse() * d));
      const Eigen::Vector3d centre = pose.TargetOriginInSource();
      pose.rotation = (Eigen::AngleAxisd(angle, d) * pose.rotation).normalized();
      pose.translation = -(pose.rotation * centre);
      s.sigmas = SigmasOfPose(honest, s.bundle, covariance);
      s.test = "camera_difference_sigmas";
      s.word = honest.images[static_cast<size_t>(image)].name;
      break;
    }
    case 4: {  // two cameras are swapped
      s.sigmas = 1e3;
      const int other = (image + 1) % static_cast<int>(honest.images.size());
      std::swap(pose, s.bundle.images[static_cast<size_t>(other)].cam_from_world);
      s.test = "camera_difference_sigmas";
      s.word = "pose";
      break;
    }
    case 5:  // an image twice
      s.sigmas = 1e3;
      s.bundle.images.push_back(honest.images[static_cast<size_t>(image)]);
      s.bundle.images.back().name = "copy";
      for (const BundleObservation& o : honest.observations) {
        if (o.image != image) continue;
        s.bundle.observations.push_back(o);
        s.bundle.observations.back().image = static_cast<int>(honest.images.size());
      }
      std::stable_sort(s.bundle.observations.begin(), s.bundle.observations.end(),
                       [](const auto& a, const auto& b) {
                         return std::pair(a.point, a.image) < std::pair(b.point, b.image);
                       });
      s.test = "degeneracies";
      s.word = "duplicate_images";
      break;
    case 6: {  // rows are read one after the other by a camera that turns
      const double largest_turn_rad = random.Uniform(0.002, 0.01);
      const auto spoil = [&, drawn = random](Bundle& bundle) {
        Random turns = drawn;  // the same in both bundles
        ReadRowByRow(largest_turn_rad, turns, bundle);
      };
      s.sigmas = SigmasOfPattern(honest, spoil, TestShutter, BundleLimits{}.max_shutter_px);
      spoil(s.bundle);
      s.test = "rolling_shutter_px";
      s.word = "rows are read";
      break;
    }
    case 7: {  // a lens that no model follows
      const double height_px = random.Uniform(0.5, 2);
      const auto spoil = [&](Bundle& bundle) { Ripple(height_px, bundle); };
      s.sigmas =
          SigmasOfPattern(honest, spoil, TestRegionalPattern, BundleLimits{}.max_lens_pattern_px);
      spoil(s.bundle);
      s.test = "regional_pattern_px";
      s.word = "image regions";
      break;
    }
    case 8:  // two photos are zoomed
      s.sigmas = 1e3;
      s.bundle = WithZoomedPhotos(honest, image, random.Uniform(1.02, 1.3));
      break;  // no test is meant for it: any may find it
    case 9:   // freedom that the observations leave open
      s.sigmas = 1e3;
      s.bundle = WithCameraPerPhoto(honest, random.Uniform(0.05, 0.15), random);
      s.test = "undetermined_terms";
      s.word = "principal points of";
      break;
    default: {  // pixels as another lens would have undistorted them
      s.sigmas = 1e3;
      for (BundleObservation& o : s.bundle.observations) {
        const Eigen::Vector2d q((o.pixel.x() - 504) / 900, (o.pixel.y() - 397) / 905);
        const double factor = 0.02 * q.squaredNorm();
        o.pixel += factor * Eigen::Vector2d(900 * q.x(), 905 * q.y());
      }
      s.test = "lens_difference_sigmas";
      s.word = "stored";
      break;
    }
  }
  return s;
}

// FaultInjections drawn by seed: how many that can be seen were caught, with the right test named.
inline Tally FaultInjectionAll(int count, std::uint64_t seed) {
  Tally tally;
  for (int k = 0; k < count; ++k) {
    Random random(HashOf(seed, static_cast<std::uint64_t>(k)));
    const Bundle honest = Honest(HashOf(seed, static_cast<std::uint64_t>(k), 5));
    const PhotosValidation good = ValidatePhotos(honest, {});
    ++tally.honest;
    tally.honest_passed += AllPassed(good.tests);
    if (!AllPassed(good.tests)) {
      std::cout << "honest " << k << ": " << BrokenTests(good.tests) << "\n";
    }
    const Faulty bad = FaultInjection(honest, k % kFaultInjections, random);
    const PhotosValidation judged = ValidatePhotos(bad.bundle, {});
    const Check* failed = BrokenTest(judged.tests, bad.test);
    const bool named = failed != nullptr && failed->reason.find(bad.word) != std::string::npos;
    if (named || (bad.test.empty() && !AllPassed(judged.tests))) {
      ++tally.caught;
      continue;
    }
    double moved = 0;
    for (const auto& camera : judged.cameras) moved = std::max(moved, camera.moved_px);
    const bool invisible = bad.sigmas < 5 || moved <= NegligiblePx({}, judged.sigma_px);
    (invisible ? tally.not_detectable : tally.missed) += 1;
    std::cout << (invisible ? "not detectable: " : "missed: ") << "kind " << k % kFaultInjections
              << ", " << bad.sigmas << " sigmas, points move by " << moved
              << " px, halves differ by " << judged.halves_ratio << " of what was predicted; "
              << BrokenTests(judged.tests) << "\n";
  }
  return tally;
}

}  // namespace dtr::testing
