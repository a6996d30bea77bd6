#include <fmt/format.h>

#include <array>
#include <map>

#include "dtr/base/error.h"
#include "dtr/base/file_names.h"
#include "dtr/io/formats/foreign_readers.h"
#include "dtr/io/formats/json_tree.h"
#include "dtr/io/formats/pose_from_matrix.h"

namespace dtr::io {
namespace {

using namespace internal;

constexpr double kAliceVisionOffsetPx = 0.5;  // the first pixel's centre is (0, 0) there

using Version = std::array<int, 3>;

Version VersionOf(const Tree& root, const std::string& source) {
  const std::vector<double> numbers = GetNumbers(root, "version", 3, source);
  Version version{};
  for (size_t i = 0; i < 3; ++i) {
    if (!(numbers[i] >= 0 && numbers[i] < 1000)) {
      throw Error(source + ".version: expected three small numbers, found others");
    }
    version[i] = static_cast<int>(numbers[i]);
  }
  return version;
}

// What the versions changed: pixels became millimetres with 1.2.2, the principal point relative to
// the image's middle with 1.2.1, pixelRatio the inverse of what it was with 1.2.5.
void ReadScaleAndOffset(const Tree& tree, const Version& version, const std::string& where,
                        ForeignIntrinsics& intrinsics, BrownTerms& terms) {
  if (version < Version{1, 2, 0}) {
    terms.fx = terms.fy = GetNumber(tree, "pxFocalLength", where);
  } else if (version < Version{1, 2, 2}) {
    const std::vector<double> focal = GetNumbers(tree, "pxFocalLength", 2, where);
    terms.fx = focal[0];
    terms.fy = focal[1];
  } else {
    const double width_mm = GetNumberOr(tree, "sensorWidth", 36, where);
    if (!(width_mm > 0)) {
      throw Error(
          fmt::format("{}.sensorWidth: expected millimetres above 0, found {}", where, width_mm));
    }
    const double ratio = GetNumberOr(tree, "pixelRatio", 1, where);
    if (!(ratio > 0)) {
      throw Error(fmt::format("{}.pixelRatio: expected a number above 0, found {}", where, ratio));
    }
    terms.fx = GetNumber(tree, "focalLength", where) / width_mm * intrinsics.width_px;
    terms.fy = version < Version{1, 2, 5} ? terms.fx / ratio : terms.fx * ratio;
  }
  const std::vector<double> centre = GetNumbers(tree, "principalPoint", 2, where);
  intrinsics.from_centre = !(version < Version{1, 2, 1});
  terms.cx = centre[0] + kAliceVisionOffsetPx;
  terms.cy = centre[1] + kAliceVisionOffsetPx;
}

std::vector<double> DistortionOf(const Tree& tree, size_t count, const std::string& where) {
  const Tree* list = Find(tree, "distortionParams");
  // Boost's property trees write an empty list as "".
  if (list == nullptr || !list->is_array() || list->empty()) {
    return std::vector<double>(count, 0.0);
  }
  return GetNumbers(tree, "distortionParams", count, where);
}

void RequireNoUndistortion(const Tree& tree, const std::string& where) {
  const Tree* list = Find(tree, "undistortionParams");
  if (list == nullptr || !list->is_array()) return;
  for (const Tree& value : *list) {
    if (NumberFrom(value, where + ".undistortionParams") == 0) continue;
    throw Error(where +
                ".undistortionParams: cannot be used, 3DEqualizer's models are not "
                "supported; undistort the images with Meshroom (ExportImages)");
  }
}

ForeignIntrinsics AliceVisionIntrinsics(const Tree& tree, const Version& version,
                                        const std::string& where) {
  ForeignIntrinsics intrinsics;
  intrinsics.width_px = GetSide(tree, "width", where);
  intrinsics.height_px = GetSide(tree, "height", where);
  const std::string type = GetText(tree, "type", where);
  const auto k = [&](size_t count) { return DistortionOf(tree, count, where); };
  BrownTerms terms;
  std::optional<double> fov;
  if (type == "radial1") {
    terms.k[0] = k(1)[0];
  } else if (type == "radial3") {
    const auto d = k(3);
    terms.k = {d[0], d[1], d[2], 0, 0, 0};
  } else if (type == "brown") {
    const auto d = k(5);
    terms.k = {d[0], d[1], d[2], 0, 0, 0};
    terms.p = {d[3], d[4], 0, 0};
  } else if (type == "fisheye" || type == "fisheye4") {
    const auto d = k(4);
    terms.fisheye = true;
    terms.k = {d[0], d[1], d[2], d[3], 0, 0};
  } else if (type == "fisheye1") {
    fov = k(1)[0];
  } else if (type != "pinhole") {
    throw Error(fmt::format(
        "{}.type: cannot be used, '{}' is none of pinhole, radial1, radial3, brown, fisheye4 and "
        "fisheye1; undistort the images with Meshroom (ExportImages) and give their cameras",
        where, Printable(type)));
  }
  RequireNoUndistortion(tree, where);
  ReadScaleAndOffset(tree, version, where, intrinsics, terms);
  intrinsics.lens = LensFrom(terms);
  if (fov && *fov != 0) {
    intrinsics.lens.model = "FOV";
    intrinsics.lens.params.push_back(*fov);
  }
  return intrinsics;
}

// Column by column, from the world to the camera.
Pose AliceVisionPose(const Tree& pose, const std::string& where) {
  const Tree& transform = Find(pose, "transform") ? Get(pose, "transform", where) : pose;
  const std::vector<double> r = GetNumbers(transform, "rotation", 9, where);
  const Eigen::Map<const Eigen::Matrix3d> cam_from_world(r.data());
  return PoseFromCenter(cam_from_world.transpose(), GetVector(transform, "center", where),
                        kPrintedRotationTolerance, where);
}

// The entries of a list by one of their fields.
std::map<std::uint64_t, const Tree*> AliceVisionMap(const Tree& root, const char* list,
                                                    const char* key, const std::string& source) {
  std::map<std::uint64_t, const Tree*> by_id;
  if (Find(root, list) == nullptr) return by_id;
  const Tree& entries = GetList(root, list, source);
  for (size_t i = 0; i < entries.size(); ++i) {
    const std::string where = fmt::format("{}: {}[{}]", source, list, i);
    const std::uint64_t id = GetId(entries[i], key, where);
    if (!by_id.emplace(id, &entries[i]).second) {
      throw Error(fmt::format("{}.{}: expected unique ids, found {} twice", where, key, id));
    }
  }
  return by_id;
}

// The pose of a view: of its own, or its place in a rig on top of the rig's.
std::optional<Pose> PoseOfView(const Tree& view, const std::map<std::uint64_t, const Tree*>& poses,
                               const std::map<std::uint64_t, const Tree*>& rigs,
                               const std::string& where) {
  if (Find(view, "poseId") == nullptr) return std::nullopt;
  const auto found = poses.find(GetId(view, "poseId", where));
  if (found == poses.end()) return std::nullopt;
  const std::string here = fmt::format("{} (pose {})", where, found->first);
  const Pose pose = AliceVisionPose(Get(*found->second, "pose", here), here);
  const Tree* independent = Find(view, "isPoseIndependant");
  const bool in_rig = independent != nullptr &&
                      (*independent == false || *independent == "false" || *independent == "0");
  if (!in_rig || Find(view, "rigId") == nullptr) return pose;
  const auto rig = rigs.find(GetId(view, "rigId", where));
  if (rig == rigs.end()) throw Error(where + ".rigId: expected the id of a rig, found another");
  const Tree& places = GetList(*rig->second, "subPoses", where);
  const std::uint64_t place = GetId(view, "subPoseId", where);
  if (place >= places.size()) {
    throw Error(where + ".subPoseId: expected the number of a place in the rig, found another");
  }
  return AliceVisionPose(Get(places[place], "pose", where), where + " (rig)") * pose;
}

void ReadAliceVisionStructure(const Tree& root, const std::string& source,
                              const std::map<std::uint64_t, size_t>& camera_of,
                              ForeignScene& scene) {
  if (Find(root, "structure") == nullptr || !Get(root, "structure", source).is_array()) return;
  const Tree& landmarks = GetList(root, "structure", source);
  for (size_t i = 0; i < landmarks.size(); ++i) {
    const std::string where = fmt::format("{}: structure[{}]", source, i);
    ForeignPoint point;
    point.p_in_world = GetVector(landmarks[i], "X", where);
    if (Find(landmarks[i], "color") != nullptr) {
      const Eigen::Vector3d colour = GetVector(landmarks[i], "color", where);
      for (int c = 0; c < 3; ++c) {
        point.rgb[static_cast<size_t>(c)] =
            static_cast<std::uint8_t>(std::clamp(colour[c], 0.0, 255.0));
      }
    }
    const Tree* observations = Find(landmarks[i], "observations");
    if (observations == nullptr || !observations->is_array()) continue;
    for (const Tree& observation : *observations) {
      if (Find(observation, "x") == nullptr) continue;  // written without features
      const auto camera = camera_of.find(GetId(observation, "observationId", where));
      const std::vector<double> x = GetNumbers(observation, "x", 2, where);
      if (camera == camera_of.end()) continue;
      // Relative to the middle where the cameras are.
      const ForeignIntrinsics& of = scene.cameras[camera->second].intrinsics;
      Eigen::Vector2d pixel(x[0] + kAliceVisionOffsetPx, x[1] + kAliceVisionOffsetPx);
      if (of.from_centre) pixel -= Eigen::Vector2d(of.width_px, of.height_px) / 2;
      point.seen.emplace_back(camera->second, pixel);
    }
    scene.points.push_back(std::move(point));
  }
}

}  // namespace

ForeignScene ReadAliceVisionJson(const std::filesystem::path& file) {
  const std::string source = file.string();
  const Tree root = ReadTree(file);
  const Version version = VersionOf(root, source);
  const Tree& views = GetList(root, "views", source);
  const auto intrinsics = AliceVisionMap(root, "intrinsics", "intrinsicId", source);
  const auto poses = AliceVisionMap(root, "poses", "poseId", source);
  const auto rigs = AliceVisionMap(root, "rigs", "rigId", source);
  if (poses.empty()) {
    throw Error(source + ": has no poses; take the .sfm of StructureFromMotion, not of CameraInit");
  }
  std::map<std::uint64_t, ForeignIntrinsics> intrinsics_of;
  for (const auto& [id, tree] : intrinsics) {
    intrinsics_of[id] =
        AliceVisionIntrinsics(*tree, version, fmt::format("{}: intrinsics {}", source, id));
  }
  ForeignScene scene;
  std::map<std::uint64_t, size_t> camera_of;
  for (size_t i = 0; i < views.size(); ++i) {
    const std::string entry = fmt::format("views[{}]", i);
    const std::string where = source + ": " + entry;
    const std::string path = GetText(views[i], "path", where);
    const auto pose = PoseOfView(views[i], poses, rigs, where);
    if (!pose) {
      scene.left_out.emplace_back(path, "AliceVision found no pose for it");
      continue;
    }
    const auto found = intrinsics_of.find(GetId(views[i], "intrinsicId", where));
    if (found == intrinsics_of.end()) {
      throw Error(where + ".intrinsicId: expected the id of intrinsics, found another");
    }
    camera_of[GetId(views[i], "viewId", where)] = scene.cameras.size();
    scene.cameras.push_back({path, entry, found->second, *pose});
  }
  ReadAliceVisionStructure(root, source, camera_of, scene);
  if (scene.cameras.empty()) {
    throw Error(source + ": expected at least one view with a pose, found none");
  }
  return scene;
}

}  // namespace dtr::io
