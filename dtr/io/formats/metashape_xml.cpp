#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <pugixml.hpp>

#include "dtr/base/error.h"
#include "dtr/base/file_names.h"
#include "dtr/base/files.h"
#include "dtr/base/lower_case.h"
#include "dtr/base/text_file.h"
#include "dtr/io/formats/foreign_readers.h"
#include "dtr/io/formats/pose_from_matrix.h"

namespace dtr::io {
namespace {

constexpr std::uintmax_t kMaxXmlBytes = 512u << 20;
constexpr double kSameTransform = 1e-9;

using Node = pugi::xml_node;

std::vector<double> NumbersIn(const Node& node, size_t count, const std::string& where) {
  const std::string text = node.text().get();
  std::vector<double> numbers;
  for (size_t at = text.find_first_not_of(" \t\r\n"); at < text.size();
       at = text.find_first_not_of(" \t\r\n", at)) {
    const size_t end = std::min(text.find_first_of(" \t\r\n", at), text.size());
    const auto number = FiniteNumber(std::string_view(text).substr(at, end - at));
    if (!number || numbers.size() == count) {
      numbers.clear();
      break;
    }
    numbers.push_back(*number);
    at = end;
  }
  if (numbers.size() == count) return numbers;
  throw Error(fmt::format("{}: <{}>: expected {} finite numbers, found '{}'", where, node.name(),
                          count, Printable(text.substr(0, 40))));
}

double NumberIn(const Node& parent, const char* name, const std::string& where) {
  const Node child = parent.child(name);
  return child ? NumbersIn(child, 1, where).front() : 0;
}

std::string Attribute(const Node& node, const char* name) { return node.attribute(name).value(); }

int SideFrom(const Node& resolution, const char* name, const std::string& where) {
  const std::string text = Attribute(resolution, name);
  int side = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), side);
  if (failure == std::errc() && end == text.data() + text.size() && side >= 1 &&
      side <= kMaxImageSidePx) {
    return side;
  }
  throw Error(fmt::format("{}: <resolution {}>: expected 1 to {} pixels, found '{}'", where, name,
                          kMaxImageSidePx, Printable(text)));
}

// p_in_b = scale * rotation * p_in_a + translation.
struct Similarity {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  double scale = 1;

  bool Near(const Similarity& other) const {
    const double size = std::max(1.0, translation.norm());
    return (rotation - other.rotation).norm() <= kSameTransform &&
           (translation - other.translation).norm() <= kSameTransform * size &&
           std::abs(scale / other.scale - 1) <= kSameTransform;
  }
};

std::optional<Similarity> TransformOf(const Node& parent, const std::string& where) {
  const Node node = parent.child("transform");
  if (!node) return std::nullopt;
  const std::string here = where + ": <transform>";
  Similarity similarity;
  if (const Node rotation = node.child("rotation")) {
    const std::vector<double> r = NumbersIn(rotation, 9, here);
    similarity.rotation = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r.data());
  }
  if (const Node translation = node.child("translation")) {
    const std::vector<double> t = NumbersIn(translation, 3, here);
    similarity.translation = {t[0], t[1], t[2]};
  }
  if (const Node scale = node.child("scale")) similarity.scale = NumbersIn(scale, 1, here).front();
  if (!(similarity.scale > 0)) {
    throw Error(
        fmt::format("{}: <scale>: expected a number above 0, found {}", here, similarity.scale));
  }
  // Checked here, so that the message names the transform and not every camera.
  PoseFromMatrix(similarity.rotation, similarity.translation, kPrintedRotationTolerance, here);
  return similarity;
}

