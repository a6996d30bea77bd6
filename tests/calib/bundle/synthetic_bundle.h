// tests/calib/bundle/synthetic_bundle.h -- the bundles whose truth is known, by the tests' names.
#pragma once
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

}  // namespace dtr::testing
