#include "calib/files/rig_files.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <optional>
#include <stdexcept>

#include "calib/boards/opencv_pixels.h"
#include "calib/files/camera_fields.h"
#include "calib/files/opencv_yaml.h"
#include "dtr/base/error.h"
#include "dtr/base/text_file.h"

namespace dtr::calib {
namespace {

constexpr std::uintmax_t kMaxRigFileBytes = 64u << 20;  // mrcal's models carry their board views
constexpr double kRigRotationTolerance = 1e-3;          // printed digits

// All numbers of a flow or block list, whatever brackets, commas and dashes stand between them.
std::vector<double> NumbersOf(std::string text, const std::string& where) {
  std::replace_if(
      text.begin(), text.end(),
      [](char c) { return c == '[' || c == ']' || c == ',' || c == '\n' || c == '\t'; }, ' ');
  std::vector<double> numbers;
  for (size_t at = text.find_first_not_of(' '); at != std::string::npos;
       at = text.find_first_not_of(' ', at)) {
    const size_t end = std::min(text.find(' ', at), text.size());
    const std::string word = text.substr(at, end - at);
    at = end;
    if (word == "-") continue;  // of a block list
    const auto number = FiniteNumber(word);
    if (!number) {
      throw Error(fmt::format("{}: expected finite numbers, found '{}'", where, Shown(word)));
    }
    numbers.push_back(*number);
  }
  return numbers;
}

std::vector<double> NumbersOf(const std::string& text, size_t count, const std::string& where) {
  const std::vector<double> numbers = NumbersOf(text, where);
  if (numbers.size() == count) return numbers;
  throw Error(fmt::format("{}: expected {} numbers, found {}", where, count, numbers.size()));
}

Pose RigPose(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation,
             const std::string& where) {
  const double deviation =
      (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(deviation <= kRigRotationTolerance) || !(rotation.determinant() > 0)) {
    throw Error(where + ": expected a rotation, found another matrix");
  }
  return {Eigen::Quaterniond(rotation).normalized(), translation};
}

Pose RigPose(const std::vector<double>& m, const std::string& where) {
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(m.data());
  return RigPose(matrix.topLeftCorner<3, 3>(), matrix.topRightCorner<3, 1>(), where);
}

// Focal lengths and principal point as the programs count, then the model's other parameters.
LensCamera LensOf(CameraModel model, int width_px, int height_px, const std::vector<double>& k,
                  std::vector<double> terms, const std::string& where) {
  LensCamera camera{
      model, width_px, height_px, {k[0], k[1], k[2] + kOpenCvOffsetPx, k[3] + kOpenCvOffsetPx}};
  terms.resize(static_cast<size_t>(ParameterCount(model)) - 4, 0.0);
  camera.params.insert(camera.params.end(), terms.begin(), terms.end());
  try {
    camera.Check();
  } catch (const std::invalid_argument& error) {
    throw Error(where + ": " + error.what());
  }
  constexpr double kMinFocal = 0.02;  // of the longer side, 175 degrees
  if (camera.params[0] < kMinFocal * std::max(width_px, height_px)) {
    throw Error(
        fmt::format("{}: a focal length of {:g} px cannot be that of an image of {} x {} "
                    "px; the file has another unit",
                    where, camera.params[0], width_px, height_px));
  }
  return camera;
}

int Side(double value, const std::string& where) {
  if (value == std::floor(value) && value >= 1 && value <= kLongestSidePx) {
    return static_cast<int>(value);
  }
  throw Error(fmt::format("{}: expected 1 to {} pixels, found {}", where, kLongestSidePx, value));
}

// OpenCV's 4, 5 or 8 coefficients (12 and 14 where the further ones are zero).
LensCamera OpenCvLens(const std::vector<double>& k, std::vector<double> d, bool fisheye,
                      int width_px, int height_px, const std::string& where) {
  for (size_t i = 8; i < d.size(); ++i) {
    if (d[i] == 0) continue;
    throw Error(where +
                ": thin prism and tilted sensor terms are not supported; calibrate without "
                "them");
  }
  if (fisheye ? d.size() != 4 : d.size() != 0 && d.size() < 4) {
    throw Error(fmt::format("{}: expected {} distortion coefficients, found {}", where,
                            fisheye ? "4" : "0, 4, 5 or 8", d.size()));
  }
  const CameraModel model = fisheye         ? CameraModel::kOpenCvFisheye
                            : d.empty()     ? CameraModel::kPinhole
                            : d.size() == 4 ? CameraModel::kOpenCv
                                            : CameraModel::kFullOpenCv;
  return LensOf(model, width_px, height_px, k, std::move(d), where);
}

std::string Unquoted(std::string_view text) {
  text = Trimmed(text);
  while (!text.empty() && (text.front() == '"' || text.front() == '\'')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == '"' || text.back() == '\'')) text.remove_suffix(1);
  return std::string(text);
}

// The fields of one camera of a chain: lines "key: value" and what follows each.
std::map<std::string, std::string> SubFields(const std::string& text, const std::string& where) {
  std::map<std::string, std::string> fields;
  std::string* last = nullptr;
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find('\n', at), text.size());
    const std::string line(Trimmed(std::string_view(text).substr(at, end - at)));
    at = end + 1;
    if (line.empty() || line[0] == '#') continue;
    const size_t colon = line.find(':');
    const bool is_key =
        colon != std::string::npos && std::isalpha(static_cast<unsigned char>(line[0])) != 0;
    if (is_key) {
      const std::string key = line.substr(0, colon);
      if (fields.contains(key)) throw Error(where + ": the key '" + Shown(key) + "' stands twice");
      last = &(fields[key] = std::string(Trimmed(std::string_view(line).substr(colon + 1))));
    } else if (last != nullptr) {
      *last += "\n" + line;
    }
  }
  return fields;
}

