// tests/calib/lens_models.h -- random but plausible lenses for property tests.
#pragma once
#include <array>

#include "calib/lens_camera.h"
#include "dtr/base/random.h"

namespace dtr::calib::testing {

inline constexpr std::array<LensModel, 11> kAllModels{LensModel::kSimplePinhole,
                                                      LensModel::kPinhole,
                                                      LensModel::kSimpleRadial,
                                                      LensModel::kRadial,
                                                      LensModel::kOpenCv,
                                                      LensModel::kOpenCvFisheye,
                                                      LensModel::kFullOpenCv,
                                                      LensModel::kFov,
                                                      LensModel::kSimpleRadialFisheye,
                                                      LensModel::kRadialFisheye,
                                                      LensModel::kThinPrismFisheye};

/// A 640x480 camera of the model; coefficients of the sizes that real lenses have.
inline LensCamera RandomLens(LensModel model, Random& random) {
  const auto any = [&](double limit) { return random.Uniform(-limit, limit); };
  const double fx = random.Uniform(400, 700), fy = fx * random.Uniform(0.97, 1.03);
  const double cx = random.Uniform(300, 340), cy = random.Uniform(220, 260);
  LensCamera camera{model, 640, 480, {}};
  switch (model) {
    case LensModel::kSimplePinhole:
      camera.params = {fx, cx, cy};
      break;
    case LensModel::kPinhole:
      camera.params = {fx, fy, cx, cy};
      break;
    case LensModel::kSimpleRadial:
    case LensModel::kSimpleRadialFisheye:
      camera.params = {fx, cx, cy, any(0.15)};
      break;
    case LensModel::kRadial:
    case LensModel::kRadialFisheye:
      camera.params = {fx, cx, cy, any(0.15), any(0.05)};
      break;
    case LensModel::kOpenCv:
      camera.params = {fx, fy, cx, cy, any(0.15), any(0.05), any(2e-3), any(2e-3)};
      break;
    case LensModel::kOpenCvFisheye:
      camera.params = {fx, fy, cx, cy, any(0.1), any(0.03), any(0.01), any(0.003)};
      break;
    case LensModel::kFullOpenCv:
      camera.params = {fx,        fy,        cx,        cy,        any(0.15), any(0.05),
                       any(2e-3), any(2e-3), any(0.02), any(0.05), any(0.03), any(0.01)};
      break;
    case LensModel::kFov:
      camera.params = {fx, fy, cx, cy, random.Uniform(-1.2, 1.2)};
      break;
    case LensModel::kThinPrismFisheye:
      camera.params = {fx,        fy,        cx,        cy,         any(0.1),  any(0.03),
                       any(2e-3), any(2e-3), any(0.01), any(0.003), any(2e-3), any(2e-3)};
      break;
  }
  return camera;
}

}  // namespace dtr::calib::testing
