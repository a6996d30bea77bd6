#include <fmt/format.h>

#include <map>

#include "dtr/base/error.h"
#include "dtr/base/file_names.h"
#include "dtr/io/formats/foreign_readers.h"
#include "dtr/io/formats/json_tree.h"
#include "dtr/io/formats/pose_from_matrix.h"

namespace dtr::io {
namespace {

using namespace internal;

constexpr std::uint64_t kNoId = 4294967295;    // UndefinedIndexT
constexpr std::uint64_t kFirstUse = 1u << 31;  // cereal marks the first use of a name or pointer
constexpr double kOpenMvgOffsetPx = 0.5;       // the first pixel's centre is (0, 0) there

// cereal writes the name of a type and the data of a pointer where they are used first, with the
// highest bit of the number set; later uses have the number alone.
class CerealPointers {
 public:
  struct Object {
    std::string type;
    const Tree* data = nullptr;
  };

  Object Read(const Tree& value, const std::string& where) {
    Object object;
    if (Find(value, "polymorphic_id") != nullptr) {
      const std::uint64_t id = GetId(value, "polymorphic_id", where);
      if ((id & kFirstUse) != 0 && Find(value, "polymorphic_name") != nullptr) {
        names_[id & ~kFirstUse] = GetText(value, "polymorphic_name", where);
      }
      const auto name = names_.find(id & ~kFirstUse);
      if (name != names_.end()) object.type = name->second;
    }
    const Tree& wrapper = Get(value, "ptr_wrapper", where);
    const std::uint64_t id = GetId(wrapper, "id", where + ".ptr_wrapper") & ~kFirstUse;
    if (const Tree* data = Find(wrapper, "data")) data_[id] = data;
    const auto data = data_.find(id);
    if (data == data_.end()) throw Error(where + ".ptr_wrapper: expected data, found none");
    object.data = data->second;
    return object;
  }