const std::string& Need(const std::map<std::string, std::string>& fields, const char* key,
                        const std::string& where) {
  const auto found = fields.find(key);
  if (found != fields.end()) return found->second;
  throw Error(fmt::format("{}: expected a field {}, found none", where, key));
}

LensCamera KalibrLens(const std::map<std::string, std::string>& fields, const std::string& where) {
  const std::vector<double> size =
      NumbersOf(Need(fields, "resolution", where), 2, where + ".resolution");
  const int width_px = Side(size[0], where + ".resolution");
  const int height_px = Side(size[1], where + ".resolution");
  const std::string model = Unquoted(Need(fields, "camera_model", where));
  const std::string distortion = Unquoted(Need(fields, "distortion_model", where));
  const auto intrinsics = [&](size_t count) {
    return NumbersOf(Need(fields, "intrinsics", where), count, where + ".intrinsics");
  };
  const auto terms = [&](size_t count) {
    return NumbersOf(Need(fields, "distortion_coeffs", where), count, where + ".distortion_coeffs");
  };
  if (model == "pinhole") {
    const std::vector<double> k = intrinsics(4);
    if (distortion == "radtan") {
      return LensOf(CameraModel::kOpenCv, width_px, height_px, k, terms(4), where);
    }
    if (distortion == "equidistant" || distortion == "equi") {
      return LensOf(CameraModel::kOpenCvFisheye, width_px, height_px, k, terms(4), where);
    }
    if (distortion == "fov") {
      return LensOf(CameraModel::kFov, width_px, height_px, k, terms(1), where);
    }
    if (distortion == "none") {
      return LensOf(CameraModel::kPinhole, width_px, height_px, k, {}, where);
    }
  }
  if (model == "eucm" && distortion == "none") {
    const std::vector<double> v = intrinsics(6);
    return LensOf(CameraModel::kEucm, width_px, height_px, {v[2], v[3], v[4], v[5]}, {v[0], v[1]},
                  where);
  }
  throw Error(fmt::format(
      "{}: camera_model {} with distortion_model {} cannot be used; calibrate with pinhole-radtan, "
      "pinhole-equi, pinhole-fov or eucm-none",
      where, Shown(model), Shown(distortion)));
}

