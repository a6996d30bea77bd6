#include "dtr/io/formats/transforms_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "dtr/base/error.h"
#include "dtr/base/file_names.h"
#include "dtr/base/text_file.h"
#include "dtr/io/formats/json_fields.h"
#include "dtr/io/formats/plausible_intrinsics.h"
#include "dtr/io/formats/pose_from_matrix.h"
#include "dtr/io/formats/transforms_lens.h"

namespace dtr::io {
namespace {

using internal::Json;

constexpr std::uintmax_t kMaxTransformsBytes = 256u << 20;

using internal::FrameFields;

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
  const bool without_image = width_px == 0 && height_px == 0;
  if (without_image && !fields.Has("w")) {
    throw Error(fields.where() + ": says no size (w and h) and its image is not there");
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
  RequirePlausibleFocal(fx_px, fy_px, width_px, height_px, fields.where());
  const double cx_px = fields.Has("cx") ? fields.Number("cx") : width_px / 2.0;
  const double cy_px = fields.Has("cy") ? fields.Number("cy") : height_px / 2.0;
  const PinholeCamera camera(width_px, height_px, fx_px, fy_px, cx_px, cy_px);
  return without_image ? camera : ScaledToImage(camera, image, fields.where());
}

std::string RelativePath(const Json& object, const char* key, const std::string& where) {
  std::string path = internal::StringField(object, key, where);
  while (path.starts_with("./")) path.erase(0, 2);
  RequireSafeName(path, where + "." + key);
  return path;
}

// A depth map or mask that a frame names, as it is called below its folder; empty: none.
std::string OtherFile(const Json& frame, const char* key, const std::string& where,
                      const std::function<std::string(const std::string&)>& name_of) {
  if (!frame.contains(key) || frame[key].is_null()) return "";
  const std::string path = RelativePath(frame, key, where);
  if (!name_of) return path;
  const std::string name = name_of(path);
  RequireSafeName(name, where + "." + key);
  return name;
}

NamedCamera CameraOf(const Json& root, const Json& frame, const SizedImage& image,
                     const std::string& where, const std::string& path,
                     const TransformsPaths& paths) {
  const FrameFields fields(root, frame, where + " (" + path + ")");
  NamedCamera named;
  named.name = image.name;
  RequireSafeName(named.name, fields.where());
  named.camera = CameraFrom(fields, image);
  named.distortion = internal::DistortionFrom(fields, named.camera);
  named.depth_file = OtherFile(frame, "depth_file_path", where, paths.depth_of);
  named.mask_file = OtherFile(frame, "mask_path", where, paths.mask_of);
  const Eigen::DiagonalMatrix<double, 4> gl_from_cam(1, -1, -1, 1);
  const Eigen::Matrix4d world_from_gl =
      internal::MatrixField(frame, "transform_matrix", true, fields.where());
  named.cam_from_world =
      PoseFromWorldFromCam(world_from_gl * gl_from_cam, kPrintedRotationTolerance, fields.where());
  return named;
}

// A path as lists of a file may write it in another way than its frames: one separator, no "./".
std::string Plain(std::string path) {
  std::replace(path.begin(), path.end(), '\\', '/');
  while (path.starts_with("./")) path.erase(0, 2);
  return path;
}

std::set<std::string> NamesIn(const Json& root, const char* key, const std::string& source) {
  std::set<std::string> names;
  if (!root.contains(key) || root[key].is_null()) return names;
  const Json& list = root[key];
  if (!list.is_array()) throw Error(source + ": " + key + ": expected a list of names");
  for (const Json& name : list) {
    if (!name.is_string()) throw Error(source + ": " + key + ": expected names, found another");
    names.insert(Plain(name.get<std::string>()));
  }
  return names;
}

// The roles that the file's lists give its frames. `paths_of`: of each camera, as the file has it.
void ReadSplit(const Json& root, const std::string& source,
               const std::vector<std::string>& paths_of, TransformsFile& out) {
  const std::set<std::string> train = NamesIn(root, "train_filenames", source);
  std::set<std::string> held_out = NamesIn(root, "test_filenames", source);
  held_out.merge(NamesIn(root, "val_filenames", source));
  if (train.empty() && held_out.empty()) return;
  std::set<std::string> unknown = held_out;
  unknown.insert(train.begin(), train.end());
  for (const FrameWithoutPhoto& frame : out.missing) unknown.erase(Plain(frame.path));
  out.held_out.emplace();
  size_t in_no_list = 0;
  for (size_t i = 0; i < paths_of.size(); ++i) {
    const std::string path = Plain(paths_of[i]);
    unknown.erase(path);
    const bool trained = train.contains(path), tested = held_out.contains(path);
    if (tested && !trained) out.held_out->insert(out.list.cameras[i].name);
    in_no_list += !trained && !tested && !train.empty();
  }
  if (in_no_list > 0) {
    out.notes.push_back(fmt::format(
        "{}: {} frames are in none of train_filenames, test_filenames and val_filenames: they are "
        "used as source views",
        source, in_no_list));
  }
  if (!unknown.empty()) {
    out.notes.push_back(
        fmt::format("{}: {} names of train_filenames, test_filenames or val_filenames are those of "
                    "no frame, first {}",
                    source, unknown.size(), Printable(*unknown.begin())));
  }
}

std::optional<double> DepthUnit(const Json& root, const std::string& source) {
  std::optional<double> unit;
  for (const char* key : {"depth_unit_scale_factor", "integer_depth_scale"}) {
    if (!root.contains(key) || root[key].is_null()) continue;
    const double given = internal::NumberField(root, key, source);
    if (!(given > 0) || (unit && *unit != given)) {
      throw Error(source + ": " + key + ": expected one positive depth unit, found another");
    }
    unit = given;
  }
  return unit;
}

// Everything that nothing above reads, by name.
void NoteUnused(const Json& root, const Json& frames, const std::string& source,
                TransformsFile& out) {
  std::set<std::string> used = {"frames",
                                "file_path",
                                "transform_matrix",
                                "depth_file_path",
                                "mask_path",
                                "fl_x",
                                "fl_y",
                                "cx",
                                "cy",
                                "w",
                                "h",
                                "camera_angle_x",
                                "camera_angle_y",
                                "train_filenames",
                                "test_filenames",
                                "val_filenames",
                                "depth_unit_scale_factor",
                                "integer_depth_scale",
                                "ply_file_path"};
  used.insert(internal::DistortionFields().begin(), internal::DistortionFields().end());
  std::set<std::string> unused;
  const auto look = [&](const Json& object) {
    for (const auto& [key, value] : object.items()) {
      if (!used.contains(key)) unused.insert(Printable(key));
    }
  };
  look(root);
  for (const Json& frame : frames) look(frame);
  const bool moved = unused.contains("applied_transform") || unused.contains("applied_scale");
  constexpr size_t kMaxNamed = 12;
  std::string names;
  size_t named = 0;
  for (const std::string& name : unused) {
    if (named++ == kMaxNamed) break;
    names += (names.empty() ? "" : ", ") + name;
  }
  if (unused.size() > kMaxNamed) names += fmt::format(" and {} more", unused.size() - kMaxNamed);
  if (!unused.empty()) {
    out.notes.push_back(fmt::format(
        "{}: fields that are not used: {}{}", source, names,
        moved ? "; cameras and depth stay in the world of this file, not of what it was made from"
              : ""));
  }
}

}  // namespace

TransformsFile ReadTransformsJson(const std::filesystem::path& file, const TransformsPaths& paths) {
  const std::string source = file.string();
  const Json root = internal::ParseJson(ReadTextFile(file, kMaxTransformsBytes), source);
  const Json& frames = internal::Field(root, "frames", source);
  if (!frames.is_array() || frames.empty()) {
    throw Error(source + ": frames: expected a list of at least one camera, found another");
  }
  TransformsFile out;
  out.list.unit = LengthUnit::kUnknown;
  out.list.photo_grid = PhotoGrid::kStored;  // these programs do not turn photos
  std::set<std::string> names;
  std::vector<std::string> paths_of;
  for (size_t i = 0; i < frames.size(); ++i) {
    const std::string where = source + ": frames[" + std::to_string(i) + "]";
    const std::string path = RelativePath(frames[i], "file_path", where);
    const std::optional<SizedImage> image = paths.image_of(path);
    if (!image) {
      out.missing.push_back({i, path});
      continue;
    }
    out.list.cameras.push_back(CameraOf(root, frames[i], *image, where, path, paths));
    paths_of.push_back(path);
    const std::string& name = out.list.cameras.back().name;
    if (!names.insert(name).second) {
      throw Error(where + " (" + path + "): expected unique images, found \"" + name + "\" twice");
    }
  }
  ReadSplit(root, source, paths_of, out);
  out.depth_unit = DepthUnit(root, source);
  if (root.contains("ply_file_path") && root["ply_file_path"].is_string()) {
    out.points_file = Printable(root["ply_file_path"].get<std::string>());
  }
  NoteUnused(root, frames, source, out);
  return out;
}

bool IsTransformsJson(const std::filesystem::path& file) {
  if (file.extension() != ".json" || !std::filesystem::is_regular_file(file)) return false;
  const Json root = internal::ParseJson(ReadTextFile(file, kMaxTransformsBytes), file.string());
  return root.is_object() && root.contains("frames") && !root.contains("views");
}

}  // namespace dtr::io
