#include "dtr/io/set_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "dtr/base/error.h"
#include "dtr/base/file_names.h"
#include "dtr/io/depth_io.h"
#include "dtr/io/held_out_files.h"
#include "dtr/io/json_fields.h"
#include "dtr/io/video_frames.h"
#include "dtr/types/computable.h"

namespace dtr::io {
namespace {

namespace fs = std::filesystem;

// Quaternions written with 7 digits by other programs pass; a wrong one does not.
constexpr double kUnitQuaternion = 1e-6;
constexpr size_t kLongestId = 200;  // most file systems stop at 255 bytes
constexpr char kFormatName[] = "dtr-set";

LengthUnit UnitOf(const JsonObject& set) {
  const std::string name = set.String("unit");
  for (const auto unit : {LengthUnit::kUnknown, LengthUnit::kArbitrary, LengthUnit::kMetre}) {
    if (name == NameOf(unit)) return unit;
  }
  set.Fail("unit", "\"unknown\", \"arbitrary\" or \"metre\"");
}

// Relative, with '/' between plain names: nothing that leaves the folder on any system.
bool IsSafePath(const std::string& path) {
  const fs::path parts(path);
  const bool plain = std::all_of(path.begin(), path.end(), [](unsigned char c) {
    return c >= 32 && c != 127 && c != '\\' && c != ':';
  });
  return plain && !path.empty() && parts.is_relative() && path.back() != '/' &&
         path.find("//") == std::string::npos &&
         std::none_of(parts.begin(), parts.end(),
                      [](const fs::path& part) { return part == ".." || part == "."; });
}

bool IsHexSha256(const std::string& text) {
  return text.size() == 64 && std::all_of(text.begin(), text.end(), [](char c) {
           return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
         });
}

std::string PathFrom(const JsonObject& object) {
  const std::string path = object.String("path");
  if (!IsSafePath(path)) object.Fail("path", "a relative path inside the set's folder");
  return path;
}

template <typename Vector>
Json NumbersToJson(const Vector& numbers) {
  Json array = Json::array();
  for (const double number : numbers) array.push_back(number);
  return array;
}

// Unknown fields of a nested object are kept under its key.
void Nest(Json& extra, const std::string& key, const Json& unknown) {
  if (!unknown.empty()) extra[key] = unknown;
}

std::string TextOrEmpty(const Json& extra) { return extra.empty() ? "" : extra.dump(); }

// Puts kept fields back. Those of a nested object are dropped with the object itself: a depth map
// that is gone takes with it what was said about it.
void Restore(Json& object, const std::string& extra_json, const std::set<std::string>& nested) {
  if (extra_json.empty()) return;
  const Json extra = ParseJson(extra_json, "extra_json");
  if (!extra.is_object()) throw Error("extra_json: expected an object, found " + extra_json);
  for (const auto& [key, value] : extra.items()) {
    if (nested.count(key) == 0) {
      if (!object.contains(key)) object[key] = value;
    } else if (object.contains(key) && object[key].is_object() && value.is_object()) {
      for (const auto& [inner_key, inner] : value.items()) {
        if (!object[key].contains(inner_key)) object[key][inner_key] = inner;
      }
    }
  }
}

PinholeCamera CameraFrom(const JsonObject& object) {
  if (object.String("model") != "pinhole") object.Fail("model", "\"pinhole\"");
  const int width_px = object.PositiveInt("width_px");
  const int height_px = object.PositiveInt("height_px");
  if (static_cast<std::uint64_t>(width_px) * static_cast<std::uint64_t>(height_px) >
      kImageLimitPx) {
    object.Fail("width_px", "an image of at most " + std::to_string(kImageLimitPx) + " pixels",
                std::to_string(width_px) + "x" + std::to_string(height_px));
  }
  return {width_px,
          height_px,
          object.Positive("fx_px"),
          object.Positive("fy_px"),
          object.Number("cx_px"),
          object.Number("cy_px")};
}

Json ToJson(const PinholeCamera& camera) {
  return {
      {"model", "pinhole"},      {"width_px", camera.width_px()}, {"height_px", camera.height_px()},
      {"fx_px", camera.fx_px()}, {"fy_px", camera.fy_px()},       {"cx_px", camera.cx_px()},
      {"cy_px", camera.cy_px()}};
}

Pose PoseFrom(const JsonObject& object) {
  const Eigen::VectorXd wxyz = object.Numbers("rotation_wxyz", 4);
  if (!(std::abs(wxyz.norm() - 1) <= kUnitQuaternion)) {
    object.Fail("rotation_wxyz", "a quaternion of length 1", "length " + Json(wxyz.norm()).dump());
  }
  const Eigen::Vector3d translation = object.Numbers("translation", 3);
  if (!(translation.cwiseAbs().maxCoeff() <= kMaxLength)) {
    object.Fail("translation", fmt::format("3 numbers within {:g} of 0", kMaxLength));
  }
  return {Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]), translation};
}

