#include "pipeline/core/set_rig.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/files/calibration.h"
#include "calib/files/rig_files.h"
#include "dtr/base/error.h"
#include "dtr/io/json_fields.h"
#include "dtr/types/panorama.h"
#include "pipeline/core/photos/rig_names.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;
using io::Json;

// The set's poses are the rig's to rounding when it is built; features are not found to better.
constexpr double kMaxPlacesPx = 0.1;
constexpr char kProvenance[] = "provenance";
constexpr char kPanoramas[] = "panoramas";  // in place of a rig's file

std::string ListedPhotos(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return list;
}

// Index of the rig's camera called so; empty for others.
std::optional<size_t> CameraCalled(const SetRig& rig, const std::string& name) {
  const auto found = std::find(rig.names.begin(), rig.names.end(), name);
  if (found == rig.names.end()) return std::nullopt;
  return static_cast<size_t>(found - rig.names.begin());
}

std::optional<calib::RigPhoto> PhotoOf(const SetRig& rig, const std::string& name) {
  const auto named = RigNameOf(name);
  const auto camera = named ? CameraCalled(rig, named->camera) : std::nullopt;
  if (!camera) return std::nullopt;
  return calib::RigPhoto{*camera, named->frame};
}

bool StandApart(const SetRig& rig, size_t a, size_t b) {
  const auto& places = rig.known.cam_from_rig;
  return places[a].TargetOriginInSource() != places[b].TargetOriginInSource();
}

void RequireSharedTimeStep(const SetRig& rig,
                           const std::map<std::string, calib::RigPhoto>& photos) {
  if (calib::HasOneCentre(rig.known)) return;
  std::map<std::string, size_t> first_of;
  for (const auto& [name, photo] : photos) {
    const size_t first = first_of.emplace(photo.frame, photo.camera).first->second;
    if (StandApart(rig, first, photo.camera)) return;
  }
  throw Error(fmt::format(
      "`rig` {}: expected photos taken at one time from two cameras that stand apart, found none; "
      "photos taken at one time have equal names or numbers, as left/0001.jpg and right/0001.jpg",
      rig.file));
}

Pose PoseFrom(const io::JsonObject& object, const char* key) {
  const Json& rows = object.Array(key);
  Eigen::Matrix<double, 3, 4> matrix;
  if (rows.size() != 3) object.Fail(key, "3 rows of 4 numbers");
  for (size_t i = 0; i < 3; ++i) {
    if (!rows[i].is_array() || rows[i].size() != 4) object.Fail(key, "3 rows of 4 numbers");
    for (size_t j = 0; j < 4; ++j) {
      if (!rows[i][j].is_number()) object.Fail(key, "3 rows of 4 numbers");
      matrix(static_cast<long>(i), static_cast<long>(j)) = rows[i][j].get<double>();
    }
  }
  const Eigen::Matrix3d rotation = matrix.leftCols<3>();
  const bool turns = (rotation.transpose() * rotation).isIdentity(1e-6) && matrix.allFinite() &&
                     rotation.determinant() > 0;
  if (!turns) object.Fail(key, "a rotation and a translation");
  return {Eigen::Quaterniond(rotation).normalized(), matrix.col(3)};
}

// Cameras of `placed` under the ids that their images had before.
void KeepIds(const calib::SfmModel& before, calib::SfmModel& placed) {
  std::map<std::string, std::uint32_t> id_of;
  for (const calib::SfmImage& image : before.images) id_of[image.name] = image.camera_id;
  std::map<std::uint32_t, calib::LensCamera> cameras;
  for (calib::SfmImage& image : placed.images) {
    const std::uint32_t id = id_of.at(image.name);
    cameras[id] = placed.cameras.at(image.camera_id);
    image.camera_id = id;
  }
  placed.cameras = std::move(cameras);
}

// How far a view's points move, RMS, when it stands at `cam_from_world` instead.
double MovedPx(const View& view, const Pose& cam_from_world, const SparseScene& sparse,
               const std::vector<int>& seen) {
  double squares = 0;
  for (const int i : seen) {
    const auto& point = sparse.points[static_cast<size_t>(i)].p_in_world;
    const auto from = view.camera.PixelFromCam(view.cam_from_world * point);
    const auto to = view.camera.PixelFromCam(cam_from_world * point);
    if (!from) continue;
    squares += to ? (*to - *from).squaredNorm() : std::numeric_limits<double>::infinity();
  }
  return std::sqrt(squares / static_cast<double>(seen.size()));
}

