// tests/calib/bundle/synthetic_bundle.h -- the bundles whose truth is known, by the tests' names.
#pragma once
#include <cmath>

#include "calib/sfm_model.h"
#include "datasets/exact/bundle.h"

namespace dtr::testing {
using namespace bundle;

/// The model of a bundle, as COLMAP would hand it over.
inline calib::SfmModel ModelFrom(const calib::Bundle& bundle) {
  calib::SfmModel model;
  model.cameras[1] = bundle.lenses[0];
  for (size_t i = 0; i < bundle.images.size(); ++i) {
    model.images.push_back({static_cast<std::uint32_t>(i + 1),
                            bundle.images[i].name,
                            1,
                            bundle.images[i].cam_from_world,
                            {}});
  }
  for (size_t p = 0; p < bundle.points.size(); ++p) {
    model.points[bundle.point_ids[p]].p_in_world = bundle.points[p].head<3>();
  }
  for (const calib::BundleObservation& o : bundle.observations) {
    model.images[static_cast<size_t>(o.image)].features.push_back(
        {o.pixel, bundle.point_ids[static_cast<size_t>(o.point)]});
  }
  return model;
}

inline constexpr int kChain = 40;

/// A walk along a wall of 40 m, which every photo shows a part of: points are seen by four photos
/// in a row, and what errs in one step is carried through all others.
inline SceneSpec Walk(double noise_px = 1) {
  SceneSpec spec{.images = kChain, .points = 900, .noise_px = noise_px, .max_observations = 4};
  spec.pose = [](int i, int) {
    const Eigen::Vector3d centre(i, 0.6 * std::sin(0.7 * i), 1.5 + 0.3 * std::cos(0.5 * i));
    return LookAt(centre, centre + Eigen::Vector3d(0.3 * std::sin(1.1 * i), 10, 0));
  };
  spec.point = [](dtr::Random& random) {
    const double x = random.Uniform(-4, kChain + 3), y = random.Uniform(5, 12);
    return Eigen::Vector3d(x, y, random.Uniform(-2, 5));
  };
  return spec;
}

/// A flight along a facade with exposure brackets: two photos from the sixth place and four from
/// the last, to `apart`, which shares some third of its view with the others. What the last four
/// see beyond has no parallax.
inline SceneSpec Brackets(double apart = 1e-3) {
  SceneSpec spec{.images = 12, .points = 700, .noise_px = 0.3};
  spec.pose = [apart](int i, int) {
    constexpr double kPlaces[] = {0, 1, 2, 3, 4, 5, 5, 6, 11, 11, 11, 11};
    Random random(static_cast<std::uint64_t>(100 + i));
    const Eigen::Vector3d centre(kPlaces[i] + apart * random.Normal(), apart * random.Normal(),
                                 2 + 0.3 * std::cos(kPlaces[i]) + apart * random.Normal());
    return LookAt(centre,
                  centre + Eigen::Vector3d(0.2 * std::sin(2.1 * i), 10, 0.3 * std::cos(1.3 * i)));
  };
  spec.point = [](dtr::Random& random) {
    const double x = random.Uniform(-5, 17), y = random.Uniform(8, 14);
    return Eigen::Vector3d(x, y, random.Uniform(-2, 6));
  };
  return spec;
}

}  // namespace dtr::testing
