#include "dtr/io/formats/cameras_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <stdexcept>

#include "dtr/base/error.h"
#include "dtr/base/file_names.h"
#include "dtr/base/files.h"
#include "dtr/base/text_file.h"
#include "dtr/io/formats/json_fields.h"
#include "dtr/io/formats/plausible_intrinsics.h"
#include "dtr/io/formats/pose_from_matrix.h"
#include "dtr/types/computable.h"

namespace dtr::io {
namespace {

using internal::Json;

constexpr std::uintmax_t kMaxListBytes = 256u << 20;  // 1 KB a camera: a quarter of a million

LengthUnit UnitFrom(const Json& root, const std::string& source) {
  if (!root.contains("unit")) return LengthUnit::kUnknown;
  const std::string unit = internal::StringField(root, "unit", source);
  if (unit == "unknown") return LengthUnit::kUnknown;
  if (unit == "arbitrary") return LengthUnit::kArbitrary;
  if (unit == "metre") return LengthUnit::kMetre;
  throw Error(source + ": unit: expected \"unknown\", \"arbitrary\" or \"metre\", found " +
              Json(unit).dump(-1, ' ', true, Json::error_handler_t::replace));
}

Eigen::Vector3d OriginFrom(const Json& root, const std::string& source) {
  if (!root.contains("world_origin")) return Eigen::Vector3d::Zero();
  const std::string where = source + ": world_origin";
  const Json& origin = root["world_origin"];
  if (!origin.is_array() || origin.size() != 3) {
    throw Error(where + ": expected [x, y, z], found another shape");
  }
  return {internal::NumberFrom(origin[0], where), internal::NumberFrom(origin[1], where),
          internal::NumberFrom(origin[2], where)};
}

std::string OptionalFile(const Json& view, const char* key, const std::string& where) {
  if (!view.contains(key)) return "";
  const std::string name = internal::StringField(view, key, where);
  RequireSafeName(name, where + "." + key);
  return name;
}

DepthKind DepthKindFrom(const Json& view, const std::string& where) {
  if (!view.contains("depth_kind")) return DepthKind::kPlaneZ;
  const std::string kind = internal::StringField(view, "depth_kind", where);
  if (kind == "z") return DepthKind::kPlaneZ;
  if (kind == "ray") return DepthKind::kRayDistance;
  throw Error(where + ".depth_kind: expected \"z\" or \"ray\", found another");
}

double FocalField(const Json& view, const char* key, const std::string& where) {
  const double focal_px = internal::NumberField(view, key, where);
  if (!(focal_px > 0)) {
    throw Error(where + "." + key + ": expected a positive focal length, found " +
                std::to_string(focal_px));
  }
  return focal_px;
}

NamedCamera CameraFrom(const Json& view, const std::string& where) {
  NamedCamera named;
  named.name = internal::StringField(view, "name", where);
  RequireSafeName(named.name, where + ".name");
  const std::string here = where + " (" + named.name + ")";
  named.depth_file = OptionalFile(view, "depth", here);
  named.mask_file = OptionalFile(view, "mask", here);
  named.depth_kind = DepthKindFrom(view, here);
  const int width_px = internal::IntField(view, "width", 1, kMaxImageSidePx, here);
  const int height_px = internal::IntField(view, "height", 1, kMaxImageSidePx, here);
  named.camera = PinholeCamera(
      width_px, height_px, FocalField(view, "fx", here), FocalField(view, "fy", here),
      internal::NumberField(view, "cx", here), internal::NumberField(view, "cy", here));
  RequirePlausibleFocal(named.camera.fx_px(), named.camera.fy_px(), width_px, height_px, here);
  named.cam_from_world = PoseFromMatrix(internal::MatrixField(view, "cam_from_world", false, here),
                                        kRotationTolerance, here + ".cam_from_world");
  return named;
}

}  // namespace

CameraList ParseCamerasJson(std::string_view text, const std::string& source) {
  const Json root = internal::ParseJson(text, source);
  const Json& views = internal::Field(root, "views", source);
  if (!views.is_array() || views.empty()) {
    throw Error(source + ": views: expected a list of at least one camera, found another");
  }
  CameraList list;
  list.unit = UnitFrom(root, source);
  list.world_origin = OriginFrom(root, source);
  std::set<std::string> names;
  for (size_t i = 0; i < views.size(); ++i) {
    const std::string where = source + ": views[" + std::to_string(i) + "]";
    list.cameras.push_back(CameraFrom(views[i], where));
    if (!names.insert(list.cameras.back().name).second) {
      throw Error(where + ".name: expected unique names, found \"" + list.cameras.back().name +
                  "\" twice");
    }
  }
  return list;
}

CameraList ReadCamerasJson(const std::filesystem::path& file) {
  return ParseCamerasJson(ReadTextFile(file, kMaxListBytes), file.string());
}

std::string FormatCamerasJson(const CameraList& list) {
  Json root;
  root["unit"] = NameOf(list.unit);
  root["world_origin"] = {list.world_origin.x(), list.world_origin.y(), list.world_origin.z()};
  root["pixel_origin"] = "outer corner of the top-left pixel; its centre is (0.5, 0.5)";
  root["camera_axes"] = "x right, y down, z forward";
  root["matrix_order"] = "4x4 row-major";
  root["views"] = Json::array();
  for (const NamedCamera& named : list.cameras) {
    if (named.distortion) {
      throw std::invalid_argument("FormatCamerasJson: a cameras.json holds no distortion");
    }
    Json view;
    view["name"] = named.name;
    if (!named.depth_file.empty()) {
      view["depth"] = named.depth_file;
      view["depth_kind"] = named.depth_kind == DepthKind::kPlaneZ ? "z" : "ray";
    }
    if (!named.mask_file.empty()) view["mask"] = named.mask_file;
    view["width"] = named.camera.width_px();
    view["height"] = named.camera.height_px();
    view["fx"] = named.camera.fx_px();
    view["fy"] = named.camera.fy_px();
    view["cx"] = named.camera.cx_px();
    view["cy"] = named.camera.cy_px();
    const Eigen::Matrix4d matrix = MatrixFromPose(named.cam_from_world);
    view["cam_from_world"] = Json::array();
    for (int i = 0; i < 4; ++i) {
      view["cam_from_world"].push_back({matrix(i, 0), matrix(i, 1), matrix(i, 2), matrix(i, 3)});
    }
    root["views"].push_back(std::move(view));
  }
  try {
    return root.dump(1) + "\n";
  } catch (const nlohmann::json::exception&) {  // the only cause is text that is not UTF-8
    throw Error("cameras.json: expected names in UTF-8, found others; rename the photos");
  }
}

void WriteCamerasJson(const std::filesystem::path& file, const CameraList& list) {
  const std::string text = FormatCamerasJson(list);
  ParseCamerasJson(text, file.string());  // what we could not read back is not worth writing
  WriteFileAtomically(file, text);
}

void RequireComputable(const CameraList& list, const std::string& source) {
  std::optional<Eigen::Vector3d> first;
  double spread = 0;
  for (const NamedCamera& named : list.cameras) {
    const Eigen::Vector3d centre = named.cam_from_world.TargetOriginInSource();
    const double away = std::max(centre.cwiseAbs().maxCoeff(),
                                 named.cam_from_world.translation.cwiseAbs().maxCoeff());
    if (!(away <= kMaxLength)) {
      throw Error(fmt::format(
          "{}: {}: its position, {:.3g} units from the origin, cannot be computed with; give "
          "positions within {:g} units, in another unit or from another origin",
          source, named.name, away, kMaxLength));
    }
    if (!first) first = centre;
    spread = std::max(spread, (centre - *first).cwiseAbs().maxCoeff());
  }
  if (spread == 0 || spread >= kMinLength) return;
  throw Error(fmt::format(
      "{}: its cameras, within {:.3g} units of each other, cannot be computed with; give positions "
      "that are {:g} units apart at least, in another unit",
      source, spread, kMinLength));
}

CameraList RecentreWorld(CameraList list) {
  using Vector3l = Eigen::Matrix<long double, 3, 1>;
  constexpr double kFarInSpreads = 100;  // at 100 spreads float32 still holds 1e-5 of the spread
  if (list.cameras.empty()) return list;
  Vector3l sum = Vector3l::Zero();
  for (const NamedCamera& named : list.cameras) {
    sum += named.cam_from_world.TargetOriginInSource().cast<long double>();
  }
  const Eigen::Vector3d centroid =
      (sum / static_cast<long double>(list.cameras.size())).cast<double>();
  double spread = 0;
  for (const NamedCamera& named : list.cameras) {
    spread = std::max(spread, (named.cam_from_world.TargetOriginInSource() - centroid).norm());
  }
  if (!(centroid.norm() > kFarInSpreads * spread)) return list;

  // Multiples of a power of two near the spread: few significant bits, so sums with it stay exact.
  const double step = spread > 0 ? std::exp2(std::ceil(std::log2(spread))) : 1.0;
  const Eigen::Vector3d move(std::round(centroid.x() / step) * step,
                             std::round(centroid.y() / step) * step,
                             std::round(centroid.z() / step) * step);
  list.world_origin += move;
  for (NamedCamera& named : list.cameras) {
    Pose& pose = named.cam_from_world;
    const auto rotation = pose.rotation.cast<long double>().normalized().toRotationMatrix();
    pose.translation =
        (pose.translation.cast<long double>() + rotation * move.cast<long double>()).cast<double>();
  }
  return list;
}

}  // namespace dtr::io