void RequireRig(const fs::path& file, size_t cameras) {
  if (cameras >= 2) return;
  throw Error(fmt::format(
      "`rig` {}: expected a rig of 2 cameras or more, found 1; one camera alone is for dtr "
      "calibrate photos `lens`",
      file.string()));
}

// Of another program, which has no board and no views.
SetRig ForeignRig(const fs::path& file) {
  const calib::CameraFile cameras = calib::ReadCamerasOf(file);
  RequireRig(file, cameras.cameras.size());
  SetRig rig;
  rig.file = file.filename().string();
  rig.unit = cameras.metric ? LengthUnit::kMetre : LengthUnit::kUnknown;
  for (const calib::FiledCamera& camera : cameras.cameras) {
    rig.names.push_back(camera.name);
    rig.known.lenses.push_back(camera.camera);
    rig.known.cam_from_rig.push_back(camera.cam_from_rig);
  }
  return rig;
}

}  // namespace

std::optional<SetRig> RigOfPanoramas(const capture::Capture& capture) {
  const capture::Photo *view = nullptr, *other = nullptr;
  SetRig rig;
  rig.file = kPanoramas;
  rig.unit = LengthUnit::kArbitrary;
  for (const capture::Photo& photo : capture.photos) {
    if (!photo.face || (view != nullptr && photo.width_px != view->width_px)) other = &photo;
    if (!photo.face) continue;
    if (view == nullptr) view = &photo;
    if (CameraCalled(rig, photo.face->face)) continue;
    rig.names.push_back(photo.face->face);
    const int size_px = photo.width_px;
    rig.known.lenses.push_back({calib::CameraModel::kSimplePinhole,
                                size_px,
                                size_px,
                                {size_px / 2.0, size_px / 2.0, size_px / 2.0}});
    rig.known.cam_from_rig.push_back(
        {Eigen::Quaterniond(FaceCalled(photo.face->face).cam_from_panorama).normalized(),
         Eigen::Vector3d::Zero()});
  }
  if (view == nullptr) return std::nullopt;
  if (other != nullptr) {
    throw Error(
        fmt::format("{} is a view of {} x {} px of a panorama, {} is none; give a capture of "
                    "panoramas alone, as dtr capture makes it",
                    view->name, view->width_px, view->height_px, other->name));
  }
  return rig;
}

SetRig ReadSetRig(const fs::path& file) {
  const std::string extension = file.extension().string();
  const bool foreign = extension == ".yml" || extension == ".yaml" || extension == ".xml";
  if (!fs::is_regular_file(file) || (extension != ".json" && !foreign)) {
    throw UsageError(fmt::format(
        "`rig` {}: expected a .json of dtr calibrate rig, a camera chain of Kalibr (.yaml) or a "
        "stereo pair of OpenCV (.yml), found {}",
        file.string(), fs::exists(file) ? "something else" : "nothing"));
  }
  if (foreign) return ForeignRig(file);
  const calib::Calibration calibration = calib::ReadCalibration(file);
  RequireRig(file, calibration.cameras.size());
  SetRig rig;
  rig.file = file.filename().string();
  rig.unit = calibration.board.metric ? LengthUnit::kMetre : LengthUnit::kUnknown;
  for (const calib::CalibratedCamera& camera : calibration.cameras) {
    rig.names.push_back(camera.name);
    rig.known.lenses.push_back(camera.camera);
    rig.known.cam_from_rig.push_back(camera.cam_from_rig);
  }
  return rig;
}

