#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "dtr/base/error.h"
#include "dtr/base/file_names.h"
#include "dtr/base/text_file.h"
#include "dtr/io/formats/foreign_readers.h"
#include "dtr/io/formats/pose_from_matrix.h"
#include "dtr/io/formats/scene_text.h"

namespace dtr::io {
namespace {

using internal::SceneText;

// "NVM_V3 FixedK fx cx fy cy": a calibration that all cameras share.
struct FixedK {
  double fx = 0, cx = 0, fy = 0, cy = 0;
};

std::optional<FixedK> FixedKIn(std::string_view line, const std::string& where) {
  const size_t at = line.find("FixedK");
  if (at == std::string_view::npos) return std::nullopt;
  internal::TextNumbers text(std::string(line.substr(at + 6)), where);
  FixedK fixed;
  for (double* value : {&fixed.fx, &fixed.cx, &fixed.fy, &fixed.cy}) {
    *value = text.Number("FixedK fx cx fy cy");
  }
  if (fixed.fx > 0 && fixed.fy > 0) return fixed;
  throw Error(where + "expected positive focal lengths behind FixedK, found others");
}

// A line "name f qw qx qy qz cx cy cz r 0": names may hold blanks, so the numbers are taken from
// the end.
std::vector<double> NumbersAtEnd(std::string_view& line, size_t count, const std::string& where) {
  std::vector<double> numbers(count);
  for (size_t i = count; i-- > 0;) {
    while (!line.empty() && internal::IsBlank(line.back())) line.remove_suffix(1);
    const size_t begin = line.find_last_of(" \t");
    const std::string_view word =
        begin == std::string_view::npos ? std::string_view() : line.substr(begin + 1);
    const auto number = FiniteNumber(word);
    if (!number) {
      throw Error(fmt::format("{}expected a name and {} numbers, found '{}'{}", where, count,
                              Printable(std::string(line.substr(0, 60))), DecimalCommaHint(word)));
    }
    numbers[i] = *number;
    line.remove_suffix(word.size());
  }
  while (!line.empty() && internal::IsBlank(line.back())) line.remove_suffix(1);
  return numbers;
}

ForeignCamera NvmCamera(std::string_view line, bool matrices, const std::optional<FixedK>& fixed,
                        const std::string& where) {
  const std::vector<double> v = NumbersAtEnd(line, matrices ? 15 : 10, where);
  ForeignCamera camera;
  camera.path = std::string(line);
  std::replace(camera.path.begin(), camera.path.end(), '"', ' ');  // VisualSFM's blanks
  if (!(v[0] > 0)) {
    throw Error(fmt::format("{}expected a positive focal length, found {}", where, v[0]));
  }
  // VisualSFM's distortion is of the measured point.
  const double r = v[v.size() - 2];
  Distortion& lens = camera.intrinsics.lens;
  lens = {r == 0 ? "PINHOLE" : "INVERSE_RADIAL", {v[0], v[0], 0, 0}};
  if (fixed) lens.params = {fixed->fx, fixed->fy, fixed->cx, fixed->cy};
  camera.intrinsics.from_centre = !fixed;
  if (r != 0) lens.params.push_back(r);
  if (matrices) {
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> rotation(v.data() + 1);
    camera.cam_from_world =
        PoseFromMatrix(rotation, {v[10], v[11], v[12]}, kPrintedRotationTolerance, where);
    return camera;
  }
  const Eigen::Quaterniond rotation(v[1], v[2], v[3], v[4]);
  if (!(rotation.norm() > 1e-3))
    throw Error(where + "expected a rotation, found a quaternion of 0");
  camera.cam_from_world = PoseFromCenter(rotation.normalized().conjugate().toRotationMatrix(),
                                         {v[5], v[6], v[7]}, kPrintedRotationTolerance, where);
  return camera;
}

void ReadNvmPoints(SceneText& text, size_t cameras, ForeignScene& scene) {
  const int points = text.Int("the number of points", 0, SceneText::kMaxCount);
  for (int i = 0; i < points; ++i) {
    ForeignPoint point;
    point.p_in_world = text.Vector3("a point");
    point.rgb = text.Colour();
    const int views = text.Int("a number of measurements", 0, SceneText::kMaxCount);
    for (int j = 0; j < views; ++j) {
      const int camera = text.Int("an image", 0, static_cast<int>(cameras) - 1);
      text.Int("a feature", -1, SceneText::kMaxCount);
      const double x = text.Number("x"), y = text.Number("y");
      point.seen.emplace_back(static_cast<size_t>(camera), Eigen::Vector2d(x, y));
    }
    scene.points.push_back(std::move(point));
  }
}

}  // namespace

ForeignScene ReadNvm(const std::filesystem::path& file) {
  SceneText text(file);
  const std::string first(text.Line());
  if (!first.starts_with("NVM_V3")) {
    throw Error(file.string() + ":1: expected NVM_V3, found another");
  }
  const bool matrices = first.starts_with("NVM_V3_R9T");
  const std::optional<FixedK> fixed = FixedKIn(first, file.string() + ":1: ");
  const int cameras = text.Int("the number of cameras", 1, SceneText::kMaxCount);
  text.Line();
  ForeignScene scene;
  scene.conventions_of = "VisualSFM";
  for (int i = 0; i < cameras; ++i) {
    if (text.AtEnd()) {
      throw Error(fmt::format("{}: expected {} cameras, found {}; the file is cut short",
                              file.string(), cameras, i));
    }
    const std::string_view line = text.Line();
    ForeignCamera camera = NvmCamera(line, matrices, fixed, text.Where());
    camera.entry = fmt::format("camera {}", i);
    scene.cameras.push_back(std::move(camera));
  }
  ReadNvmPoints(text, scene.cameras.size(), scene);
  // Behind the first model others may follow, down to a 0 and notes about PLY files.
  if (!text.AtEnd() &&
      text.Int("the number of cameras of another model", 0, SceneText::kMaxCount) > 0) {
    scene.notes.push_back(file.string() +
                          ": of its models, which are not in one world, the first is used");
  }
  return scene;
}

}  // namespace dtr::io
