#include "dtr/io/formats/transforms_lens.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <set>

#include "dtr/base/error.h"

namespace dtr::io::internal {
namespace {

std::string ModelOf(const FrameFields& fields) {
  if (!fields.Has("camera_model")) return "";
  std::string model = StringField(fields.Holder("camera_model"), "camera_model", fields.where());
  for (char& c : model) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return model;
}

bool EndsInFisheye(const std::string& model) {
  return model == "FISHEYE" || model.ends_with("_FISHEYE");
}

// Programs write true, false, 1 and 0. Empty: the file does not say.
std::optional<bool> FisheyeFlag(const FrameFields& fields) {
  if (!fields.Has("is_fisheye")) return std::nullopt;
  const Json& flag = fields.Holder("is_fisheye")["is_fisheye"];
  if (flag.is_boolean()) return flag.get<bool>();
  if (flag.is_number()) return flag.get<double>() != 0;
  if (flag.is_null()) return std::nullopt;
  throw Error(fields.where() + ".is_fisheye: expected true or false, found another");
}

bool IsFisheye(const FrameFields& fields, const std::string& model) {
  static const std::set<std::string> kKnown = {"",
                                               "PINHOLE",
                                               "SIMPLE_PINHOLE",
                                               "PERSPECTIVE",
                                               "SIMPLE_RADIAL",
                                               "RADIAL",
                                               "OPENCV",
                                               "FISHEYE",
                                               "OPENCV_FISHEYE",
                                               "FULL_OPENCV",
                                               "RADIAL_FISHEYE",
                                               "SIMPLE_RADIAL_FISHEYE"};
  if (!kKnown.contains(model)) {
    throw Error(fmt::format(
        "{}.camera_model: cannot be used, '{}' is none of the perspective and fisheye cameras that "
        "can be undistorted (PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV, FULL_OPENCV, OPENCV_FISHEYE)",
        fields.where(), model.substr(0, 40)));
  }
  const std::optional<bool> flag = FisheyeFlag(fields);
  if (flag && !model.empty() && *flag != EndsInFisheye(model)) {
    throw Error(fmt::format("{}: is_fisheye conflicts with camera_model {}; correct one of them",
                            fields.where(), model));
  }
  return flag.value_or(EndsInFisheye(model));
}

void RequireZero(const FrameFields& fields, std::initializer_list<const char*> keys,
                 const char* why) {
  for (const char* key : keys) {
    if (fields.NumberOrZero(key) == 0) continue;
    throw Error(fmt::format("{}.{}: {}", fields.where(), key, why));
  }
}

// Terms that other programs have and no model of ours does.
void RequireNoOtherTerms(const FrameFields& fields) {
  RequireZero(fields, {"s1", "s2", "s3", "s4", "b1", "b2"},
              "cannot be used, prism, affinity and skew terms are not supported; undistort the "
              "images with the program that wrote the file");
  for (const char* key : {"ftheta_p0", "ftheta_p1", "latlong", "equirectangular", "lens_mode"}) {
    if (!fields.Has(key)) continue;
    const Json& value = fields.Holder(key)[key];
    if (value == false || value == 0 || value.is_null()) continue;
    throw Error(
        fmt::format("{}.{}: cannot be used, the camera is neither a perspective one nor an "
                    "OpenCV fisheye; render perspective images of it with the program that "
                    "wrote the file",
                    fields.where(), key));
  }
}

}  // namespace

double FrameFields::Positive(const char* key) const {
  const double number = Number(key);
  if (number > 0) return number;
  throw Error(where_ + "." + key + ": expected a positive number, found " + std::to_string(number));
}

std::optional<Distortion> DistortionFrom(const FrameFields& fields, const PinholeCamera& camera) {
  const std::string model = ModelOf(fields);
  const bool fisheye = IsFisheye(fields, model);
  RequireNoOtherTerms(fields);
  Distortion distortion;
  distortion.params = {camera.fx_px(), camera.fy_px(), camera.cx_px(), camera.cy_px()};
  const auto add = [&](std::initializer_list<const char*> keys) {
    bool any = false;
    for (const char* key : keys) {
      distortion.params.push_back(fields.NumberOrZero(key));
      any |= distortion.params.back() != 0;
    }
    return any;
  };
  if (fisheye) {
    RequireZero(fields, {"p1", "p2", "k5", "k6"},
                "cannot be used, an OpenCV fisheye has k1 to k4 only; undistort the images with "
                "the program that wrote the file");
    distortion.model = "OPENCV_FISHEYE";
    add({"k1", "k2", "k3", "k4"});
    return distortion;  // without coefficients, too, a fisheye is no pinhole camera
  }
  if (model != "FULL_OPENCV") {
    RequireZero(fields, {"k4", "k5", "k6"},
                "is a denominator for OpenCV and a radial term for other programs; where OpenCV's "
                "is meant write \"camera_model\": \"FULL_OPENCV\"");
  }
  const bool radial = add({"k1", "k2", "p1", "p2"});
  const bool more = add({"k3", "k4", "k5", "k6"});
  if (!radial && !more) return std::nullopt;
  distortion.model = more ? "FULL_OPENCV" : "OPENCV";
  if (!more) distortion.params.resize(8);
  return distortion;
}

const std::vector<std::string>& DistortionFields() {
  static const std::vector<std::string> kFields = {
      "camera_model", "is_fisheye", "k1",        "k2",      "k3",
      "k4",           "k5",         "k6",        "p1",      "p2",
      "s1",           "s2",         "s3",        "s4",      "b1",
      "b2",           "ftheta_p0",  "ftheta_p1", "latlong", "equirectangular",
      "lens_mode"};
  return kFields;
}

}  // namespace dtr::io::internal