Json ToJson(const Pose& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  return {{"rotation_wxyz", {q.w(), q.x(), q.y(), q.z()}},
          {"translation", NumbersToJson(pose.translation)}};
}

// The file that another one is differences to, if it is.
std::optional<StoredFile> BaseFrom(const JsonObject& object) {
  if (!object.Has("base")) return {};
  const JsonObject base = object.Object("base");
  const StoredFile file = StoredFileFromJson(base);
  if (!base.Unknown().empty()) object.Fail("base", "path, sha256 and bytes alone");
  return file;
}

void BaseToJson(const std::optional<StoredFile>& base, Json& object) {
  if (base) object["base"] = JsonFromStoredFile(*base);
}

// Fills the view's depth fields; returns what was not known.
Json DepthFrom(const JsonObject& object, View& view) {
  view.depth_file = StoredFileFromJson(object);
  const std::string coding = object.String("coding");
  try {
    view.depth_coding = DepthCodingFromName(coding);
  } catch (const UsageError&) {
    object.Fail("coding", "exr-float, exr-half, png16-mm, png16-inverse or zstd-inverse");
  }
  if (view.depth_coding == DepthCoding::kZstdInverseDepth) {
    view.depth_steps = object.PositiveInt("steps");
    if (view.depth_steps > InverseDepthCode::kSteps) object.Fail("steps", "1 to 65534");
    view.depth_base = BaseFrom(object);
  } else if (object.Has("base")) {
    object.Fail("base", "a base beside zstd-inverse only");
  }
  if (object.String("kind") != "plane-z") object.Fail("kind", "\"plane-z\"");
  view.depth_scale = object.PositiveInt("scale");
  if (view.camera.width_px() % view.depth_scale != 0 ||
      view.camera.height_px() % view.depth_scale != 0) {
    object.Fail("scale", "a divisor of the image's " + std::to_string(view.camera.width_px()) +
                             "x" + std::to_string(view.camera.height_px()));
  }
  view.near_z = object.Positive("near_z");
  view.far_z = object.Positive("far_z");
  if (!(view.near_z < view.far_z)) object.Fail("far_z", "more than near_z");
  return object.Unknown();
}

// The same for the completed depth.
Json CompletedFrom(const JsonObject& object, View& view) {
  view.completed_file = StoredFileFromJson(object);
  view.completed_base = BaseFrom(object);
  view.completed_steps = object.PositiveInt("steps");
  if (view.completed_steps > InverseDepthCode::kSteps) object.Fail("steps", "1 to 65534");
  view.completed_near_z = object.Positive("near_z");
  view.completed_far_z = object.Positive("far_z");
  if (!(view.completed_near_z < view.completed_far_z)) object.Fail("far_z", "more than near_z");
  return object.Unknown();
}

Json CompletedToJson(const View& view) {
  Json completed = JsonFromStoredFile(*view.completed_file);
  completed["steps"] = view.completed_steps;
  completed["near_z"] = view.completed_near_z;
  completed["far_z"] = view.completed_far_z;
  BaseToJson(view.completed_base, completed);
  return completed;
}

Json DepthToJson(const View& view) {
  Json depth = JsonFromStoredFile(*view.depth_file);
  depth["coding"] = NameOf(view.depth_coding);
  if (view.depth_coding == DepthCoding::kZstdInverseDepth) depth["steps"] = view.depth_steps;
  depth["kind"] = "plane-z";
  depth["scale"] = view.depth_scale;
  depth["near_z"] = view.near_z;
  depth["far_z"] = view.far_z;
  BaseToJson(view.depth_base, depth);
  return depth;
}

