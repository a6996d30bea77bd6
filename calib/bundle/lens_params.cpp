#include "calib/bundle/lens_params.h"

namespace dtr::calib {

std::vector<std::string> ParameterNames(CameraModel model) {
  const auto with = [](std::vector<std::string> names, std::vector<std::string> more) {
    names.insert(names.end(), more.begin(), more.end());
    return names;
  };
  const std::vector<std::string> one{"f_px", "cx_px", "cy_px"};
  const std::vector<std::string> two{"fx_px", "fy_px", "cx_px", "cy_px"};
  switch (model) {
    case CameraModel::kSimplePinhole:
      return one;
    case CameraModel::kPinhole:
      return two;
    case CameraModel::kSimpleRadial:
    case CameraModel::kSimpleRadialFisheye:
      return with(one, {"k1"});
    case CameraModel::kRadial:
    case CameraModel::kRadialFisheye:
      return with(one, {"k1", "k2"});
    case CameraModel::kOpenCv:
      return with(two, {"k1", "k2", "p1", "p2"});
    case CameraModel::kOpenCvFisheye:
      return with(two, {"k1", "k2", "k3", "k4"});
    case CameraModel::kFullOpenCv:
      return with(two, {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"});
    case CameraModel::kFov:
      return with(two, {"omega"});
    case CameraModel::kThinPrismFisheye:
      return with(two, {"k1", "k2", "p1", "p2", "k3", "k4", "sx1", "sy1"});
    case CameraModel::kRadTanThinPrismFisheye:
      return with(two, {"k0", "k1", "k2", "k3", "k4", "k5", "p0", "p1", "s0", "s1", "s2", "s3"});
    case CameraModel::kSimpleDivision:
      return with(one, {"k"});
    case CameraModel::kDivision:
      return with(two, {"k"});
    case CameraModel::kSimpleFisheye:
      return one;
    case CameraModel::kFisheye:
      return two;
    case CameraModel::kInverseRadial:
      return with(two, {"r"});
    case CameraModel::kEucm:
      return with(two, {"alpha", "beta"});
    case CameraModel::kBrownAffine:
    case CameraModel::kFisheyeAffine:
      return with(two, {"k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2", "p3", "p4", "skew"});
  }
  return {};
}

}  // namespace dtr::calib