CameraFile KalibrChain(const CameraFields& fields, const std::string& source) {
  CameraFile file;
  file.metric = true;
  for (size_t i = 0;; ++i) {
    const std::string name = fmt::format("cam{}", i);
    const Field* field = fields.Named(name);
    if (field == nullptr) break;
    const std::string where = source + ": " + name;
    const auto sub = SubFields(field->text, where);
    FiledCamera& camera = file.cameras.emplace_back();
    camera.name = name;
    camera.camera = KalibrLens(sub, where);
    if (i == 0) continue;
    const Pose& before = file.cameras[i - 1].cam_from_rig;
    camera.cam_from_rig =
        RigPose(NumbersOf(Need(sub, "T_cn_cnm1", where), 16, where + ".T_cn_cnm1"),
                where + ".T_cn_cnm1") *
        before;
  }
  return file;
}

std::vector<double> MatrixOf(const Field& field, size_t count, const std::string& source) {
  const std::string where = source + ": " + field.name;
  const size_t data = field.text.find("data:");
  return NumbersOf(data == std::string::npos ? field.text : field.text.substr(data + 5), count,
                   where);
}

LensCamera OrbSlamLens(const CameraFields& fields, const std::string& prefix, bool fisheye,
                       const std::string& source) {
  const auto number = [&](const std::string& key) -> std::optional<double> {
    const Field* field = fields.Named(key);
    if (field == nullptr) return std::nullopt;
    return NumbersOf(field->text, 1, source + ": " + key).front();
  };
  const auto need = [&](const std::string& key) {
    const auto value = number(key);
    if (!value) throw Error(fmt::format("{}: expected a field {}, found none", source, key));
    return *value;
  };
  const int width_px = Side(need("Camera.width"), source + ": Camera.width");
  const int height_px = Side(need("Camera.height"), source + ": Camera.height");
  const std::vector<double> k = {need(prefix + "fx"), need(prefix + "fy"), need(prefix + "cx"),
                                 need(prefix + "cy")};
  const auto term = [&](const char* key) { return number(prefix + key).value_or(0); };
  std::vector<double> d = fisheye
                              ? std::vector<double>{term("k1"), term("k2"), term("k3"), term("k4")}
                              : std::vector<double>{term("k1"), term("k2"), term("p1"), term("p2")};
  if (!fisheye && term("k3") != 0) d.push_back(term("k3"));
  return OpenCvLens(k, d, fisheye, width_px, height_px, source + ": " + prefix + "fx");
}

CameraFile OrbSlamSettings(const CameraFields& fields, const std::string& source) {
  const Field* type = fields.Named("Camera.type");
  const std::string kind = type == nullptr ? "PinHole" : Unquoted(type->text);
  if (kind != "PinHole" && kind != "KannalaBrandt8" && kind != "Rectified") {
    throw Error(fmt::format("{}: Camera.type: expected PinHole or KannalaBrandt8, found {}", source,
                            Shown(kind)));
  }
  const bool fisheye = kind == "KannalaBrandt8";
  const bool numbered = fields.Named("Camera1.fx") != nullptr;
  CameraFile file;
  file.metric = true;
  file.cameras.push_back(
      {"left", OrbSlamLens(fields, numbered ? "Camera1." : "Camera.", fisheye, source), {}});
  if (fields.Named("Camera2.fx") == nullptr) return file;
  const Field* place = fields.Named("Stereo.T_c1_c2");
  if (place == nullptr) throw Error(source + ": expected a field Stereo.T_c1_c2, found none");
  const Pose first_from_second = RigPose(MatrixOf(*place, 16, source), source + ": Stereo.T_c1_c2");
  file.cameras.push_back(
      {"right", OrbSlamLens(fields, "Camera2.", fisheye, source), first_from_second.Inverse()});
  return file;
}

// The field with one of these names.
const Field* AnyOf(const CameraFields& fields, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    if (const Field* field = fields.Named(name)) return field;
  }
  return nullptr;
}