// A held-out photo must not be found among the sources, nor the other way round.
void ExpectFolder(const JsonObject& object, const View& view, const std::optional<StoredFile>& file,
                  const std::string& key) {
  if (!file) return;
  const bool in_held_out = file->path.rfind(kHeldOutFolder, 0) == 0;
  if (in_held_out == (view.role == ViewRole::kHeldOut)) return;
  object.Fail(key + ".path",
              in_held_out ? "a path outside held_out/ for a source" : "a path in held_out/",
              "\"" + file->path + "\"");
}

int FrameNumberFrom(const JsonObject& image, const View& view) {
  const std::uint64_t frame = image.Unsigned("frame");
  if (frame >= kMaxVideoFrames) {
    image.Fail("frame", "a number below " + std::to_string(kMaxVideoFrames));
  }
  if (view.role == ViewRole::kHeldOut) image.Fail("frame", "an image, as held-out views have");
  return static_cast<int>(frame);
}

void FilesFrom(const JsonObject& object, View& view, Json& extra) {
  const auto read = [&](const std::string& key, std::optional<StoredFile>& file) {
    if (!object.Has(key)) return;
    const JsonObject entry = object.Object(key);
    // set.json does not tell what a held-out file contains; held_out/files.json does.
    const bool told_elsewhere = view.role == ViewRole::kHeldOut && !entry.Has("sha256");
    file = told_elsewhere ? StoredFile{PathFrom(entry), "", 0} : StoredFileFromJson(entry);
    if (key == "sigma") view.sigma_base = BaseFrom(entry);
    if (key == "image" && entry.Has("frame")) view.image_frame = FrameNumberFrom(entry, view);
    Nest(extra, key, entry.Unknown());
  };
  read("image", view.image_file);
  read("mask", view.mask_file);
  read("sigma", view.sigma_file);
  read("mesh", view.mesh_file);
  if (object.Has("depth")) {
    const JsonObject depth = object.Object("depth");
    Nest(extra, "depth", DepthFrom(depth, view));
  }
  if (object.Has("completed_depth")) {
    const JsonObject completed = object.Object("completed_depth");
    Nest(extra, "completed_depth", CompletedFrom(completed, view));
  }
  if (view.role == ViewRole::kHeldOut && (view.depth_file || view.sigma_file)) {
    object.Fail(view.depth_file ? "depth" : "sigma", "no depth in a held-out view");
  }
  if (view.sigma_file && !view.depth_file) object.Fail("sigma", "a sigma only beside a depth");
  if (view.mesh_file && !view.depth_file) object.Fail("mesh", "a mesh only beside a depth");
  if (view.completed_file && !view.depth_file) {
    object.Fail("completed_depth", "completed depth only beside a depth");
  }
  ExpectFolder(object, view, view.image_file, "image");
  ExpectFolder(object, view, view.mask_file, "mask");
  ExpectFolder(object, view, view.depth_file, "depth");
  ExpectFolder(object, view, view.sigma_file, "sigma");
  ExpectFolder(object, view, view.mesh_file, "mesh");
  ExpectFolder(object, view, view.completed_file, "completed_depth");
  ExpectFolder(object, view, view.depth_base, "depth.base");
  ExpectFolder(object, view, view.completed_base, "completed_depth.base");
  ExpectFolder(object, view, view.sigma_base, "sigma.base");
}