std::map<std::string, calib::RigPhoto> PhotosOfRig(const SetRig& rig,
                                                   const capture::Capture& capture) {
  std::map<std::string, calib::RigPhoto> photos;
  for (const capture::Photo& photo : capture.photos) {
    const auto found = PhotoOf(rig, photo.name);
    if (!found) {
      throw Error(fmt::format(
          "`rig` {}: photo {}: expected one of the cameras {}: CAMERA/NAME or CAMERA and a "
          "number; take it out or name it by its camera",
          rig.file, photo.name, ListedPhotos(rig.names)));
    }
    const calib::LensCamera& lens = rig.known.lenses[found->camera];
    if (lens.width_px != photo.width_px || lens.height_px != photo.height_px) {
      throw Error(fmt::format(
          "`rig` {}: photo {}: expected {} x {} px as camera {} was calibrated with, found {} x {}",
          rig.file, photo.name, lens.width_px, lens.height_px, rig.names[found->camera],
          photo.width_px, photo.height_px));
    }
    photos.emplace(photo.name, *found);
  }
  RequireSharedTimeStep(rig, photos);
  return photos;
}

void TellPhotosTheirLens(const SetRig& rig, capture::Capture& capture) {
  for (capture::Photo& photo : capture.photos) {
    const auto found = PhotoOf(rig, photo.name);
    if (!found) continue;
    photo.camera_group = "rig " + rig.names[found->camera];
    photo.focal_prior_px = rig.known.lenses[found->camera].params.front();
    photo.focal_source = "rig";
  }
}

calib::RigReport PlaceByRig(const SetRig& rig, const capture::Capture& capture,
                            calib::SfmModel& model, const Progress& progress) {
  calib::RigRefined refined =
      calib::RefineRig(model, rig.known, PhotosOfRig(rig, capture), &progress);
  KeepIds(model, refined.model);
  model = std::move(refined.model);
  return refined;
}

std::optional<SetRig> RigOfSet(const DtrSet& set) {
  const Json provenance = io::ParseJson(set.provenance_json, kProvenance);
  if (!provenance.is_object() || !provenance.contains("calibration")) return std::nullopt;
  const Json& calibration = provenance["calibration"];
  if (!calibration.is_object() || !calibration.contains("rig")) return std::nullopt;
  const io::JsonObject object(calibration["rig"], kProvenance, "calibration.rig");
  SetRig rig;
  rig.file = object.String("file");
  rig.unit = object.String("unit") == NameOf(LengthUnit::kMetre) ? LengthUnit::kMetre
                                                                 : LengthUnit::kUnknown;
  for (size_t i = 0; i < object.Array("cameras").size(); ++i) {
    const io::JsonObject camera = object.Item("cameras", i);
    rig.names.push_back(camera.String("name"));
    rig.known.cam_from_rig.push_back(PoseFrom(camera, "cam_from_rig"));
  }
  return rig;
}

std::optional<Check> RigPlaces(const DtrSet& set, const SparseScene& sparse, const SetRig& rig) {
  const std::vector<View>& views = set.frames.front().views;
  std::vector<std::vector<int>> seen(views.size());
  for (const SparseObservation& o : sparse.observations) {
    seen[static_cast<size_t>(o.view)].push_back(o.point);
  }
  std::map<std::string, std::pair<size_t, size_t>> first_of;  // time step -> view, camera
  Check check{"rig_places_px", std::numeric_limits<double>::quiet_NaN(), kMaxPlacesPx, false, ""};
  std::string worst;
  int pairs = 0;
  for (size_t i = 0; i < views.size(); ++i) {
    const auto photo = PhotoOf(rig, views[i].name);
    if (!photo || seen[i].empty()) continue;
    const auto [entry, fresh] =
        first_of.emplace(photo->frame, std::pair<size_t, size_t>(i, photo->camera));
    if (fresh) continue;
    const auto [first, camera] = entry->second;
    const auto& places = rig.known.cam_from_rig;
    const Pose expected =
        places[photo->camera] * (places[camera].Inverse() * views[first].cam_from_world);
    const double moved = MovedPx(views[i], expected, sparse, seen[i]);
    ++pairs;
    if (moved <= check.value) continue;  // false while there is none yet
    check.value = moved;
    worst = fmt::format("{} beside {}", views[i].name, views[first].name);
  }
  if (pairs == 0) return std::nullopt;
  check.passed = check.value <= check.limit;
  check.reason = fmt::format("{} views compared with {}; the farthest from its position is {}",
                             pairs, rig.file, worst);
  return check;
}

}  // namespace dtr::pipeline
