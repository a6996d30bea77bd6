// calib/models/fisheye.h -- which camera models draw angles.
#pragma once
#include "calib/lens_camera.h"

namespace dtr::calib {

/// LensFormula::fisheye of all cameras of a model.
constexpr bool IsFisheye(CameraModel model) {
  return model == CameraModel::kOpenCvFisheye || model == CameraModel::kSimpleRadialFisheye ||
         model == CameraModel::kRadialFisheye || model == CameraModel::kThinPrismFisheye ||
         model == CameraModel::kRadTanThinPrismFisheye || model == CameraModel::kSimpleFisheye ||
         model == CameraModel::kFisheye || model == CameraModel::kFisheyeAffine;
}

}  // namespace dtr::calib
