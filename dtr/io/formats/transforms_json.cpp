#include "dtr/io/formats/transforms_json.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/formats/file_names.h"
#include "dtr/io/formats/json_fields.h"
#include "dtr/io/formats/pose_from_matrix.h"

namespace dtr::io {
namespace {

using internal::Json;

constexpr std::uintmax_t kMaxFileBytes = 256u << 20;

/// A field of the frame, else of the whole file.
class FrameFields {
 public:
  FrameFields(const Json& root, const Json& frame, std::string where)
      : root_(root), frame_(frame), where_(std::move(where)) {}
  bool Has(const char* key) const { return frame_.contains(key) || root_.contains(key); }
  const Json& Holder(const char* key) const { return frame_.contains(key) ? frame_ : root_; }
  double Number(const char* key) const { return internal::NumberField(Holder(key), key, where_); }
  double Positive(const char* key) const {
    const double number = Number(key);
    if (number > 0) return number;
    throw Error(where_ + "." + key + ": expected a positive number, found " +
                std::to_string(number));
  }
  const std::string& where() const { return where_; }

 private:
  const Json& root_;
  const Json& frame_;
  std::string where_;
};

void RefuseLens(const FrameFields& fields) {
  constexpr std::array kCoefficients = {"k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2"};
  const std::string advice = "; undistort the images first";
  for (const char* key : kCoefficients) {
    if (fields.Has(key) && fields.Number(key) != 0) {
      throw Error(fields.where() + "." + key + ": expected images without distortion, found " +
                  std::to_string(fields.Number(key)) + advice);
    }
  }
  if (fields.Has("is_fisheye") && fields.Holder("is_fisheye")["is_fisheye"] != false) {
    throw Error(fields.where() + ".is_fisheye: expected a pinhole camera, found a fisheye" +
                advice);
  }
  if (fields.Has("camera_model")) {
    const std::string model =
        internal::StringField(fields.Holder("camera_model"), "camera_model", fields.where());
    if (model != "PINHOLE" && model != "SIMPLE_PINHOLE" && model != "OPENCV") {
      throw Error(fields.where() +
                  ".camera_model: expected PINHOLE, SIMPLE_PINHOLE or OPENCV with "
                  "zero coefficients, found another" +
                  advice);
    }
  }
}

double FocalFromAngle(const FrameFields& fields, const char* key, int side_px) {
  const double angle_rad = fields.Positive(key);
  if (angle_rad >= std::numbers::pi) {
    throw Error(fields.where() + "." + key + ": expected an angle below pi, found " +
                std::to_string(angle_rad));
  }
  const double focal_px = side_px / 2.0 / std::tan(angle_rad / 2);
  if (std::isfinite(focal_px)) return focal_px;
  throw Error(
      fmt::format("{}.{}: expected an angle of view in radians, found {:g}, which no focal "
                  "length has",
                  fields.where(), key, angle_rad));
}

PinholeCamera CameraFrom(const FrameFields& fields, const SizedImage& image) {
  int width_px = image.width_px, height_px = image.height_px;
  if (fields.Has("w") != fields.Has("h")) {
    throw Error(fields.where() + ": expected w and h together, found one of them");
  }
  if (fields.Has("w")) {
    width_px = internal::IntField(fields.Holder("w"), "w", 1, kMaxImageSidePx, fields.where());
    height_px = internal::IntField(fields.Holder("h"), "h", 1, kMaxImageSidePx, fields.where());
  }
  double fx_px = 0;
  if (fields.Has("fl_x")) {
    fx_px = fields.Positive("fl_x");
  } else if (fields.Has("camera_angle_x")) {
    fx_px = FocalFromAngle(fields, "camera_angle_x", width_px);
  } else {
    throw Error(fields.where() + ": expected fl_x or camera_angle_x, found neither");
  }
  double fy_px = fx_px;
  if (fields.Has("fl_y")) {
    fy_px = fields.Positive("fl_y");
  } else if (!fields.Has("fl_x") && fields.Has("camera_angle_y")) {
    fy_px = FocalFromAngle(fields, "camera_angle_y", height_px);
  }
  const double cx_px = fields.Has("cx") ? fields.Number("cx") : width_px / 2.0;
  const double cy_px = fields.Has("cy") ? fields.Number("cy") : height_px / 2.0;
  return ScaledToImage(PinholeCamera(width_px, height_px, fx_px, fy_px, cx_px, cy_px), image,
                       fields.where());
}

std::string RelativePath(const Json& frame, const char* key, const std::string& where) {
  std::string path = internal::StringField(frame, key, where);
  while (path.starts_with("./")) path.erase(0, 2);
  RequireSafeName(path, where + "." + key);
  return path;
}

}  // namespace

CameraList ReadTransformsJson(const std::filesystem::path& file,
                              const std::function<SizedImage(const std::string&)>& image_of) {
  const std::string source = file.string();
  const Json root = internal::ParseJson(ReadFile(file, kMaxFileBytes), source);
  const Json& frames = internal::Field(root, "frames", source);
  if (!frames.is_array() || frames.empty()) {
    throw Error(source + ": frames: expected a list of at least one camera, found another");
  }
  CameraList list;
  list.unit = LengthUnit::kArbitrary;
  std::set<std::string> names;
  const Eigen::DiagonalMatrix<double, 4> gl_from_cam(1, -1, -1, 1);
  for (size_t i = 0; i < frames.size(); ++i) {
    const std::string where = source + ": frames[" + std::to_string(i) + "]";
    const std::string path = RelativePath(frames[i], "file_path", where);
    const SizedImage image = image_of(path);
    const FrameFields fields(root, frames[i], where + " (" + path + ")");
    RefuseLens(fields);
    NamedCamera named;
    named.name = image.name;
    RequireSafeName(named.name, fields.where());
    named.camera = CameraFrom(fields, image);
    if (frames[i].contains("depth_file_path")) {
      named.depth_file = RelativePath(frames[i], "depth_file_path", where);
    }
    if (frames[i].contains("mask_path")) {
      named.mask_file = RelativePath(frames[i], "mask_path", where);
    }
    const Eigen::Matrix4d world_from_gl =
        internal::MatrixField(frames[i], "transform_matrix", true, fields.where());
    named.cam_from_world = PoseFromWorldFromCam(world_from_gl * gl_from_cam,
                                                kPrintedRotationTolerance, fields.where());
    if (!names.insert(named.name).second) {
      throw Error(fields.where() + ": expected unique images, found \"" + named.name + "\" twice");
    }
    list.cameras.push_back(named);
  }
  return list;
}

}  // namespace dtr::io