struct PairFields {
  const Field *k = nullptr, *d = nullptr;
};

PairFields FieldsOfPair(const CameraFields& fields, int number) {
  const std::string n = std::to_string(number);
  const auto any = [&](std::initializer_list<const char*> stems) {
    for (const char* stem : stems) {
      if (const Field* field = fields.Named(stem + n)) return field;
    }
    return static_cast<const Field*>(nullptr);
  };
  return {any({"M", "cameraMatrix", "camera_matrix_", "camera_matrix", "K"}),
          any({"D", "distCoeffs", "dist_coeffs_", "distortion_coefficients_", "distortion_coeffs_",
               "dist_coeffs", "distCoeffs_"})};
}

CameraFile StereoPair(const CameraFields& fields, const std::string& source) {
  const Field* r = AnyOf(fields, {"R", "rotation"});
  const Field* t = AnyOf(fields, {"T", "translation", "t"});
  if (r == nullptr || t == nullptr) {
    throw Error(source +
                ": expected R and T of the second camera, found none; write them beside "
                "M1, D1, M2 and D2");
  }
  const Field* width = AnyOf(fields, {"image_width", "imageWidth", "width"});
  const Field* height = AnyOf(fields, {"image_height", "imageHeight", "height"});
  const Field* size = AnyOf(fields, {"image_size", "imageSize", "img_size", "size"});
  if (size == nullptr && (width == nullptr || height == nullptr)) {
    throw Error(source + ": expected image_width and image_height, found none; add them");
  }
  const std::vector<double> sides =
      size != nullptr
          ? MatrixOf(*size, 2, source)
          : std::vector<double>{MatrixOf(*width, 1, source)[0], MatrixOf(*height, 1, source)[0]};
  const Field* flag = fields.Named("fisheye_model");
  const bool fisheye = flag != nullptr && MatrixOf(*flag, 1, source)[0] != 0;
  CameraFile file;
  for (const int number : {1, 2}) {
    const PairFields pair = FieldsOfPair(fields, number);
    if (pair.k == nullptr || pair.d == nullptr) {
      throw Error(fmt::format("{}: expected M{} and D{} (camera matrix and distortion), found none",
                              source, number, number));
    }
    const std::vector<double> k = MatrixOf(*pair.k, 9, source);
    const std::string where = source + ": " + pair.k->name;
    if (k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1) {
      throw Error(where + ": expected [fx, 0, cx, 0, fy, cy, 0, 0, 1]; skew is not supported");
    }
    const size_t data = pair.d->text.find("data:");
    const std::vector<double> d =
        NumbersOf(data == std::string::npos ? pair.d->text : pair.d->text.substr(data + 5),
                  source + ": " + pair.d->name);
    file.cameras.push_back({number == 1 ? "left" : "right",
                            OpenCvLens({k[0], k[4], k[2], k[5]}, d, fisheye, Side(sides[0], where),
                                       Side(sides[1], where), where),
                            {}});
  }
  const std::vector<double> rotation = MatrixOf(*r, 9, source);
  const std::vector<double> shift = MatrixOf(*t, 3, source);
  file.cameras[1].cam_from_rig =
      RigPose(Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rotation.data()),
              {shift[0], shift[1], shift[2]}, source + ": " + r->name);
  return file;
}

// What stands behind 'key': of a Python literal: the text in quotes, or of a list down to its end.
std::optional<std::string> LiteralOf(const std::string& text, const std::string& key,
                                     const std::string& source) {
  size_t at = text.find("'" + key + "'");
  if (at == std::string::npos) at = text.find("\"" + key + "\"");
  if (at == std::string::npos) return std::nullopt;
  at = text.find(':', at);
  const size_t begin = at == std::string::npos ? at : text.find_first_not_of(" \t\r\n", at + 1);
  const char first = begin == std::string::npos ? '\0' : text[begin];
  const char last = first == '[' ? ']' : first;
  const size_t end = first == '[' || first == '\'' || first == '"' ? text.find(last, begin + 1)
                                                                   : std::string::npos;
  if (end == std::string::npos) {
    throw Error(
        fmt::format("{}: {}: expected a text or a list, found neither; the file may be cut "
                    "short",
                    source, key));
  }
  return text.substr(begin + 1, end - begin - 1);
}

