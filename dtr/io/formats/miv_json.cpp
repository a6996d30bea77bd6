#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>
#include <set>

#include "dtr/base/error.h"
#include "dtr/base/file_names.h"
#include "dtr/io/formats/foreign_readers.h"
#include "dtr/io/formats/json_tree.h"
#include "dtr/io/formats/pose_from_matrix.h"
#include "dtr/io/formats/world_facts.h"

namespace dtr::io {
namespace {

using namespace internal;

// The axes of the format are x forward, y left, z up, of the world and of cameras; ours x right, y
// down, z forward.
Eigen::Matrix3d FormatFromOurs() {
  Eigen::Matrix3d m;
  m << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return m;
}

ForeignIntrinsics MivIntrinsics(const Tree& camera, const std::string& where) {
  const std::string projection = GetText(camera, "Projection", where);
  if (projection != "Perspective") {
    throw Error(
        fmt::format("{}.Projection: cannot be used, expected Perspective, found {}; render "
                    "perspective views of it (TMIV, RVS)",
                    where, Printable(projection)));
  }
  const std::vector<double> size = GetNumbers(camera, "Resolution", 2, where);
  const std::vector<double> focal = GetNumbers(camera, "Focal", 2, where);
  // Both spellings are in use.
  const char* centre_key = Find(camera, "Principle_point") ? "Principle_point" : "Principal_point";
  const std::vector<double> centre = GetNumbers(camera, centre_key, 2, where);
  ForeignIntrinsics intrinsics;
  for (const double side : size) {
    if (side == std::floor(side) && side >= 1 && side <= kMaxImageSidePx) continue;
    throw Error(fmt::format("{}.Resolution: expected 1 to {} pixels, found {}", where,
                            kMaxImageSidePx, side));
  }
  intrinsics.width_px = static_cast<int>(size[0]);
  intrinsics.height_px = static_cast<int>(size[1]);
  intrinsics.even_size = true;
  intrinsics.lens = {"PINHOLE", {focal[0], focal[1], centre[0], centre[1]}};
  return intrinsics;
}

// Yaw about z, pitch about y, roll about x, in degrees.
Pose MivPose(const Tree& camera, const std::string& where) {
  constexpr double kRadians = std::numbers::pi / 180;
  const Eigen::Vector3d position = GetVector(camera, "Position", where);
  const Eigen::Vector3d angles = GetVector(camera, "Rotation", where) * kRadians;
  const Eigen::Matrix3d world_from_cam = (Eigen::AngleAxisd(angles[0], Eigen::Vector3d::UnitZ()) *
                                          Eigen::AngleAxisd(angles[1], Eigen::Vector3d::UnitY()) *
                                          Eigen::AngleAxisd(angles[2], Eigen::Vector3d::UnitX()))
                                             .toRotationMatrix();
  const Eigen::Matrix3d axes = FormatFromOurs();
  return PoseFromCenter(axes.transpose() * world_from_cam * axes, axes.transpose() * position,
                        kRotationTolerance, where);
}

// The cameras that have images; empty: all but the one of the viewer.
std::set<std::string> SourceNames(const Tree& root, const std::string& source) {
  std::set<std::string> names;
  if (Find(root, "sourceCameraNames") == nullptr) return names;
  for (const Tree& name : GetList(root, "sourceCameraNames", source)) {
    if (name.is_string()) names.insert(name.get<std::string>());
  }
  return names;
}

}  // namespace

ForeignScene ReadMivJson(const std::filesystem::path& file) {
  const std::string source = file.string();
  const Tree root = ReadTree(file);
  const Tree& cameras = GetList(root, "cameras", source);
  const std::set<std::string> sources = SourceNames(root, source);
  ForeignScene scene;
  const Tree* metres = Find(root, "lengthsInMeters");
  if (metres != nullptr && metres->is_boolean()) {
    scene.unit = metres->get<bool>() ? LengthUnit::kMetre : LengthUnit::kArbitrary;
  }
  if (const Tree* facts = Find(root, "dtr")) {
    ReadWorldFacts(*facts, source + ": dtr", scene);
  }
  for (size_t i = 0; i < cameras.size(); ++i) {
    const std::string entry = fmt::format("cameras[{}]", i);
    std::string where = source + ": " + entry;
    const std::string name = GetText(cameras[i], "Name", where);
    where += " (" + Printable(name) + ")";
    if (name == "viewport" || (!sources.empty() && !sources.contains(name))) continue;
    const std::string path = Find(cameras[i], "photo") ? GetText(cameras[i], "photo", where) : name;
    scene.cameras.push_back(
        {path, entry, MivIntrinsics(cameras[i], where), MivPose(cameras[i], where)});
  }
  if (scene.cameras.empty()) throw Error(source + ": expected at least one camera, found none");
  scene.notes.push_back(source +
                        ": its raw video of texture and depth is not read; give the images");
  return scene;
}

}  // namespace dtr::io
