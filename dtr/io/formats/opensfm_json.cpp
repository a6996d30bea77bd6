#include <fmt/format.h>

#include <Eigen/Geometry>
#include <map>
#include <set>

#include "dtr/base/error.h"
#include "dtr/base/file_names.h"
#include "dtr/base/text_file.h"
#include "dtr/base/text_rows.h"
#include "dtr/io/formats/foreign_readers.h"
#include "dtr/io/formats/json_tree.h"

namespace dtr::io {
namespace {

using namespace internal;
namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxTracksBytes = 1u << 30;

// A camera's numbers count in the longer side of its image, from the image's middle.
ForeignIntrinsics OpenSfmIntrinsics(const Tree& camera, const std::string& where) {
  const std::string type = GetText(camera, "projection_type", where);
  ForeignIntrinsics intrinsics;
  intrinsics.from_centre = intrinsics.in_long_sides = true;
  intrinsics.width_px = GetSide(camera, "width", where);
  intrinsics.height_px = GetSide(camera, "height", where);
  const auto number = [&](const char* key) { return GetNumberOr(camera, key, 0, where); };
  static const std::set<std::string> kKnown = {"perspective", "simple_radial", "radial",
                                               "brown",       "fisheye",       "fisheye_opencv",
                                               "fisheye62",   "fisheye624"};
  if (!kKnown.contains(type)) {
    throw Error(fmt::format(
        "{}.projection_type: cannot be used, '{}' is none of perspective, simple_radial, radial, "
        "brown, fisheye, fisheye_opencv and fisheye62; undistort the images (opensfm undistort) "
        "and give their cameras",
        where, Printable(type)));
  }
  BrownTerms terms;
  // Of the two generations of types the older ones have one focal length and no principal point.
  const bool one_focal = type == "perspective" || type == "fisheye";
  terms.fx = GetNumber(camera, one_focal ? "focal" : "focal_x", where);
  terms.fy = one_focal ? terms.fx : GetNumber(camera, "focal_y", where);
  if (!one_focal) {
    terms.cx = number("c_x");
    terms.cy = number("c_y");
  }
  const auto radial = [&](size_t count) {
    static constexpr const char* kNames[] = {"k1", "k2", "k3", "k4", "k5", "k6"};
    for (size_t i = 0; i < count; ++i) terms.k[i] = number(kNames[i]);
  };
  const auto tangential = [&] { terms.p = {number("p1"), number("p2"), 0, 0}; };
  if (type == "perspective" || type == "radial") {
    radial(2);
  } else if (type == "simple_radial") {
    radial(1);
  } else if (type == "brown") {
    radial(3);
    tangential();
  } else if (type == "fisheye") {
    terms.fisheye = true;
    radial(2);
  } else if (type == "fisheye_opencv") {
    terms.fisheye = true;
    radial(4);
  } else {
    terms.fisheye = true;
    radial(6);
    tangential();
    for (const char* key : {"s0", "s1", "s2", "s3"}) {
      if (number(key) == 0) continue;
      throw Error(fmt::format(
          "{}.{}: cannot be used, prism terms of OpenSfM's fisheye624 are not supported; calibrate "
          "with fisheye62 or undistort the images (opensfm undistort)",
          where, key));
    }
  }
  intrinsics.lens = LensFrom(terms);
  return intrinsics;
}

Pose OpenSfmPose(const Tree& shot, const std::string& where) {
  const Eigen::Vector3d axis = GetVector(shot, "rotation", where);
  const double angle = axis.norm();
  Pose pose;
  if (angle > 0) pose.rotation = Eigen::AngleAxisd(angle, axis / angle);
  pose.translation = GetVector(shot, "translation", where);
  return pose;
}

// With a rig, shots of a camera that is not at its middle have the pose of an instance on top.
Pose OpenSfmShotPose(const Tree& scene, const std::string& name, const Tree& shot,
                     const std::string& where) {
  if (Find(shot, "rotation") != nullptr) return OpenSfmPose(shot, where);
  const Tree* instances = Find(scene, "rig_instances");
  const Tree* cameras = Find(scene, "rig_cameras");
  if (instances != nullptr && cameras != nullptr && instances->is_object()) {
    for (const auto& [id, instance] : instances->items()) {
      const Tree* members = Find(instance, "rig_camera_ids");
      const Tree* member = members == nullptr ? nullptr : Find(*members, name.c_str());
      if (member == nullptr || !member->is_string()) continue;
      const Tree& rig_camera = Get(*cameras, member->get<std::string>().c_str(), where);
      return OpenSfmPose(rig_camera, where + ": rig camera") *
             OpenSfmPose(instance, where + ": rig instance");
    }
  }
  throw Error(where + ": expected a rotation and a translation, found none");
}

// Observations out of tracks.csv, "image track feature x y ...", of the points by their id.
void ReadTracks(const fs::path& file, const std::map<std::string, size_t>& point_of,
                const std::map<std::string, size_t>& camera_of, ForeignScene& scene) {
  TextRows rows(ReadTextFile(file, kMaxTracksBytes), file.string());
  rows.SetSeparator('\t');
  while (rows.Next()) {
    const std::vector<std::string>& words = rows.cells();
    if (words.front().starts_with("OPENSFM_TRACKS")) continue;
    if (words.size() < 5) {
      throw Error(rows.Where() +
                  "expected image, track, feature, x and y between tabs, found less");
    }
    const auto camera = camera_of.find(words[0]);
    const auto point = point_of.find(words[1]);
    const double x = rows.Number(3, "x"), y = rows.Number(4, "y");
    if (camera == camera_of.end() || point == point_of.end()) continue;
    const ForeignIntrinsics& intrinsics = scene.cameras[camera->second].intrinsics;
    const double side = std::max(intrinsics.width_px, intrinsics.height_px);
    scene.points[point->second].seen.emplace_back(camera->second,
                                                  Eigen::Vector2d(x * side, y * side));
  }
}

// Points as far as tracks.csv says which photos show them.
void ReadOpenSfmPoints(const fs::path& file, const Tree& reconstruction, const std::string& where,
                       const std::map<std::string, size_t>& camera_of, ForeignScene& scene) {
  const Tree* points = Find(reconstruction, "points");
  if (points == nullptr || !points->is_object() || points->empty()) return;
  const fs::path tracks = file.parent_path() / "tracks.csv";
  if (!fs::is_regular_file(tracks)) {
    scene.notes.push_back(
        fmt::format("{}: its {} points are not used, they do not say which photo shows them; "
                    "tracks.csv beside it would",
                    file.string(), points->size()));
    return;
  }
  std::map<std::string, size_t> point_of;
  for (const auto& [id, point] : points->items()) {
    const std::string here = where + ": points." + Printable(id);
    ForeignPoint& added = scene.points.emplace_back();
    added.p_in_world = GetVector(point, "coordinates", here);
    if (Find(point, "color") != nullptr) {
      const Eigen::Vector3d colour = GetVector(point, "color", here);
      for (int i = 0; i < 3; ++i) {
        added.rgb[static_cast<size_t>(i)] =
            static_cast<std::uint8_t>(std::clamp(colour[i], 0.0, 255.0));
      }
    }
    point_of[id] = scene.points.size() - 1;
  }
  ReadTracks(tracks, point_of, camera_of, scene);
}

void NoteReference(const Tree& reconstruction, const std::string& source, ForeignScene& scene) {
  const Tree* reference = Find(reconstruction, "reference_lla");
  if (reference == nullptr) return;
  const std::string where = source + ": reference_lla";
  const double latitude = GetNumberOr(*reference, "latitude", 0, where);
  const double longitude = GetNumberOr(*reference, "longitude", 0, where);
  const double altitude = GetNumberOr(*reference, "altitude", 0, where);
  if (latitude == 0 && longitude == 0 && altitude == 0) return;
  scene.notes.push_back(fmt::format(
      "{}: x, y and z point east, north and up from latitude {}, longitude {}, altitude {} m, "
      "which the set does not store; its unit stays unknown to the set",
      source, latitude, longitude, altitude));
}

}  // namespace

ForeignScene ReadOpenSfmJson(const fs::path& file) {
  const std::string source = file.string();
  const Tree root = ReadTree(file);
  if (!root.is_array() || root.empty()) {
    throw Error(source + ": expected a list of at least one reconstruction, found another");
  }
  size_t best = 0, most = 0, shots = 0;
  for (size_t i = 0; i < root.size(); ++i) {
    const Tree* found = Find(root[i], "shots");
    const size_t count = found != nullptr && found->is_object() ? found->size() : 0;
    shots += count;
    if (count > most) {
      most = count;
      best = i;
    }
  }
  const std::string where = fmt::format("{}: [{}]", source, best);
  const Tree& reconstruction = root[best];
  const Tree& cameras = Get(reconstruction, "cameras", where);
  const Tree& all_shots = Get(reconstruction, "shots", where);
  if (most == 0) throw Error(where + ".shots: expected at least one shot, found none");
  ForeignScene scene;
  if (root.size() > 1) {
    scene.notes.push_back(fmt::format(
        "{}: of its {} reconstructions, which are not in one world, the one with most shots is "
        "used: {} of {}",
        source, root.size(), most, shots));
  }
  std::map<std::string, ForeignIntrinsics> intrinsics_of;
  std::map<std::string, size_t> camera_of;
  for (const auto& [name, shot] : all_shots.items()) {
    const std::string entry = "shots." + Printable(name);
    const std::string here = where + "." + entry;
    const std::string camera = GetText(shot, "camera", here);
    if (!intrinsics_of.contains(camera)) {
      const std::string of = fmt::format("{}.cameras.{}", where, Printable(camera));
      const Tree* found = Find(cameras, camera.c_str());
      if (found == nullptr) throw Error(here + ".camera: expected one of cameras, found another");
      intrinsics_of[camera] = OpenSfmIntrinsics(*found, of);
    }
    camera_of[name] = scene.cameras.size();
    scene.cameras.push_back(
        {name, entry, intrinsics_of[camera], OpenSfmShotPose(reconstruction, name, shot, here)});
  }
  ReadOpenSfmPoints(file, reconstruction, where, camera_of, scene);
  NoteReference(reconstruction, source, scene);
  return scene;
}

}  // namespace dtr::io
