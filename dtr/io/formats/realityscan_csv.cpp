#include <fmt/format.h>

#include <Eigen/Geometry>
#include <charconv>
#include <cmath>
#include <map>
#include <numbers>

#include "dtr/base/error.h"
#include "dtr/base/file_names.h"
#include "dtr/base/files.h"
#include "dtr/base/lower_case.h"
#include "dtr/io/formats/foreign_readers.h"
#include "dtr/io/formats/pose_from_matrix.h"

namespace dtr::io {
namespace {

constexpr std::uintmax_t kMaxCsvBytes = 64u << 20;

std::vector<std::string> CsvWords(std::string_view line) {
  std::vector<std::string> words;
  for (size_t at = 0; at <= line.size();) {
    const size_t end = std::min(line.find(',', at), line.size());
    std::string_view word = line.substr(at, end - at);
    while (!word.empty() && (word.front() == ' ' || word.front() == '\t')) word.remove_prefix(1);
    while (!word.empty() && (word.back() == ' ' || word.back() == '\t')) word.remove_suffix(1);
    words.emplace_back(word);
    at = end + 1;
  }
  return words;
}

// The first line's names, as the older and the newer versions of the program call the columns.
class CsvColumns {
 public:
  CsvColumns(std::string_view line, const std::string& where) {
    while (line.starts_with('#')) line.remove_prefix(1);
    const std::vector<std::string> names = CsvWords(line);
    for (size_t i = 0; i < names.size(); ++i) {
      // "k1 (comment)": some templates explain a column behind its name.
      const std::string name = LowerCase(names[i].substr(0, names[i].find(' ')));
      if (!index_.emplace(name, i).second) {
        throw Error(fmt::format("{}: the column {} stands twice", where, Printable(name)));
      }
    }
    count_ = names.size();
  }

  size_t count() const { return count_; }
  std::optional<size_t> Find(std::initializer_list<const char*> names) const {
    for (const char* name : names) {
      if (const auto found = index_.find(name); found != index_.end()) return found->second;
    }
    return std::nullopt;
  }

 private:
  std::map<std::string, size_t> index_;
  size_t count_ = 0;
};

class CsvRow {
 public:
  CsvRow(const CsvColumns& columns, std::vector<std::string> words, std::string where)
      : columns_(columns), words_(std::move(words)), where_(std::move(where)) {}

  const std::string& where() const { return where_; }
  const std::string& Text(const char* name) const { return words_[columns_.Find({name}).value()]; }
  double Number(std::initializer_list<const char*> names) const {
    const auto column = columns_.Find(names);
    if (!column) {
      throw Error(fmt::format("{}: expected a column {}, found none; export with all columns",
                              where_, *names.begin()));
    }
    return From(*column, *names.begin());
  }
  double NumberOrZero(std::initializer_list<const char*> names) const {
    const auto column = columns_.Find(names);
    return column ? From(*column, *names.begin()) : 0;
  }

 private:
  double From(size_t column, const char* name) const {
    const std::string& word = words_[column];
    const char* begin = word.data() + (word.starts_with('+') ? 1 : 0);
    double number = 0;
    const auto [end, failure] = std::from_chars(begin, word.data() + word.size(), number);
    if (failure == std::errc() && end == word.data() + word.size() && std::isfinite(number)) {
      return number;
    }
    throw Error(fmt::format("{}: {}: expected a finite number, found '{}'", where_, name,
                            Printable(word.substr(0, 40))));
  }

  const CsvColumns& columns_;
  std::vector<std::string> words_;
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
  const std::string text = ReadFile(file, kMaxCsvBytes);
  if (text.empty() || text.back() != '\n') {
    throw Error(source +
                ": expected a line end at the end of the file, found none; the file is "
                "cut short (add the line end if it is not)");
  }
  ForeignScene scene;
  std::optional<CsvColumns> columns;
  size_t number = 0;
  for (size_t at = 0; at < text.size();) {
    const size_t end = text.find('\n', at);
    std::string_view line(text.data() + at, end - at);
    at = end + 1;
    ++number;
    if (line.ends_with('\r')) line.remove_suffix(1);
    const std::string where = fmt::format("{}:{}", source, number);
    if (line.empty() || line.starts_with("#cameras")) continue;
    if (!columns) {
      columns.emplace(line, where);
      if (!columns->Find({"name"})) {
        throw Error(where +
                    ": expected a first line #name,x,y,alt,..., found another; export "
                    "\"Internal/External camera parameters\"");
      }
      continue;
    }
    if (line.starts_with('#')) continue;
    std::vector<std::string> words = CsvWords(line);
    if (words.size() != columns->count()) {
      throw Error(fmt::format("{}: expected {} columns as the first line has, found {}", where,
                              columns->count(), words.size()));
    }
    const CsvRow row(*columns, std::move(words), where);
    ForeignCamera camera = columns->Find({"r00"}) ? OpenCvCamera(row) : FilmCamera(row);
    camera.path = row.Text("name");
    camera.entry = fmt::format("line {}", number);
    scene.cameras.push_back(std::move(camera));
  }
  if (scene.cameras.empty()) throw Error(source + ": expected at least one camera, found none");
  return scene;
}

}  // namespace dtr::io