View ViewFrom(const JsonObject& object) {
  View view;
  view.id = object.String("id");
  if (!IsSafeId(view.id)) object.Fail("id", "1 to 200 of the characters A-Z a-z 0-9 . _ -");
  view.name = object.String("name");
  // Commands put it behind a folder of photos, or behind one that they write.
  if (!WhyUnsafeName(view.name).empty()) {
    object.Fail("name", "the photo's name, a relative path inside its folder");
  }
  const std::string role = object.String("role");
  if (role != NameOf(ViewRole::kSource) && role != NameOf(ViewRole::kHeldOut)) {
    object.Fail("role", "\"source\" or \"held_out\"");
  }
  view.role = role == NameOf(ViewRole::kSource) ? ViewRole::kSource : ViewRole::kHeldOut;
  const JsonObject camera = object.Object("camera"), pose = object.Object("cam_from_world");
  view.camera = CameraFrom(camera);
  view.cam_from_world = PoseFrom(pose);
  Json nested = Json::object();
  FilesFrom(object, view, nested);
  if (object.Has("reference_baseline")) {
    view.reference_baseline = object.Number("reference_baseline");
    if (view.reference_baseline < 0) object.Fail("reference_baseline", "a number of at least 0");
  }
  if (object.Has("gain_linear_rgb")) {
    view.gain = object.Numbers("gain_linear_rgb", 3);
    if (!(view.gain.minCoeff() > 0)) object.Fail("gain_linear_rgb", "3 positive numbers");
  }
  Nest(nested, "camera", camera.Unknown());
  Nest(nested, "cam_from_world", pose.Unknown());
  Json extra = object.Unknown();
  extra.update(nested);
  view.extra_json = TextOrEmpty(extra);
  return view;
}

enum class Hashes { kAll, kOfSources };

Json ToJson(const View& view, Hashes hashes) {
  const auto entry = [&](const StoredFile& file) {
    const bool told_elsewhere = hashes == Hashes::kOfSources && view.role == ViewRole::kHeldOut;
    return told_elsewhere ? Json{{"path", file.path}} : JsonFromStoredFile(file);
  };
  Json object = {{"id", view.id},
                 {"name", view.name},
                 {"role", NameOf(view.role)},
                 {"camera", ToJson(view.camera)},
                 {"cam_from_world", ToJson(view.cam_from_world)}};
  if (view.image_file) {
    object["image"] = entry(*view.image_file);
    if (view.image_frame) object["image"]["frame"] = *view.image_frame;
  }
  if (view.mask_file) object["mask"] = entry(*view.mask_file);
  if (view.depth_file) object["depth"] = DepthToJson(view);
  if (view.completed_file) object["completed_depth"] = CompletedToJson(view);
  if (view.sigma_file) {
    object["sigma"] = entry(*view.sigma_file);
    BaseToJson(view.sigma_base, object["sigma"]);
  }
  if (view.mesh_file) object["mesh"] = entry(*view.mesh_file);
  object["reference_baseline"] = view.reference_baseline;
  object["gain_linear_rgb"] = NumbersToJson(view.gain);
  Restore(
      object, view.extra_json,
      {"camera", "cam_from_world", "image", "mask", "depth", "completed_depth", "sigma", "mesh"});
  return object;
}

void ExpectVersion(const JsonObject& root) {
  if (root.String("format") != kFormatName) root.Fail("format", "\"dtr-set\"");
  const int version = root.PositiveInt("format_version");
  if (version > kNewestFormatVersion) {
    root.Fail("format_version", "1 or " + std::to_string(kNewestFormatVersion),
              std::to_string(version) + "; read it with the version of dtr that wrote it");
  }
}

Frame FrameFrom(const JsonObject& object, LengthUnit unit, std::set<std::string>& ids) {
  Frame frame;
  if (object.Has("time_s")) frame.time_s = object.Number("time_s");
  const Json& views = object.Array("views");
  if (views.empty()) object.Fail("views", "at least one view");
  for (size_t i = 0; i < views.size(); ++i) {
    const JsonObject item = object.Item("views", i);
    frame.views.push_back(ViewFrom(item));
    const View& view = frame.views.back();
    if (!view.image_file) item.Fail("image", "an object");
    if (!ids.insert(view.id).second) item.Fail("id", "an id that no other view has");
    if (view.depth_file && view.depth_coding == DepthCoding::kPng16Millimetre &&
        unit != LengthUnit::kMetre) {
      item.Fail("depth.coding", "another coding, as png16-mm needs the unit metre", "png16-mm");
    }
  }
  frame.extra_json = TextOrEmpty(object.Unknown());
  return frame;
}

Json ToJson(const Frame& frame) {
  Json views = Json::array();
  for (const View& view : frame.views) views.push_back(ToJson(view, Hashes::kOfSources));
  Json object = {{"time_s", frame.time_s}, {"views", std::move(views)}};
  Restore(object, frame.extra_json, {});
  return object;
}

std::string ObjectText(const JsonObject& root, const std::string& key) {
  if (!root.Has(key)) return "{}";
  (void)root.Object(key);  // rejects anything else
  return root.Value(key).dump();
}

