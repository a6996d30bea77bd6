#include "calib/bundle/lens_params.h"

namespace dtr::calib {

std::vector<std::string> ParameterNames(LensModel model) {
  const auto with = [](std::vector<std::string> names, std::vector<std::string> more) {
    names.insert(names.end(), more.begin(), more.end());
    return names;
  };
  const std::vector<std::string> one{"f_px", "cx_px", "cy_px"};
  const std::vector<std::string> two{"fx_px", "fy_px", "cx_px", "cy_px"};
  switch (model) {
    case LensModel::kSimplePinhole:
      return one;
    case LensModel::kPinhole:
      return two;
    case LensModel::kSimpleRadial:
    case LensModel::kSimpleRadialFisheye:
      return with(one, {"k1"});
    case LensModel::kRadial:
    case LensModel::kRadialFisheye:
      return with(one, {"k1", "k2"});
    case LensModel::kOpenCv:
      return with(two, {"k1", "k2", "p1", "p2"});
    case LensModel::kOpenCvFisheye:
      return with(two, {"k1", "k2", "k3", "k4"});
    case LensModel::kFullOpenCv:
      return with(two, {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"});
    case LensModel::kFov:
      return with(two, {"omega"});
    case LensModel::kThinPrismFisheye:
      return with(two, {"k1", "k2", "p1", "p2", "k3", "k4", "sx1", "sy1"});
  }
  return {};
}

}  // namespace dtr::calib