// Metashape's P1 stands at r^2 + 2 x^2, which OpenCV calls p2.
ForeignIntrinsics MetashapeIntrinsics(const Node& sensor, const std::string& where) {
  const std::string type = Attribute(sensor, "type");
  if (type != "frame" && type != "fisheye") {
    throw Error(fmt::format(
        "{}: type '{}' cannot be used, expected frame or fisheye; export undistorted photos (File "
        "> Export > Convert Images) with their cameras",
        where, Printable(type)));
  }
  Node calibration;
  for (const Node& candidate : sensor.children("calibration")) {
    if (!calibration || Attribute(candidate, "class") == "adjusted") calibration = candidate;
  }
  if (!calibration) {
    throw Error(where + ": has no <calibration>; align the photos and export the cameras again");
  }
  const std::string here = where + ": <calibration>";
  if (!calibration.child("f")) {
    throw Error(here +
                ": expected a focal length <f>, found none; export the cameras again with "
                "Metashape (PhotoScan before 1.2 wrote another format)");
  }
  const Node resolution = calibration.child("resolution") ? calibration.child("resolution")
                                                          : sensor.child("resolution");
  ForeignIntrinsics intrinsics;
  intrinsics.from_centre = true;
  intrinsics.width_px = SideFrom(resolution, "width", where);
  intrinsics.height_px = SideFrom(resolution, "height", where);
  const auto number = [&](const char* name) { return NumberIn(calibration, name, here); };
  BrownTerms terms;
  terms.fisheye = type == "fisheye";
  terms.fy = number("f");
  terms.fx = terms.fy + number("b1");
  terms.skew = number("b2");
  terms.cx = number("cx");
  terms.cy = number("cy");
  terms.k = {number("k1"), number("k2"), number("k3"), number("k4"), 0, 0};
  terms.p = {number("p2"), number("p1"), number("p3"), number("p4")};
  intrinsics.lens = LensFrom(terms);
  return intrinsics;
}

// Cameras below <cameras> and its groups, in their order.
void CollectCameras(const Node& parent, int depth, std::vector<Node>& cameras) {
  constexpr int kMaxGroups = 32;
  for (const Node& child : parent.children()) {
    const std::string name = child.name();
    if (name == "camera") cameras.push_back(child);
    if (name == "group" && depth < kMaxGroups) CollectCameras(child, depth + 1, cameras);
  }
}

// Why a camera has no pose; empty: it has.
std::string WhyLeftOut(const Node& camera) {
  const std::string enabled = Attribute(camera, "enabled");
  if (enabled == "false" || enabled == "0") return "disabled in Metashape";
  if (camera.child("transform")) return "";
  if (camera.attribute("master_id")) return "a second camera of a multi-camera system";
  return "not aligned by Metashape";
}

// The component with most cameras that have a pose.
std::string LargestComponent(const std::vector<Node>& cameras) {
  std::map<std::string, size_t> counts;
  for (const Node& camera : cameras) {
    if (WhyLeftOut(camera).empty()) ++counts[Attribute(camera, "component_id")];
  }
  const auto largest =
      std::max_element(counts.begin(), counts.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  return largest == counts.end() ? "" : largest->first;
}

Node NodeById(const Node& list, const char* name, const std::string& id) {
  for (const Node& child : list.children(name)) {
    if (Attribute(child, "id") == id) return child;
  }
  return {};
}

// What acts on the cameras of a component: its transform and the chunk's. Files that repeat one and
// the same in both places mean it once.
std::vector<Similarity> Transforms(const Node& chunk, const Node& component,
                                   const std::string& where) {
  std::vector<Similarity> transforms;
  if (component) {
    const auto own = TransformOf(component, where + ": component " + Attribute(component, "id"));
    if (own) transforms.push_back(*own);
  }
  const auto of_chunk = TransformOf(chunk, where + ": chunk");
  if (of_chunk && (transforms.empty() || !transforms.front().Near(*of_chunk))) {
    transforms.push_back(*of_chunk);
  }
  return transforms;
}

Pose MetashapePose(const Node& camera, const std::vector<Similarity>& transforms,
                   const std::string& where) {
  const std::vector<double> m = NumbersIn(camera.child("transform"), 16, where);
  Eigen::Matrix4d matrix = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(m.data());
  Eigen::Matrix3d world_from_cam = matrix.topLeftCorner<3, 3>();
  Eigen::Vector3d centre = matrix.topRightCorner<3, 1>();
  if (matrix.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
    throw Error(where + ": <transform>: expected 0 0 0 1 as the last row, found another");
  }
  for (const Similarity& similarity : transforms) {
    world_from_cam = similarity.rotation * world_from_cam;
    centre = similarity.scale * (similarity.rotation * centre) + similarity.translation;
  }
  return PoseFromCenter(world_from_cam, centre, kPrintedRotationTolerance, where);
}

// The unit of what the transform of a reference leads to: that of a local or projected system (WKT)
// that counts in metres, else geocentric metres, an earth radius from the origin, which every
// system of the earth has. Metashape writes WGS 84 for chunks without a reference, too.
LengthUnit UnitOf(const Node& chunk, const std::vector<ForeignCamera>& cameras) {
  constexpr double kLeastRadius_m = 6.3e6, kMostRadius_m = 6.5e6;
  const std::string system = LowerCase(chunk.child("reference").text().get());
  for (const char* metre : {"unit[\"metre", "unit[\"meter"}) {
    if (system.find(metre) != std::string::npos) return LengthUnit::kMetre;
  }
  const double radius = cameras.front().cam_from_world.TargetOriginInSource().norm();
  const bool is_local =
      system.find("local_cs") != std::string::npos || system.find("engcrs") != std::string::npos;
  const bool is_on_earth = radius > kLeastRadius_m && radius < kMostRadius_m;
  return !system.empty() && !is_local && is_on_earth ? LengthUnit::kMetre : LengthUnit::kUnknown;
}

Node ChunkOf(const pugi::xml_document& document, const std::string& source, ForeignScene& scene) {
  const Node root = document.child("document");
  const Node chunk = root.child("chunk");
  if (!chunk || !chunk.child("sensors") || !chunk.child("cameras")) {
    throw Error(source +
                ": expected <document><chunk> with <sensors> and <cameras>, found another XML; "
                "export the cameras with Metashape, File > Export > Export Cameras");
  }
  size_t chunks = 0;
  for ([[maybe_unused]] const Node& other : root.children("chunk")) ++chunks;
  if (chunks > 1) {
    scene.notes.push_back(fmt::format("{}: of its {} chunks the first is used, {}", source, chunks,
                                      Printable(Attribute(chunk, "label"))));
  }
  return chunk;
}

}  // namespace

