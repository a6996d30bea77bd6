#include "calib/files/opencv_yaml.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <optional>
#include <string_view>
#include <tuple>

#include "calib/boards/opencv_pixels.h"
#include "calib/files/camera_fields.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/text_file.h"

namespace dtr::calib {
namespace {

constexpr std::uintmax_t kLargestFileBytes = 16u << 20;  // OpenCV's samples write the points too

std::optional<double> NumberFrom(std::string_view word) { return FiniteNumber(Trimmed(word)); }

// The numbers of a matrix's "data: [ ... ]", or of a list.
std::vector<double> MatrixData(const Field& field, const std::string& where) {
  const std::string& text = field.text;
  const size_t data = text.find("data:");
  const size_t open = text.find('[', data == std::string::npos ? 0 : data);
  const size_t close = text.rfind(']');
  if (open == std::string::npos || close == std::string::npos || close < open) {
    throw Error(fmt::format("{}: {}: expected a matrix with data: [ ... ], found '{}'", where,
                            field.name, Shown(text)));
  }
  std::string list = text.substr(open + 1, close - open - 1);
  for (char& c : list) c = c == '\n' || c == '[' || c == ']' ? ' ' : c;  // rows may have their own
  std::vector<double> values;
  for (size_t at = 0; at <= list.size();) {
    const size_t end = std::min(list.find(',', at), list.size());
    const std::string word = list.substr(at, end - at);
    at = end + 1;
    if (Trimmed(word).empty() && Trimmed(list).empty()) break;
    const auto value = NumberFrom(word);
    if (!value) {
      throw Error(fmt::format("{}: {}: expected a finite number, found '{}'", where, field.name,
                              Shown(word)));
    }
    values.push_back(*value);
  }
  return values;
}

int SideFrom(std::optional<double> value, const Field& field, const std::string& where) {
  if (!value || *value != std::floor(*value) || *value < 1 || *value > kLongestSidePx) {
    throw Error(fmt::format("{}: {}: expected a whole number of 1 to {}, found '{}'", where,
                            field.name, kLongestSidePx, Shown(field.text)));
  }
  return static_cast<int>(*value);
}

// Width and height, of their own or as one pair.
std::pair<int, int> SizeFrom(const CameraFields& fields, const std::string& where) {
  const Field* pair = fields.Find(FieldRole::kSize);
  if (pair == nullptr) {
    const Field& width = fields.Get(FieldRole::kWidth);
    const Field& height = fields.Get(FieldRole::kHeight);
    return {SideFrom(NumberFrom(width.text), width, where),
            SideFrom(NumberFrom(height.text), height, where)};
  }
  const std::vector<double> sides = MatrixData(*pair, where);
  if (sides.size() != 2) {
    throw Error(fmt::format("{}: {}: expected [ width, height ], found {} numbers", where,
                            pair->name, sides.size()));
  }
  return {SideFrom(sides[0], *pair, where), SideFrom(sides[1], *pair, where)};
}

bool IsFisheye(const CameraFields& fields) {
  const Field* flag = fields.Named("fisheye_model");
  const Field* model = fields.Named("distortion_model");
  const auto says = [](const std::string& text, const char* word) {
    return text.find(word) != std::string::npos;
  };
  return (flag != nullptr && NumberFrom(flag->text).value_or(0) != 0) ||
         (model != nullptr && (says(model->text, "equidistant") || says(model->text, "fisheye")));
}

// Coefficients in OpenCV's order, which is that of FULL_OPENCV: k1 k2 p1 p2 k3 k4 k5 k6.
void AddCoefficients(std::vector<double> coefficients, bool fisheye, const std::string& where,
                     LensCamera& camera) {
  const size_t count = coefficients.size();
  for (size_t i = 8; i < count; ++i) {
    if (coefficients[i] != 0) {
      throw Error(where +
                  ": distortion_coefficients: expected no thin prism or tilted sensor, found "
                  "such terms; calibrate without CALIB_THIN_PRISM_MODEL, CALIB_TILTED_MODEL");
    }
  }
  const bool known = fisheye ? count == 4 : count <= 14 && count != 1 && count != 2 && count != 3;
  if (!known) {
    throw Error(fmt::format("{}: distortion_coefficients: expected {}, found {}", where,
                            fisheye ? "4" : "0, 4, 5, 8, 12 or 14", count));
  }
  if (fisheye) {
    camera.model = CameraModel::kOpenCvFisheye;
  } else if (count == 0) {
    camera.model = CameraModel::kPinhole;
  } else {
    camera.model = count == 4 ? CameraModel::kOpenCv : CameraModel::kFullOpenCv;
    coefficients.resize(count == 4 ? 4 : 8, 0.0);
  }
  camera.params.insert(camera.params.end(), coefficients.begin(), coefficients.end());
}

std::vector<double> OpenCvCoefficients(const LensCamera& camera) {
  const std::vector<double>& p = camera.params;
  switch (camera.model) {
    case CameraModel::kSimplePinhole:
    case CameraModel::kPinhole:
      return {0, 0, 0, 0};
    case CameraModel::kSimpleRadial:
      return {p[3], 0, 0, 0};
    case CameraModel::kRadial:
      return {p[3], p[4], 0, 0};
    case CameraModel::kSimpleRadialFisheye:
      return {p[3], 0, 0, 0};
    case CameraModel::kRadialFisheye:
      return {p[3], p[4], 0, 0};
    case CameraModel::kOpenCv:
    case CameraModel::kOpenCvFisheye:
      return {p[4], p[5], p[6], p[7]};
    case CameraModel::kFullOpenCv: {
      const bool rational = p[9] != 0 || p[10] != 0 || p[11] != 0;
      return {p.begin() + 4, p.begin() + (rational ? 12 : 9)};
    }
    case CameraModel::kSimpleFisheye:
    case CameraModel::kFisheye:
      return {0, 0, 0, 0};
    case CameraModel::kFov:
    case CameraModel::kThinPrismFisheye:
    case CameraModel::kRadTanThinPrismFisheye:
    case CameraModel::kSimpleDivision:
    case CameraModel::kDivision:
    case CameraModel::kEucm:
    case CameraModel::kBrownAffine:
    case CameraModel::kFisheyeAffine:
    case CameraModel::kInverseRadial:
      break;
  }
  throw Error("OpenCV has no camera model " + NameOf(camera.model) +
              "; write a COLMAP cameras.txt");
}

bool IsFisheye(CameraModel model) {
  return model == CameraModel::kOpenCvFisheye || model == CameraModel::kSimpleRadialFisheye ||
         model == CameraModel::kRadialFisheye || model == CameraModel::kSimpleFisheye ||
         model == CameraModel::kFisheye;
}

std::string Matrix(const char* key, int rows, const std::vector<double>& data) {
  return fmt::format("{}: !!opencv-matrix\n   rows: {}\n   cols: {}\n   dt: d\n   data: [ {} ]\n",
                     key, rows, data.size() / static_cast<size_t>(rows), fmt::join(data, ", "));
}

constexpr const char* kHead =
    "%YAML:1.0\n---\n# The centre of the first pixel is (0, 0), as OpenCV has it.\n";

std::string SizeAndKind(const LensCamera& camera) {
  return fmt::format("image_width: {}\nimage_height: {}\n{}", camera.width_px, camera.height_px,
                     IsFisheye(camera.model) ? "fisheye_model: 1\n" : "");
}

std::string MatricesOf(const LensCamera& camera, const char* k_name, const char* d_name) {
  const PinholeCamera k = camera.Pinhole();
  const std::vector<double> coefficients = OpenCvCoefficients(camera);
  return Matrix(k_name, 3,
                {k.fx_px(), 0, k.cx_px() - kOpenCvOffsetPx, 0, k.fy_px(),
                 k.cy_px() - kOpenCvOffsetPx, 0, 0, 1}) +
         Matrix(d_name, static_cast<int>(coefficients.size()), coefficients);
}

}  // namespace

LensCamera ReadOpenCvYaml(const std::filesystem::path& file) {
  const std::string where = file.string();
  const CameraFields fields(ReadTextFile(file, kLargestFileBytes), where);
  LensCamera camera;
  // The matrices first: what has none is another program's file, and its name is worth more.
  const Field& matrix = fields.Get(FieldRole::kMatrix);
  const Field& coefficients = fields.Get(FieldRole::kDistortion);
  std::tie(camera.width_px, camera.height_px) = SizeFrom(fields, where);
  const std::vector<double> k = MatrixData(matrix, where);
  if (k.size() != 9 || k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1) {
    throw Error(where + ": " + matrix.name +
                ": expected [fx, 0, cx, 0, fy, cy, 0, 0, 1]; skew is not supported");
  }
  camera.params = {k[0], k[4], k[2] + kOpenCvOffsetPx, k[5] + kOpenCvOffsetPx};
  AddCoefficients(MatrixData(coefficients, where), IsFisheye(fields), where, camera);
  try {
    camera.Check();
  } catch (const std::invalid_argument& error) {
    throw Error(where + ": " + matrix.name + ": " + error.what());
  }
  return camera;
}

void WriteOpenCvYaml(const std::filesystem::path& file, const LensCamera& camera) {
  WriteFileAtomically(file, kHead + SizeAndKind(camera) +
                                MatricesOf(camera, "camera_matrix", "distortion_coefficients"));
}

void WriteOpenCvStereoYaml(const std::filesystem::path& file, const LensCamera& first,
                           const LensCamera& second, const Pose& second_from_first) {
  // The file has one size and one kind for both.
  if (first.width_px != second.width_px || first.height_px != second.height_px) {
    throw Error(fmt::format(
        "{}: expected two cameras of one size, as OpenCV's stereo files have it, found {}x{} and "
        "{}x{}; write one .yml for each",
        file.string(), first.width_px, first.height_px, second.width_px, second.height_px));
  }
  if (IsFisheye(first.model) != IsFisheye(second.model)) {
    throw Error(fmt::format(
        "{}: expected two fisheyes or none, as OpenCV's stereo files have it, found {} and {}; "
        "write one .yml for each",
        file.string(), NameOf(first.model), NameOf(second.model)));
  }
  const Eigen::Matrix3d r = second_from_first.rotation.toRotationMatrix();
  const Eigen::Vector3d& t = second_from_first.translation;
  WriteFileAtomically(file, kHead + SizeAndKind(first) + MatricesOf(first, "M1", "D1") +
                                MatricesOf(second, "M2", "D2") +
                                Matrix("R", 3,
                                       {r(0, 0), r(0, 1), r(0, 2), r(1, 0), r(1, 1), r(1, 2),
                                        r(2, 0), r(2, 1), r(2, 2)}) +
                                Matrix("T", 3, {t.x(), t.y(), t.z()}));
}

}  // namespace dtr::calib
