#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "calib/files/calibration.h"
#include "calib/lens_map.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/json_fields.h"

namespace dtr::calib {
namespace {

using io::Json;
using io::JsonObject;

constexpr const char* kFormat = "dtr-calibration";
constexpr int kVersion = 1;
constexpr int kLongestSidePx = 1'000'000;
constexpr double kSymmetric = 1e-9;  // relative; written exactly, so rounding alone
constexpr double kRotation = 1e-6;   // R^T R = I, as for every pose file (CONVENTIONS.md)

/// JSON has no NaN: what was not measured is null.
Json Number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json ParamsJson(const CalibratedCamera& camera) {
  const auto names = FreeParameterNames(camera.model);
  Json json = Json::object();
  for (size_t i = 0; i < names.size(); ++i) json[names[i]] = camera.camera.params[i];
  return json;
}

Json CameraJson(const CalibratedCamera& camera) {
  Json covariance = Json::array();
  for (long i = 0; i < camera.covariance.rows(); ++i) {
    const Eigen::VectorXd row = camera.covariance.row(i);
    covariance.push_back(std::vector<double>(row.begin(), row.end()));
  }
  return {{"name", camera.name},
          {"model", NameOf(camera.model)},
          {"width_px", camera.camera.width_px},
          {"height_px", camera.camera.height_px},
          {"params", ParamsJson(camera)},
          {"covariance", covariance},
          {"rms_px", camera.rms_px},
          {"sigma_px", camera.sigma_px}};
}

Json PoseJson(const Pose& pose) {
  const Eigen::Matrix3d rotation = pose.rotation.toRotationMatrix();
  Json rows = Json::array();
  for (int i = 0; i < 3; ++i) {
    rows.push_back({rotation(i, 0), rotation(i, 1), rotation(i, 2), pose.translation[i]});
  }
  return rows;
}

Json ViewJson(const CalibratedView& view) {
  Json corners = Json::array();
  for (const BoardCorner& corner : view.seen.corners) {
    corners.push_back({corner.id, corner.pixel.x(), corner.pixel.y()});
  }
  return {{"name", view.seen.name},
          {"camera", view.camera},
          {"noise_px", Number(view.seen.noise_px)},
          {"cam_from_board", PoseJson(view.cam_from_board)},
          {"corners", corners},
          {"outliers", view.outliers}};
}

Json LeftOutJson(const std::vector<LeftOut>& left_out) {
  Json json = Json::array();
  for (const LeftOut& item : left_out) {
    json.push_back({{"name", item.name}, {"reason", item.reason}});
  }
  return json;
}

Json ModelsJson(const std::vector<TriedModel>& models) {
  Json json = Json::array();
  for (const TriedModel& tried : models) {
    Json item{{"model", NameOf(tried.model)},
              {"coefficients", FreeParameterCount(tried.model)},
              {"chosen", tried.chosen}};
    if (tried.held_out_rms_px) {
      item["held_out_rms_px"] = *tried.held_out_rms_px;
      item["difference_low_px"] = tried.low_px;
      item["difference_high_px"] = tried.high_px;
    }
    if (!tried.refused.empty()) item["refused"] = tried.refused;
    json.push_back(std::move(item));
  }
  return json;
}

double ViewRmsPx(const Calibration& calibration, const CalibratedView& view) {
  const LensMap lens(calibration.cameras[view.camera].camera);
  double sum = 0;
  int count = 0;
  for (const BoardCorner& corner : view.seen.corners) {
    if (std::binary_search(view.outliers.begin(), view.outliers.end(), corner.id)) continue;
    const auto pixel = lens.PixelFromCam(view.cam_from_board * calibration.board.Corner(corner.id));
    sum += pixel ? (*pixel - corner.pixel).squaredNorm() : std::numeric_limits<double>::infinity();
    ++count;
  }
  return count == 0 ? std::numeric_limits<double>::quiet_NaN() : std::sqrt(sum / count);
}

Eigen::MatrixXd ReadCovariance(const JsonObject& object, int size) {
  const Json& rows = object.Array("covariance");
  if (rows.size() != static_cast<size_t>(size)) {
    object.Fail("covariance", fmt::format("{} rows", size), fmt::format("{}", rows.size()));
  }
  Eigen::MatrixXd covariance(size, size);
  for (int i = 0; i < size; ++i) {
    const Json& row = rows[static_cast<size_t>(i)];
    if (!row.is_array() || row.size() != static_cast<size_t>(size)) {
      object.Fail("covariance", fmt::format("rows of {} numbers", size), row.dump().substr(0, 60));
    }
    for (int j = 0; j < size; ++j) {
      const Json& item = row[static_cast<size_t>(j)];
      if (!item.is_number()) object.Fail("covariance", "numbers", item.dump().substr(0, 60));
      covariance(i, j) = item.get<double>();
    }
  }
  for (int i = 0; i < size; ++i) {
    if (!(covariance(i, i) > 0)) object.Fail("covariance", "a positive diagonal");
    for (int j = 0; j < i; ++j) {
      const double scale = std::sqrt(covariance(i, i)) * std::sqrt(covariance(j, j));
      if (!(std::abs(covariance(i, j) - covariance(j, i)) <= kSymmetric * scale)) {
        object.Fail("covariance", "a symmetric matrix");
      }
    }
  }
  return covariance;
}

CalibratedCamera ReadCamera(const JsonObject& object, const std::string& file) {
  CalibratedCamera camera;
  camera.name = object.String("name");
  const auto model = BoardModelFromName(object.String("model"));
  if (!model) object.Fail("model", "pinhole, brown4, brown5, brown8 or fisheye");
  camera.model = *model;
  const int width_px = object.PositiveInt("width_px"), height_px = object.PositiveInt("height_px");
  if (width_px > kLongestSidePx) object.Fail("width_px", "at most a million");
  if (height_px > kLongestSidePx) object.Fail("height_px", "at most a million");
  std::vector<double> params;
  const JsonObject given = object.Object("params");
  for (const std::string& name : FreeParameterNames(*model)) params.push_back(given.Number(name));
  try {
    camera.camera = CameraFrom(*model, width_px, height_px, params);
  } catch (const std::invalid_argument& error) {
    throw Error(file + ": cameras: params: " + error.what());
  }
  camera.covariance = ReadCovariance(object, FreeParameterCount(*model));
  camera.rms_px = object.Number("rms_px");
  camera.sigma_px = object.Positive("sigma_px");
  return camera;
}

Pose ReadPose(const JsonObject& object) {
  const char* key = "cam_from_board";
  const Json& rows = object.Array(key);
  Eigen::Matrix<double, 3, 4> matrix;
  if (rows.size() != 3) object.Fail(key, "3 rows of 4 numbers");
  for (int i = 0; i < 3; ++i) {
    const Json& row = rows[static_cast<size_t>(i)];
    if (!row.is_array() || row.size() != 4) object.Fail(key, "3 rows of 4 numbers");
    for (int j = 0; j < 4; ++j) {
      const Json& item = row[static_cast<size_t>(j)];
      if (!item.is_number()) object.Fail(key, "numbers");
      matrix(i, j) = item.get<double>();
    }
  }
  const Eigen::Matrix3d rotation = matrix.leftCols<3>();
  const double off =
      (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(off < kRotation) || !(rotation.determinant() > 0)) object.Fail(key, "a rotation");
  return {Eigen::Quaterniond(rotation).normalized(), matrix.col(3)};
}

std::vector<BoardCorner> ReadCorners(const JsonObject& object, const Board& board) {
  std::vector<BoardCorner> corners;
  for (const Json& item : object.Array("corners")) {
    if (!item.is_array() || item.size() != 3 || !item[0].is_number_integer() ||
        !item[1].is_number() || !item[2].is_number()) {
      object.Fail("corners", "[id, x, y]", item.dump().substr(0, 60));
    }
    const auto id = item[0].get<std::int64_t>();
    if (id < 0 || id >= board.CornerCount() || (!corners.empty() && id <= corners.back().id)) {
      object.Fail("corners", fmt::format("rising ids below {}", board.CornerCount()),
                  fmt::format("{}", id));
    }
    corners.push_back({static_cast<int>(id), {item[1].get<double>(), item[2].get<double>()}});
  }
  return corners;
}

CalibratedView ReadView(const JsonObject& object, const Calibration& calibration) {
  CalibratedView view;
  view.seen.name = object.String("name");
  view.camera = object.Unsigned("camera");
  if (view.camera >= calibration.cameras.size()) {
    object.Fail("camera", fmt::format("an index below {}", calibration.cameras.size()));
  }
  view.seen.noise_px =
      object.Has("noise_px") ? object.Number("noise_px") : std::numeric_limits<double>::quiet_NaN();
  view.cam_from_board = ReadPose(object);
  view.seen.corners = ReadCorners(object, calibration.board);
  for (const Json& item : object.Array("outliers")) {
    if (!item.is_number_integer() || (!view.outliers.empty() && item <= view.outliers.back())) {
      object.Fail("outliers", "rising ids", item.dump().substr(0, 60));
    }
    const auto id = item.get<std::int64_t>();
    if (std::none_of(view.seen.corners.begin(), view.seen.corners.end(),
                     [&](const BoardCorner& corner) { return corner.id == id; })) {
      object.Fail("outliers", "ids of corners", fmt::format("{}", id));
    }
    view.outliers.push_back(static_cast<int>(id));
  }
  return view;
}

TriedModel ReadTried(const JsonObject& object) {
  TriedModel tried;
  const auto model = BoardModelFromName(object.String("model"));
  if (!model) object.Fail("model", "pinhole, brown4, brown5, brown8 or fisheye");
  tried.model = *model;
  tried.chosen = object.Has("chosen") && object.Value("chosen") == Json(true);
  if (object.Has("held_out_rms_px")) {
    tried.held_out_rms_px = object.Number("held_out_rms_px");
    tried.low_px = object.Number("difference_low_px");
    tried.high_px = object.Number("difference_high_px");
  }
  if (object.Has("refused")) tried.refused = object.String("refused");
  return tried;
}

Board ReadBoard(const JsonObject& object) {
  try {
    return BoardFromText(object.String("board"));
  } catch (const UsageError& error) {
    object.Fail("board", "a board as --board takes it");
  }
}

}  // namespace

void WriteCalibration(const std::filesystem::path& file, const Calibration& calibration) {
  Json json{{"format", kFormat}, {"version", kVersion}, {"board", TextOf(calibration.board)}};
  json["cameras"] = Json::array();
  for (const auto& camera : calibration.cameras) json["cameras"].push_back(CameraJson(camera));
  json["models"] = ModelsJson(calibration.models);
  json["left_out"] = LeftOutJson(calibration.left_out);
  json["views"] = Json::array();
  for (const auto& view : calibration.views) json["views"].push_back(ViewJson(view));
  WriteFileAtomically(file, io::PrettyJson(json, file.string()));
}

Calibration ReadCalibration(const std::filesystem::path& file) {
  const std::string where = file.string();
  const Json json = io::ParseJson(ReadFile(file, kLargestCalibrationBytes), where);
  const JsonObject root(json, where, "");
  if (root.String("format") != kFormat) root.Fail("format", fmt::format("\"{}\"", kFormat));
  if (root.PositiveInt("version") != kVersion) root.Fail("version", fmt::format("{}", kVersion));
  Calibration calibration;
  calibration.board = ReadBoard(root);
  const auto each = [&](const char* key, const auto& read) {
    for (size_t i = 0; i < root.Array(key).size(); ++i) read(root.Item(key, i));
  };
  each("cameras",
       [&](const JsonObject& item) { calibration.cameras.push_back(ReadCamera(item, where)); });
  if (calibration.cameras.empty()) root.Fail("cameras", "at least one camera");
  each("models", [&](const JsonObject& item) { calibration.models.push_back(ReadTried(item)); });
  each("left_out", [&](const JsonObject& item) {
    calibration.left_out.push_back({item.String("name"), item.String("reason")});
  });
  each("views",
       [&](const JsonObject& item) { calibration.views.push_back(ReadView(item, calibration)); });
  return calibration;
}

std::string SummaryJson(const Calibration& calibration) {
  Json json{{"board", TextOf(calibration.board)}};
  json["cameras"] = Json::array();
  for (const auto& camera : calibration.cameras) json["cameras"].push_back(CameraJson(camera));
  json["views"] = Json::array();
  for (const auto& view : calibration.views) {
    json["views"].push_back({{"name", view.seen.name},
                             {"camera", view.camera},
                             {"corners", view.seen.corners.size()},
                             {"rms_px", Number(ViewRmsPx(calibration, view))},
                             {"noise_px", Number(view.seen.noise_px)},
                             {"outliers", view.outliers}});
  }
  json["models"] = ModelsJson(calibration.models);
  json["left_out"] = LeftOutJson(calibration.left_out);
  // Names come from files: bytes that are no UTF-8 must not make the whole summary unreadable.
  return json.dump(1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace dtr::calib