ForeignScene ReadMetashapeXml(const std::filesystem::path& file) {
  const std::string source = file.string();
  const std::string text = ReadFile(file, kMaxXmlBytes);
  pugi::xml_document document;
  const pugi::xml_parse_result parsed = document.load_buffer(text.data(), text.size());
  if (!parsed) {
    throw Error(fmt::format("{}: byte {}: expected XML, found: {}; the file may be cut short",
                            source, parsed.offset, parsed.description()));
  }
  ForeignScene scene;
  const Node chunk = ChunkOf(document, source, scene);
  std::vector<Node> cameras;
  CollectCameras(chunk.child("cameras"), 0, cameras);
  const std::string component_id = LargestComponent(cameras);
  const Node component = NodeById(chunk.child("components"), "component", component_id);
  const std::vector<Similarity> transforms = Transforms(chunk, component, source);
  std::map<std::string, ForeignIntrinsics> intrinsics_of;
  for (const Node& camera : cameras) {
    const std::string label = Attribute(camera, "label");
    const std::string entry = "camera " + Printable(Attribute(camera, "id"));
    const std::string where = fmt::format("{}: {} ({})", source, entry, Printable(label));
    std::string why = WhyLeftOut(camera);
    if (why.empty() && Attribute(camera, "component_id") != component_id) {
      why = "in another component, which is not in one world with the largest";
    }
    if (!why.empty()) {
      scene.left_out.emplace_back(label, why);
      continue;
    }
    const std::string sensor_id = Attribute(camera, "sensor_id");
    if (!intrinsics_of.contains(sensor_id)) {
      const Node sensor = NodeById(chunk.child("sensors"), "sensor", sensor_id);
      if (!sensor) throw Error(where + ": expected the id of a sensor, found another");
      intrinsics_of[sensor_id] =
          MetashapeIntrinsics(sensor, source + ": sensor " + Printable(sensor_id));
    }
    scene.cameras.push_back(
        {label, entry, intrinsics_of[sensor_id], MetashapePose(camera, transforms, where)});
  }
  if (scene.cameras.empty()) {
    throw Error(source + ": expected at least one aligned camera, found none" +
                (scene.left_out.empty() ? "" : "; the first is " + scene.left_out.front().second));
  }
  if (!transforms.empty()) scene.unit = UnitOf(chunk, scene.cameras);
  return scene;
}

}  // namespace dtr::io