DtrSet SetFrom(const JsonObject& root) {
  ExpectVersion(root);
  DtrSet set;
  set.unit = UnitOf(root);
  set.world_origin = root.Numbers("world_origin", 3);
  set.scene_center = root.Numbers("scene_center", 3);
  Json nested = Json::object();
  if (root.Has("bounds")) {
    const JsonObject bounds = root.Object("bounds");
    set.bounds.min = bounds.Numbers("min", 3);
    set.bounds.max = bounds.Numbers("max", 3);
    if (set.bounds.empty()) root.Fail("bounds", "min of at most max on every axis");
    Nest(nested, "bounds", bounds.Unknown());
  }
  if (root.Has("sparse")) {
    const JsonObject sparse = root.Object("sparse");
    set.sparse_file = StoredFileFromJson(sparse);
    Nest(nested, "sparse", sparse.Unknown());
  }
  const Json& frames = root.Array("frames");
  if (frames.empty()) root.Fail("frames", "at least one frame");
  std::set<std::string> ids;
  for (size_t i = 0; i < frames.size(); ++i) {
    set.frames.push_back(FrameFrom(root.Item("frames", i), set.unit, ids));
  }
  set.provenance_json = ObjectText(root, "provenance");
  set.validation_json = ObjectText(root, "verdict");
  Json extra = root.Unknown();
  extra.update(nested);
  set.extra_json = TextOrEmpty(extra);
  return set;
}

}  // namespace

int FormatVersionOf(const DtrSet& set) {
  const auto needs_second = [](const View& view) {
    return view.depth_base || view.completed_base || view.sigma_base || view.image_frame;
  };
  for (const Frame& frame : set.frames) {
    if (std::any_of(frame.views.begin(), frame.views.end(), needs_second)) return 2;
  }
  return 1;
}

StoredFile StoredFileFromJson(const JsonObject& object) {
  StoredFile file{PathFrom(object), object.String("sha256"), object.Unsigned("bytes")};
  if (!IsHexSha256(file.sha256)) object.Fail("sha256", "64 lower-case hexadecimal digits");
  return file;
}

Json JsonFromStoredFile(const StoredFile& file) {
  return {{"path", file.path}, {"sha256", file.sha256}, {"bytes", file.bytes}};
}

bool IsSafeId(const std::string& id) {
  return !id.empty() && id.size() <= kLongestId && id[0] != '.' &&
         std::all_of(id.begin(), id.end(), [](unsigned char c) {
           return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                  c == '.' || c == '_' || c == '-';
         });
}

DtrSet SetFromJson(const std::string& text, const std::string& file) {
  const Json root = ParseJson(text, file);
  return SetFrom(JsonObject(root, file, ""));
}

std::string JsonFromSet(const DtrSet& set, const std::string& file) {
  Json root = {{"format", kFormatName},
               {"format_version", FormatVersionOf(set)},
               {"unit", NameOf(set.unit)},
               {"world_origin", NumbersToJson(set.world_origin)},
               {"scene_center", NumbersToJson(set.scene_center)}};
  if (!set.bounds.empty()) {
    root["bounds"] = {{"min", NumbersToJson(set.bounds.min)},
                      {"max", NumbersToJson(set.bounds.max)}};
  }
  if (set.sparse_file) root["sparse"] = JsonFromStoredFile(*set.sparse_file);
  root["frames"] = Json::array();
  for (const Frame& frame : set.frames) root["frames"].push_back(ToJson(frame));
  root["provenance"] = ParseJson(set.provenance_json, file + ": provenance");
  root["verdict"] = ParseJson(set.validation_json, file + ": verdict");
  Restore(root, set.extra_json, {"bounds", "sparse"});
  const std::string text = PrettyJson(root, file);
  SetFromJson(text, file);  // NaN turns into null here and is rejected with its field
  return text;
}

std::string JsonFromView(const View& view, const std::string& file) {
  const std::string text = PrettyJson(ToJson(view, Hashes::kAll), file);
  ViewFromJson(text, file);
  return text;
}

View ViewFromJson(const std::string& text, const std::string& file) {
  const Json root = ParseJson(text, file);
  return ViewFrom(JsonObject(root, file, ""));
}

}  // namespace dtr::io