std::string WithoutComments(const std::string& text) {
  std::string out;
  char quote = '\0';
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quote == '\0' && c == '#') {
      i = std::min(text.find('\n', i), text.size()) - 1;
      continue;
    }
    if (quote == '\0' && (c == '\'' || c == '"')) {
      quote = c;
    } else if (c == quote) {
      quote = '\0';
    }
    out += c;
  }
  return out;
}

CameraFile MrcalModel(const std::string& content, const std::string& source) {
  const std::string text = WithoutComments(content);
  const size_t last = text.find_last_not_of(" \t\r\n");
  if (last == std::string::npos || text[last] != '}') {
    throw Error(source + ": expected } at the end, found another; the file is cut short");
  }
  const auto need = [&](const char* key) {
    const auto value = LiteralOf(text, key, source);
    if (!value) throw Error(fmt::format("{}: expected {}, found none", source, key));
    return *value;
  };
  const std::string model = need("lensmodel");
  static const std::map<std::string, size_t> kTerms = {{"LENSMODEL_PINHOLE", 0},
                                                       {"LENSMODEL_OPENCV4", 4},
                                                       {"LENSMODEL_OPENCV5", 5},
                                                       {"LENSMODEL_OPENCV8", 8},
                                                       {"LENSMODEL_OPENCV12", 12}};
  const auto known = kTerms.find(model);
  if (known == kTerms.end()) {
    throw Error(fmt::format(
        "{}: lensmodel {} cannot be used; fit LENSMODEL_OPENCV8 to it (mrcal-convert-lensmodel)",
        source, Shown(model)));
  }
  const std::vector<double> v =
      NumbersOf(need("intrinsics"), 4 + known->second, source + ": intrinsics");
  const std::vector<double> size = NumbersOf(need("imagersize"), 2, source + ": imagersize");
  auto place = LiteralOf(text, "rt_cam_ref", source);
  if (!place) place = LiteralOf(text, "extrinsics", source);
  FiledCamera camera;
  camera.name = std::filesystem::path(source).stem().string();
  camera.camera =
      OpenCvLens(v, {v.begin() + 4, v.end()}, false, Side(size[0], source + ": imagersize"),
                 Side(size[1], source + ": imagersize"), source + ": intrinsics");
  if (place) {
    const std::vector<double> rt = NumbersOf(*place, 6, source + ": extrinsics");
    const Eigen::Vector3d axis(rt[0], rt[1], rt[2]);
    const double angle = axis.norm();
    if (angle > 0) camera.cam_from_rig.rotation = Eigen::AngleAxisd(angle, axis / angle);
    camera.cam_from_rig.translation = {rt[3], rt[4], rt[5]};
  }
  return {{camera}, false};
}

}  // namespace

CameraFile ReadCamerasOf(const std::filesystem::path& file) {
  const std::string source = file.string();
  const std::string content = ReadTextFile(file, kMaxRigFileBytes);
  if (content.find("lensmodel") != std::string::npos) return MrcalModel(content, source);
  const CameraFields fields(content, source);
  const Field* first = fields.Named("cam0");
  if (first != nullptr && first->text.find("intrinsics:") != std::string::npos) {
    return KalibrChain(fields, source);
  }
  if (fields.Named("Camera1.fx") != nullptr || fields.Named("Camera.fx") != nullptr) {
    return OrbSlamSettings(fields, source);
  }
  if (FieldsOfPair(fields, 1).k != nullptr && FieldsOfPair(fields, 2).k != nullptr) {
    return StereoPair(fields, source);
  }
  return {{{file.stem().string(), ReadOpenCvYaml(file), {}}}, false};
}

}  // namespace dtr::calib
