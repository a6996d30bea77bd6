#include <fmt/format.h>

#include <Eigen/Geometry>
#include <numbers>

#include "dtr/base/error.h"
#include "dtr/base/text_file.h"
#include "dtr/base/text_rows.h"
#include "dtr/io/formats/foreign_readers.h"
#include "dtr/io/formats/pose_from_matrix.h"

namespace dtr::io {
namespace {

constexpr std::uintmax_t kMaxCsvBytes = 64u << 20;
constexpr std::string_view kCount = "#cameras";

// Of a first line "#cameras 5", which older versions write.
std::optional<double> AnnouncedCameras(std::string_view text) {
  const std::vector<std::string> words = CellsOf(text.substr(0, text.find('\n')), ' ');
  if (words.size() < 2 || words[0] != kCount) return std::nullopt;
  return FiniteNumber(words[1]);
}

// The cells of a camera. Older and newer versions of the program call the columns differently.
class CsvRow {
 public:
  CsvRow(const TextTable& table, std::string where) : table_(table), where_(std::move(where)) {}

  const std::string& where() const { return where_; }
  double Number(std::initializer_list<const char*> names) const {
    if (const auto column = table_.Find(names)) return table_.Number(*column);
    throw Error(fmt::format("{}: expected a column {}, found none; export with all columns", where_,
                            *names.begin()));
  }
  double NumberOrZero(std::initializer_list<const char*> names) const {
    const auto column = table_.Find(names);
    return column ? table_.Number(*column) : 0;
  }

 private:
  const TextTable& table_;
  std::string where_;
};

// The program's t1 stands at r^2 + 2 x^2, which OpenCV calls p2.
BrownTerms CsvTerms(const CsvRow& row) {
  BrownTerms terms;
  terms.k = {row.NumberOrZero({"k1"}),
             row.NumberOrZero({"k2"}),
             row.NumberOrZero({"k3"}),
             row.NumberOrZero({"k4"}),
             0,
             0};
  terms.p = {row.NumberOrZero({"t2"}), row.NumberOrZero({"t1"}), 0, 0};
  return terms;
}

// Focal length of 35 mm film, principal point in shares of the longer side from the middle, Euler
// angles of a camera that looks down with its top to the north.
ForeignCamera FilmCamera(const CsvRow& row) {
  constexpr double kFilmWidth = 36, kRadians = std::numbers::pi / 180;
  BrownTerms terms = CsvTerms(row);
  terms.fx = terms.fy = row.Number({"f", "f_35mm"}) / kFilmWidth;
  terms.cx = row.NumberOrZero({"px", "px_norm"});
  terms.cy = row.NumberOrZero({"py", "py_norm"});
  const auto turn = [&](std::initializer_list<const char*> names, const Eigen::Vector3d& axis) {
    return Eigen::AngleAxisd(row.Number(names) * kRadians, axis);
  };
  const Eigen::Matrix3d world_from_gl =
      (turn({"heading", "yaw"}, -Eigen::Vector3d::UnitZ()) *
       turn({"pitch"}, Eigen::Vector3d::UnitX()) * turn({"roll"}, Eigen::Vector3d::UnitY()))
          .toRotationMatrix();
  const Eigen::DiagonalMatrix<double, 3> gl_from_cam(1, -1, -1);
  ForeignCamera camera;
  camera.intrinsics.lens = LensFrom(terms);
  camera.intrinsics.from_centre = camera.intrinsics.in_long_sides = true;
  camera.cam_from_world = PoseFromCenter(
      world_from_gl * gl_from_cam, {row.Number({"x"}), row.Number({"y"}), row.Number({"alt", "z"})},
      kRotationTolerance, row.where());
  return camera;
}

// Pixels from the corner, cam_from_world as a matrix.
ForeignCamera OpenCvCamera(const CsvRow& row) {
  BrownTerms terms = CsvTerms(row);
  terms.fx = terms.fy = row.Number({"f_pix", "f"});
  terms.cx = row.Number({"px_pix", "px"});
  terms.cy = row.Number({"py_pix", "py"});
  Eigen::Matrix3d rotation;
  for (int i = 0; i < 9; ++i) {
    const std::string name = fmt::format("r{}{}", i / 3, i % 3);
    rotation(i / 3, i % 3) = row.Number({name.c_str()});
  }
  ForeignCamera camera;
  camera.intrinsics.lens = LensFrom(terms);
  camera.cam_from_world =
      PoseFromMatrix(rotation, {row.Number({"tx"}), row.Number({"ty"}), row.Number({"tz"})},
                     kPrintedRotationTolerance, row.where());
  return camera;
}

}  // namespace

ForeignScene ReadRealityScanCsv(const std::filesystem::path& file) {
  const std::string source = file.string();
  std::string text = ReadTextFile(file, kMaxCsvBytes);
  const std::optional<double> announced = AnnouncedCameras(text);
  TextTable table(std::move(text), source, kCount);
  const auto name = table.Find({"name"});
  if (!name) {
    throw Error(table.Where() +
                "expected a first line #name,x,y,alt,..., found another; export "
                "\"Internal/External camera parameters\"");
  }
  const bool has_matrices = table.Find({"r00"}).has_value();
  ForeignScene scene;
  while (table.Next()) {
    const CsvRow row(table, fmt::format("{}:{}", source, table.line()));
    ForeignCamera camera = has_matrices ? OpenCvCamera(row) : FilmCamera(row);
    camera.path = table.Cell(*name);
    camera.entry = fmt::format("line {}", table.line());
    scene.cameras.push_back(std::move(camera));
  }
  if (scene.cameras.empty()) throw Error(source + ": expected at least one camera, found none");
  if (announced && *announced != static_cast<double>(scene.cameras.size())) {
    throw Error(
        fmt::format("{}: expected {} cameras, as its first line says, found {}; the file "
                    "is cut short",
                    source, *announced, scene.cameras.size()));
  }
  return scene;
}

}  // namespace dtr::io
