#include <fmt/format.h>

#include <cmath>

#include "dtr/base/error.h"
#include "dtr/base/file_names.h"
#include "dtr/base/text_file.h"
#include "dtr/base/text_rows.h"
#include "dtr/io/formats/foreign_readers.h"
#include "dtr/io/formats/pose_from_matrix.h"
#include "dtr/io/formats/scene_text.h"

namespace dtr::io {
namespace {

using internal::SceneText;
namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxBundlerListBytes = 64u << 20;

// A name a line, or "name 0 focal" as Bundler has it: names may hold blanks, the two numbers behind
// them do not.
std::vector<std::string> NamesInList(const fs::path& list) {
  TextRows rows(ReadTextFile(list, kMaxBundlerListBytes), list.string());
  std::vector<std::string> names;
  for (std::string_view line; rows.NextLine(line);) {
    const auto trim = [&] {
      while (!line.empty() && internal::IsBlank(line.back())) line.remove_suffix(1);
      while (!line.empty() && internal::IsBlank(line.front())) line.remove_prefix(1);
    };
    trim();
    if (line.empty()) continue;
    const std::vector<std::string> words = CellsOf(line, ' ');
    const bool has_focal =
        words.size() >= 3 && words[words.size() - 2] == "0" && FiniteNumber(words.back());
    for (int i = 0; has_focal && i < 2; ++i) {
      line = line.substr(0, line.find_last_of(" \t"));
      trim();
    }
    names.emplace_back(line);
  }
  return names;
}

// The names of the images, which bundle.out only counts. COLMAP calls the two NAME.bundle.out and
// NAME.list.txt.
std::vector<std::string> ImageNames(const fs::path& file, size_t count) {
  std::string looked_for;
  for (const fs::path& list : BundlerLists(file)) {
    looked_for += (looked_for.empty() ? "" : ", ") + list.lexically_normal().string();
    if (!fs::is_regular_file(list)) continue;
    const std::vector<std::string> names = NamesInList(list);
    if (names.size() == count) return names;
    throw Error(fmt::format("{}: expected the names of {} images as {} has, found {}",
                            list.lexically_normal().string(), count, file.string(), names.size()));
  }
  throw Error(fmt::format(
      "{}: its images have no names; put the list of them beside it, a name a line (looked for {})",
      file.string(), looked_for));
}

// A camera of Bundler looks along -z with y up; pixels count from the image's middle, y up.
void ReadBundlerCamera(SceneText& text, const std::string& name, size_t index, ForeignScene& scene,
                       std::vector<std::optional<size_t>>& index_of) {
  const double focal = text.Number("a focal length");
  BrownTerms terms;
  terms.fx = terms.fy = focal;
  terms.k[0] = text.Number("k1");
  terms.k[1] = text.Number("k2");
  const std::string where = text.Where() + Printable(name);
  Eigen::Matrix3d rotation;
  for (int i = 0; i < 9; ++i) rotation(i / 3, i % 3) = text.Number("a rotation");
  const Eigen::Vector3d translation = text.Vector3("a translation");
  index_of.emplace_back();
  if (focal == 0) {
    scene.left_out.emplace_back(name, "no camera was found for it (focal length 0)");
    return;
  }
  const Eigen::DiagonalMatrix<double, 3> cam_from_gl(1, -1, -1);
  ForeignCamera camera;
  camera.path = name;
  camera.entry = fmt::format("camera {}", index);
  camera.intrinsics.lens = LensFrom(terms);
  camera.intrinsics.from_centre = true;
  camera.cam_from_world = PoseFromMatrix(cam_from_gl * rotation, cam_from_gl * translation,
                                         kPrintedRotationTolerance, where);
  index_of.back() = scene.cameras.size();
  scene.cameras.push_back(std::move(camera));
}

void ReadBundlerPoint(SceneText& text, const std::vector<std::optional<size_t>>& index_of,
                      ForeignScene& scene) {
  ForeignPoint point;
  point.p_in_world = text.Vector3("a point");
  point.rgb = text.Colour();
  const int views = text.Int("a number of views", 0, static_cast<int>(index_of.size()));
  for (int i = 0; i < views; ++i) {
    const int camera = text.Int("a camera", 0, static_cast<int>(index_of.size()) - 1);
    text.Int("a key", -1, SceneText::kMaxCount);
    const double x = text.Number("x"), y = text.Number("y");
    const auto& index = index_of[static_cast<size_t>(camera)];
    if (index) point.seen.emplace_back(*index, Eigen::Vector2d(x, -y));
  }
  scene.points.push_back(std::move(point));
}

}  // namespace

std::vector<fs::path> BundlerLists(const fs::path& file) {
  const fs::path stem = fs::path(file).replace_extension(), folder = file.parent_path();
  std::vector<fs::path> lists = {file.string() + ".list.txt", stem.string() + ".list.txt"};
  if (stem.extension() == ".bundle") {
    lists.push_back(fs::path(stem).replace_extension().string() + ".list.txt");
  }
  for (const fs::path& name :
       {fs::path("list.txt"), fs::path("..") / "list.txt", fs::path("image_list.txt")}) {
    lists.push_back(folder / name);
  }
  return lists;
}

ForeignScene ReadBundlerOut(const fs::path& file) {
  SceneText text(file);
  if (!text.Line().starts_with("# Bundle file v0.3")) {
    throw Error(file.string() +
                ":1: expected '# Bundle file v0.3', found another; older versions "
                "are not read");
  }
  const int cameras = text.Int("the number of cameras", 1, SceneText::kMaxCount);
  const int points = text.Int("the number of points", 0, SceneText::kMaxCount);
  const std::vector<std::string> names = ImageNames(file, static_cast<size_t>(cameras));
  ForeignScene scene;
  scene.conventions_of = "Bundler";
  std::vector<std::optional<size_t>> index_of;
  for (size_t i = 0; i < names.size(); ++i) ReadBundlerCamera(text, names[i], i, scene, index_of);
  for (int i = 0; i < points; ++i) ReadBundlerPoint(text, index_of, scene);
  text.ExpectEnd();
  if (scene.cameras.empty()) {
    throw Error(file.string() + ": expected at least one camera with a focal length, found none");
  }
  return scene;
}

}  // namespace dtr::io