 private:
  std::map<std::uint64_t, std::string> names_;
  std::map<std::uint64_t, const Tree*> data_;
};

// Older versions put the base class's fields into "value0".
const Tree& BaseOf(const Tree& data) {
  const Tree* base = Find(data, "value0");
  return base == nullptr ? data : *base;
}

ForeignIntrinsics OpenMvgIntrinsics(const CerealPointers::Object& object,
                                    const std::string& where) {
  const Tree& base = BaseOf(*object.data);
  ForeignIntrinsics intrinsics;
  intrinsics.width_px = GetSide(base, "width", where);
  intrinsics.height_px = GetSide(base, "height", where);
  const auto terms_of = [&](const char* key, size_t count) {
    return GetNumbers(*object.data, key, count, where);
  };
  BrownTerms terms;
  if (object.type == "pinhole_radial_k1") {
    terms.k[0] = terms_of("disto_k1", 1)[0];
  } else if (object.type == "pinhole_radial_k3") {
    const std::vector<double> k = terms_of("disto_k3", 3);
    terms.k = {k[0], k[1], k[2], 0, 0, 0};
  } else if (object.type == "pinhole_brown_t2") {
    const std::vector<double> k = terms_of("disto_t2", 5);
    terms.k = {k[0], k[1], k[2], 0, 0, 0};
    terms.p = {k[3], k[4], 0, 0};
  } else if (object.type == "fisheye") {
    const std::vector<double> k = terms_of("fisheye", 4);
    terms.fisheye = true;
    terms.k = {k[0], k[1], k[2], k[3], 0, 0};
  } else if (object.type != "pinhole") {
    throw Error(fmt::format(
        "{}: camera model '{}' cannot be used, expected pinhole, pinhole_radial_k1, "
        "pinhole_radial_k3, pinhole_brown_t2 or fisheye; undistort the images with OpenMVG "
        "(openMVG_main_ExportUndistortedImages)",
        where, Printable(object.type)));
  }
  terms.fx = terms.fy = GetNumber(base, "focal_length", where);
  const std::vector<double> centre = GetNumbers(base, "principal_point", 2, where);
  terms.cx = centre[0] + kOpenMvgOffsetPx;
  terms.cy = centre[1] + kOpenMvgOffsetPx;
  intrinsics.lens = LensFrom(terms);
  return intrinsics;
}

// {"key": id, "value": ...} of a map, by the id.
std::map<std::uint64_t, const Tree*> OpenMvgMap(const Tree& root, const char* name,
                                                const std::string& source) {
  std::map<std::uint64_t, const Tree*> map;
  if (Find(root, name) == nullptr) return map;
  const Tree& list = GetList(root, name, source);
  for (size_t i = 0; i < list.size(); ++i) {
    const std::string where = fmt::format("{}: {}[{}]", source, name, i);
    const std::uint64_t key = GetId(list[i], "key", where);
    if (!map.emplace(key, &Get(list[i], "value", where)).second) {
      throw Error(fmt::format("{}: expected unique keys, found {} twice", where, key));
    }
  }
  return map;
}

Pose OpenMvgPose(const Tree& value, const std::string& where) {
  const Tree& rows = GetList(value, "rotation", where);
  Eigen::Matrix3d rotation;
  if (rows.size() != 3) throw Error(where + ".rotation: expected 3 rows of 3 numbers");
  for (size_t i = 0; i < 3; ++i) {
    if (!rows[i].is_array() || rows[i].size() != 3) {
      throw Error(where + ".rotation: expected 3 rows of 3 numbers");
    }
    for (size_t j = 0; j < 3; ++j) {
      rotation(static_cast<int>(i), static_cast<int>(j)) =
          NumberFrom(rows[i][j], where + ".rotation");
    }
  }
  return PoseFromCenter(rotation.transpose(), GetVector(value, "center", where),
                        kPrintedRotationTolerance, where);
}

void ReadOpenMvgStructure(const Tree& root, const std::string& source,
                          const std::map<std::uint64_t, size_t>& camera_of, ForeignScene& scene) {
  for (const auto& [id, value] : OpenMvgMap(root, "structure", source)) {
    const std::string where = fmt::format("{}: structure {}", source, id);
    ForeignPoint point;
    point.p_in_world = GetVector(*value, "X", where);
    for (const Tree& observation : GetList(*value, "observations", where)) {
      const std::uint64_t view = GetId(observation, "key", where);
      const std::vector<double> x =
          GetNumbers(Get(observation, "value", where), "x", 2, where + ".observations");
      const auto camera = camera_of.find(view);
      if (camera == camera_of.end()) continue;
      point.seen.emplace_back(camera->second,
                              Eigen::Vector2d(x[0] + kOpenMvgOffsetPx, x[1] + kOpenMvgOffsetPx));
    }
    scene.points.push_back(std::move(point));
  }
}

}  // namespace

ForeignScene ReadOpenMvgJson(const std::filesystem::path& file) {
  const std::string source = file.string();
  const Tree root = ReadTree(file);
  GetText(root, "sfm_data_version", source);
  CerealPointers pointers;
  // In the order of the file: what is used first carries the data.
  std::vector<std::pair<std::uint64_t, CerealPointers::Object>> views;
  for (const Tree& entry : GetList(root, "views", source)) {
    const std::string where = fmt::format("{}: views[{}]", source, views.size());
    views.emplace_back(GetId(entry, "key", where),
                       pointers.Read(Get(entry, "value", where), where));
  }
  std::map<std::uint64_t, ForeignIntrinsics> intrinsics_of;
  for (const Tree& entry : GetList(root, "intrinsics", source)) {
    const std::string where = fmt::format("{}: intrinsics[{}]", source, intrinsics_of.size());
    intrinsics_of[GetId(entry, "key", where)] =
        OpenMvgIntrinsics(pointers.Read(Get(entry, "value", where), where), where);
  }
  const auto extrinsics = OpenMvgMap(root, "extrinsics", source);
  ForeignScene scene;
  std::map<std::uint64_t, size_t> camera_of;
  for (const auto& [key, view] : views) {
    const Tree& data = BaseOf(*view.data);
    const std::string entry = fmt::format("view {}", key);
    const std::string where = source + ": " + entry;
    const std::string folder = Find(data, "local_path") ? GetText(data, "local_path", where) : "";
    const std::string name = folder + GetText(data, "filename", where);
    const auto pose = extrinsics.find(GetId(data, "id_pose", where));
    const std::uint64_t intrinsic = GetId(data, "id_intrinsic", where);
    if (pose == extrinsics.end() || intrinsic == kNoId) {
      scene.left_out.emplace_back(name, "OpenMVG found no pose for it");
      continue;
    }
    const auto found = intrinsics_of.find(intrinsic);
    if (found == intrinsics_of.end()) {
      throw Error(where + ".id_intrinsic: expected a key of intrinsics, found another");
    }
    camera_of[key] = scene.cameras.size();
    scene.cameras.push_back(
        {name, entry, found->second,
         OpenMvgPose(*pose->second, fmt::format("{}: extrinsics {}", source, pose->first))});
  }
  ReadOpenMvgStructure(root, source, camera_of, scene);
  if (scene.cameras.empty()) {
    throw Error(source + ": expected at least one view with a pose, found none");
  }
  return scene;
}

}  // namespace dtr::io
