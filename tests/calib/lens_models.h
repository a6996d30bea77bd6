// tests/calib/lens_models.h -- random but plausible lenses for property tests.
#pragma once
#include <array>

#include "calib/lens_camera.h"
#include "dtr/base/random.h"

namespace dtr::calib::testing {

inline constexpr std::array<CameraModel, 20> kAllModels{CameraModel::kSimplePinhole,
                                                        CameraModel::kPinhole,
                                                        CameraModel::kSimpleRadial,
                                                        CameraModel::kRadial,
                                                        CameraModel::kOpenCv,
                                                        CameraModel::kOpenCvFisheye,
                                                        CameraModel::kFullOpenCv,
                                                        CameraModel::kFov,
                                                        CameraModel::kSimpleRadialFisheye,
                                                        CameraModel::kRadialFisheye,
                                                        CameraModel::kThinPrismFisheye,
                                                        CameraModel::kRadTanThinPrismFisheye,
                                                        CameraModel::kSimpleDivision,
                                                        CameraModel::kDivision,
                                                        CameraModel::kSimpleFisheye,
                                                        CameraModel::kFisheye,
                                                        CameraModel::kEucm,
                                                        CameraModel::kBrownAffine,
                                                        CameraModel::kFisheyeAffine,
                                                        CameraModel::kInverseRadial};

/// A 640x480 camera of the model; coefficients of the sizes that real lenses have.
inline LensCamera RandomLens(CameraModel model, Random& random) {
  const auto any = [&](double limit) { return random.Uniform(-limit, limit); };
  const double fx = random.Uniform(400, 700), fy = fx * random.Uniform(0.97, 1.03);
  const double cx = random.Uniform(300, 340), cy = random.Uniform(220, 260);
  LensCamera camera{model, 640, 480, {}};
  switch (model) {
    case CameraModel::kSimplePinhole:
      camera.params = {fx, cx, cy};
      break;
    case CameraModel::kPinhole:
      camera.params = {fx, fy, cx, cy};
      break;
    case CameraModel::kSimpleRadial:
    case CameraModel::kSimpleRadialFisheye:
      camera.params = {fx, cx, cy, any(0.15)};
      break;
    case CameraModel::kRadial:
    case CameraModel::kRadialFisheye:
      camera.params = {fx, cx, cy, any(0.15), any(0.05)};
      break;
    case CameraModel::kOpenCv:
      camera.params = {fx, fy, cx, cy, any(0.15), any(0.05), any(2e-3), any(2e-3)};
      break;
    case CameraModel::kOpenCvFisheye:
      camera.params = {fx, fy, cx, cy, any(0.1), any(0.03), any(0.01), any(0.003)};
      break;
    case CameraModel::kFullOpenCv:
      camera.params = {fx,        fy,        cx,        cy,        any(0.15), any(0.05),
                       any(2e-3), any(2e-3), any(0.02), any(0.05), any(0.03), any(0.01)};
      break;
    case CameraModel::kFov:
      camera.params = {fx, fy, cx, cy, random.Uniform(-1.2, 1.2)};
      break;
    case CameraModel::kThinPrismFisheye:
      camera.params = {fx,        fy,        cx,        cy,         any(0.1),  any(0.03),
                       any(2e-3), any(2e-3), any(0.01), any(0.003), any(2e-3), any(2e-3)};
      break;
    case CameraModel::kRadTanThinPrismFisheye:
      camera.params = {fx,        fy,        cx,        cy,        any(0.1),  any(0.03),
                       any(0.01), any(3e-3), any(1e-3), any(3e-4), any(2e-3), any(2e-3),
                       any(2e-3), any(5e-4), any(2e-3), any(5e-4)};
      break;
    case CameraModel::kSimpleDivision:
      camera.params = {fx, cx, cy, any(0.15)};
      break;
    case CameraModel::kDivision:
    case CameraModel::kInverseRadial:
      camera.params = {fx, fy, cx, cy, any(0.1)};
      break;
    case CameraModel::kSimpleFisheye:
      camera.params = {fx, cx, cy};
      break;
    case CameraModel::kFisheye:
      camera.params = {fx, fy, cx, cy};
      break;
    case CameraModel::kEucm:
      camera.params = {fx, fy, cx, cy, random.Uniform(0.1, 0.8), random.Uniform(0.5, 1.5)};
      break;
    case CameraModel::kBrownAffine:
    case CameraModel::kFisheyeAffine:
      camera.params = {fx,        fy,        cx,        cy,        any(0.1),
                       any(0.03), any(0.01), any(3e-3), any(1e-3), any(3e-4),
                       any(2e-3), any(2e-3), any(0.2),  any(0.1),  any(3)};
      break;
  }
  return camera;
}

}  // namespace dtr::calib::testing
