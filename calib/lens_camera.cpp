#include "calib/lens_camera.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <stdexcept>

#include "calib/lens_map.h"

namespace dtr::calib {
namespace {

struct ModelFacts {
  CameraModel model;
  const char* name;
  int parameters;
  int focal_lengths;
  bool fisheye;
};

constexpr std::array<ModelFacts, 20> kModels{{
    {CameraModel::kSimplePinhole, "SIMPLE_PINHOLE", 3, 1, false},
    {CameraModel::kPinhole, "PINHOLE", 4, 2, false},
    {CameraModel::kSimpleRadial, "SIMPLE_RADIAL", 4, 1, false},
    {CameraModel::kRadial, "RADIAL", 5, 1, false},
    {CameraModel::kOpenCv, "OPENCV", 8, 2, false},
    {CameraModel::kOpenCvFisheye, "OPENCV_FISHEYE", 8, 2, true},
    {CameraModel::kFullOpenCv, "FULL_OPENCV", 12, 2, false},
    {CameraModel::kFov, "FOV", 5, 2, false},
    {CameraModel::kSimpleRadialFisheye, "SIMPLE_RADIAL_FISHEYE", 4, 1, true},
    {CameraModel::kRadialFisheye, "RADIAL_FISHEYE", 5, 1, true},
    {CameraModel::kThinPrismFisheye, "THIN_PRISM_FISHEYE", 12, 2, true},
    {CameraModel::kRadTanThinPrismFisheye, "RAD_TAN_THIN_PRISM_FISHEYE", 16, 2, true},
    {CameraModel::kSimpleDivision, "SIMPLE_DIVISION", 4, 1, false},
    {CameraModel::kDivision, "DIVISION", 5, 2, false},
    {CameraModel::kSimpleFisheye, "SIMPLE_FISHEYE", 3, 1, true},
    {CameraModel::kFisheye, "FISHEYE", 4, 2, true},
    {CameraModel::kEucm, "EUCM", 6, 2, false},
    {CameraModel::kBrownAffine, "BROWN_AFFINE", 15, 2, false},
    {CameraModel::kFisheyeAffine, "FISHEYE_AFFINE", 15, 2, true},
    {CameraModel::kInverseRadial, "INVERSE_RADIAL", 5, 2, false},
}};

const ModelFacts& FactsOf(CameraModel model) {
  for (const ModelFacts& facts : kModels) {
    if (facts.model == model) return facts;
  }
  throw std::invalid_argument("CameraModel: unknown id " + std::to_string(static_cast<int>(model)));
}

}  // namespace

int ParameterCount(CameraModel model) { return FactsOf(model).parameters; }

int FocalCount(CameraModel model) { return FactsOf(model).focal_lengths; }

std::string NameOf(CameraModel model) { return FactsOf(model).name; }

std::optional<CameraModel> CameraModelFromName(const std::string& name) {
  for (const ModelFacts& facts : kModels) {
    if (name == facts.name) return facts.model;
  }
  return std::nullopt;
}

std::optional<CameraModel> CameraModelFromId(int id) {
  for (const ModelFacts& facts : kModels) {
    if (id == static_cast<int>(facts.model)) return facts.model;
  }
  return std::nullopt;
}

bool IsAdjustable(CameraModel model) {
  return model != CameraModel::kFov &&
         static_cast<int>(model) <= static_cast<int>(CameraModel::kThinPrismFisheye);
}

void LensCamera::Check() const {
  const ModelFacts& facts = FactsOf(model);
  if (width_px <= 0 || height_px <= 0) {
    throw std::invalid_argument("LensCamera: image size must be positive, found " +
                                std::to_string(width_px) + "x" + std::to_string(height_px));
  }
  if (params.size() != static_cast<size_t>(facts.parameters)) {
    throw std::invalid_argument(std::string("LensCamera: ") + facts.name + " has " +
                                std::to_string(facts.parameters) + " parameters, found " +
                                std::to_string(params.size()));
  }
  if (!std::all_of(params.begin(), params.end(), [](double p) { return std::isfinite(p); })) {
    throw std::invalid_argument("LensCamera: every parameter must be finite");
  }
  for (int i = 0; i < facts.focal_lengths; ++i) {
    if (!(params[static_cast<size_t>(i)] > 0)) {
      throw std::invalid_argument("LensCamera: focal lengths must be positive, found " +
                                  std::to_string(params[static_cast<size_t>(i)]));
    }
  }
  if (model == CameraModel::kEucm && !(params[4] >= 0 && params[4] <= 1 && params[5] > 0)) {
    throw std::invalid_argument(
        "LensCamera: EUCM must have alpha in [0, 1] and beta above 0, found " +
        std::to_string(params[4]) + " and " + std::to_string(params[5]));
  }
}

PinholeCamera LensCamera::Pinhole() const {
  Check();
  const bool two_focals = FactsOf(model).focal_lengths == 2;
  const size_t center = two_focals ? 2 : 1;
  return {width_px,       height_px,         params[0], two_focals ? params[1] : params[0],
          params[center], params[center + 1]};
}

bool LensCamera::IsUndistorted() const {
  Check();
  const ModelFacts& facts = FactsOf(model);
  if (facts.fisheye) return false;  // equidistant even when every coefficient is zero
  if (model == CameraModel::kEucm) return params[4] == 0;
  const auto distortion = params.begin() + facts.focal_lengths + 2;
  return std::all_of(distortion, params.end(), [](double p) { return p == 0; });
}

std::optional<Eigen::Vector2d> LensCamera::PixelFromCam(const Eigen::Vector3d& p_in_cam) const {
  return LensMap(*this).PixelFromCam(p_in_cam);
}

std::optional<Eigen::Vector3d> LensCamera::RayFromPixel(const Eigen::Vector2d& pixel) const {
  return LensMap(*this).RayFromPixel(pixel);
}

LensCamera WithTwoFocalLengths(LensCamera camera) {
  static const std::map<CameraModel, CameraModel> kWider{
      {CameraModel::kSimplePinhole, CameraModel::kPinhole},
      {CameraModel::kSimpleRadial, CameraModel::kOpenCv},
      {CameraModel::kRadial, CameraModel::kOpenCv},
      {CameraModel::kSimpleRadialFisheye, CameraModel::kOpenCvFisheye},
      {CameraModel::kRadialFisheye, CameraModel::kOpenCvFisheye},
      {CameraModel::kSimpleDivision, CameraModel::kDivision},
      {CameraModel::kSimpleFisheye, CameraModel::kFisheye}};
  const auto wider = kWider.find(camera.model);
  if (wider == kWider.end()) return camera;
  camera.model = wider->second;
  camera.params.insert(camera.params.begin(), camera.params.front());  // f is fx and fy
  camera.params.resize(static_cast<size_t>(ParameterCount(camera.model)), 0);
  return camera;
}

}  // namespace dtr::calib
