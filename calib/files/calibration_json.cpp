#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "calib/files/calibration.h"
#include "calib/files/camera_fields.h"
#include "calib/files/summary_json.h"
#include "calib/lens_map.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/json_number.h"
#include "dtr/base/text_file.h"
#include "dtr/io/json_fields.h"

namespace dtr::calib {
namespace {

using io::Json;
using io::JsonObject;

constexpr const char* kFormat = "dtr-calibration";
constexpr int kVersion = 1;
constexpr double kSymmetric = 1e-9;  // relative; written exactly, so rounding alone
constexpr double kRotation = 1e-6;   // R^T R = I, as for every pose file (CONVENTIONS.md)

Json ParamsJson(const CalibratedCamera& camera) {
  const auto names = FreeParameterNames(camera.model);
  Json json = Json::object();
  for (size_t i = 0; i < names.size(); ++i) json[names[i]] = camera.camera.params[i];
  return json;
}

Json MatrixJson(const Eigen::MatrixXd& matrix) {
  Json rows = Json::array();
  for (long i = 0; i < matrix.rows(); ++i) {
    const Eigen::VectorXd row = matrix.row(i);
    rows.push_back(std::vector<double>(row.begin(), row.end()));
  }
  return rows;
}

Json PoseJson(const Pose& pose) {
  Eigen::Matrix<double, 3, 4> matrix;
  matrix << pose.rotation.toRotationMatrix(), pose.translation;
  return MatrixJson(matrix);
}

Json CameraJson(const CalibratedCamera& camera) {
  Json json{{"name", camera.name},
            {"model", NameOf(camera.model)},
            {"width_px", camera.camera.width_px},
            {"height_px", camera.camera.height_px},
            {"params", ParamsJson(camera)},
            {"covariance", MatrixJson(camera.covariance)},
            {"rms_px", camera.rms_px},
            {"sigma_px", camera.sigma_px}};
  if (camera.place_covariance.size() > 0) {
    json["cam_from_rig"] = PoseJson(camera.cam_from_rig);
    json["place_covariance"] = MatrixJson(camera.place_covariance);
  }
  if (camera.delay) {
    json["delay"] = {{"frames", camera.delay->frames},
                     {"sigma_frames", camera.delay->sigma},
                     {"corners_moved", camera.delay->corners_moved}};
  }
  return json;
}

// Views whose photos nothing rotated look as they always did.
void AddRotation(const CalibratedView& view, Json& json) {
  if (view.seen.rotation == PhotoRotation::kNone) return;
  json["photo_rotation_deg"] = DegreesOf(view.seen.rotation);
}

Json ViewJson(const CalibratedView& view) {
  Json corners = Json::array();
  for (const BoardCorner& corner : view.seen.corners) {
    corners.push_back({corner.id, corner.pixel.x(), corner.pixel.y()});
  }
  Json json{{"name", view.seen.name},
            {"camera", view.camera},
            {"frame", view.frame},
            {"noise_px", NumberOrNull(view.seen.noise_px)},
            {"cam_from_board", PoseJson(view.cam_from_board)},
            {"corners", corners},
            {"outliers", view.outliers}};
  AddRotation(view, json);
  return json;
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

// A list of `count` rows of `columns` numbers.
Eigen::MatrixXd ReadMatrix(const JsonObject& object, const char* key, int count, int columns) {
  const Json& rows = object.Array(key);
  const std::string expected = fmt::format("{} rows of {} numbers", count, columns);
  if (rows.size() != static_cast<size_t>(count)) {
    object.Fail(key, expected, fmt::format("{} rows", rows.size()));
  }
  Eigen::MatrixXd matrix(count, columns);
  for (int i = 0; i < count; ++i) {
    const Json& row = rows[static_cast<size_t>(i)];
    if (!row.is_array() || row.size() != static_cast<size_t>(columns)) {
      object.Fail(key, expected, row.dump().substr(0, 60));
    }
    for (int j = 0; j < columns; ++j) {
      const Json& item = row[static_cast<size_t>(j)];
      if (!item.is_number()) object.Fail(key, "numbers", item.dump().substr(0, 60));
      matrix(i, j) = item.get<double>();
    }
  }
  return matrix;
}

// `all_zero`: what a lens has that was given, not solved for.
Eigen::MatrixXd ReadCovariance(const JsonObject& object, const char* key, int size,
                               bool all_zero = false) {
  Eigen::MatrixXd covariance = ReadMatrix(object, key, size, size);
  if (all_zero) {
    if (!covariance.isZero(0)) object.Fail(key, "zeros, the intrinsics were given");
    return covariance;
  }
  for (int i = 0; i < size; ++i) {
    if (!(covariance(i, i) > 0)) object.Fail(key, "a positive diagonal");
    for (int j = 0; j < i; ++j) {
      const double scale = std::sqrt(covariance(i, i)) * std::sqrt(covariance(j, j));
      if (!(std::abs(covariance(i, j) - covariance(j, i)) <= kSymmetric * scale)) {
        object.Fail(key, "a symmetric matrix");
      }
    }
  }
  return covariance;
}

Pose ReadPose(const JsonObject& object, const char* key) {
  const Eigen::MatrixXd matrix = ReadMatrix(object, key, 3, 4);
  const Eigen::Matrix3d rotation = matrix.leftCols<3>();
  const double off =
      (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(off < kRotation) || !(rotation.determinant() > 0)) object.Fail(key, "a rotation");
  return {Eigen::Quaterniond(rotation).normalized(), matrix.col(3)};
}

CalibratedCamera ReadCamera(const JsonObject& object, const std::string& file, bool lens_given) {
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
  camera.covariance = ReadCovariance(object, "covariance", FreeParameterCount(*model), lens_given);
  if (object.Has("cam_from_rig")) {
    camera.cam_from_rig = ReadPose(object, "cam_from_rig");
    camera.place_covariance = ReadCovariance(object, "place_covariance", 6);
  }
  if (object.Has("delay")) {
    const JsonObject delay = object.Object("delay");
    camera.delay = {delay.Number("frames"), delay.Positive("sigma_frames"),
                    delay.Has("corners_moved") && delay.Value("corners_moved") == Json(true)};
  }
  camera.rms_px = object.Number("rms_px");
  camera.sigma_px = object.Positive("sigma_px");
  return camera;
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

PhotoRotation ReadRotation(const JsonObject& object) {
  constexpr const char* kKey = "photo_rotation_deg";
  if (!object.Has(kKey)) return PhotoRotation::kNone;
  for (const auto rotation : {PhotoRotation::kClockwise, PhotoRotation::kCounterclockwise}) {
    if (object.Value(kKey) == Json(DegreesOf(rotation))) return rotation;
  }
  object.Fail(kKey, "90 or 270");
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
  // Absent: every view by itself.
  view.frame = object.Has("frame") ? object.Unsigned("frame") : calibration.views.size();
  if (view.frame > kLargestFrame) object.Fail("frame", fmt::format("at most {}", kLargestFrame));
  view.cam_from_board = ReadPose(object, "cam_from_board");
  view.seen.corners = ReadCorners(object, calibration.board);
  view.seen.rotation = ReadRotation(object);
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
    object.Fail("board",
                "a board as chessboard:WxH:SQUARE or charuco:WxH:SQUARE:MARKER:DICTIONARY");
  }
}

}  // namespace

void WriteCalibration(const std::filesystem::path& file, const Calibration& calibration) {
  Json json{{"format", kFormat}, {"version", kVersion}, {"board", TextOf(calibration.board)}};
  if (calibration.lenses_given) json["lenses_given"] = true;
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
  const Json json = io::ParseJson(ReadTextFile(file, kLargestCalibrationBytes), where);
  const JsonObject root(json, where, "");
  if (root.String("format") != kFormat) root.Fail("format", fmt::format("\"{}\"", kFormat));
  if (root.PositiveInt("version") != kVersion) root.Fail("version", fmt::format("{}", kVersion));
  Calibration calibration;
  calibration.board = ReadBoard(root);
  const auto each = [&](const char* key, const auto& read) {
    for (size_t i = 0; i < root.Array(key).size(); ++i) read(root.Item(key, i));
  };
  calibration.lenses_given = root.Has("lenses_given") && root.Value("lenses_given") == Json(true);
  each("cameras", [&](const JsonObject& item) {
    calibration.cameras.push_back(ReadCamera(item, where, calibration.lenses_given));
  });
  if (calibration.cameras.empty()) root.Fail("cameras", "at least one camera");
  each("models", [&](const JsonObject& item) { calibration.models.push_back(ReadTried(item)); });
  each("left_out", [&](const JsonObject& item) {
    calibration.left_out.push_back({item.String("name"), item.String("reason")});
  });
  each("views",
       [&](const JsonObject& item) { calibration.views.push_back(ReadView(item, calibration)); });
  return calibration;
}

Json SummaryJson(const Calibration& calibration) {
  Json json{{"board", TextOf(calibration.board)}};
  json["cameras"] = Json::array();
  for (const auto& camera : calibration.cameras) json["cameras"].push_back(CameraJson(camera));
  json["views"] = Json::array();
  RotationCounts rotated;
  for (const auto& view : calibration.views) {
    json["views"].push_back({{"name", view.seen.name},
                             {"camera", view.camera},
                             {"frame", view.frame},
                             {"corners", view.seen.corners.size()},
                             {"rms_px", NumberOrNull(ViewRmsPx(calibration, view))},
                             {"noise_px", NumberOrNull(view.seen.noise_px)},
                             {"outliers", view.outliers}});
    AddRotation(view, json["views"].back());
    rotated.Add(view.seen.rotation);
  }
  json["rotated_photos"] = {{"clockwise", rotated.clockwise},
                            {"counterclockwise", rotated.counterclockwise}};
  json["models"] = ModelsJson(calibration.models);
  json["left_out"] = LeftOutJson(calibration.left_out);
  return json;
}

}  // namespace dtr::calib
