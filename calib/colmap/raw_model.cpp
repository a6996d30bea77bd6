#include "calib/colmap/raw_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_map>

#include "dtr/base/error.h"
#include "dtr/base/file_names.h"

namespace dtr::colmap {
namespace {

constexpr int kEquirectangular = 17;                 // of COLMAP
constexpr std::uint64_t kLongestSidePx = 1'000'000;  // no photo is larger; keeps int products sane
// A quaternion this close to unit length is kept bit for bit, so that a model written by us reads
// back equal; others are normalised, as COLMAP does. Ten times the rounding of a normalisation.
constexpr double kUnitLength = 1e-14;
constexpr double kShortestQuaternion = 1e-3;  // below, the rotation is noise (COLMAP writes 1)

[[noreturn]] void Reject(const std::string& where, const std::string& what) {
  throw Error(where + ": " + what);
}

void AddCameras(const RawModel& raw, calib::SfmModel& model) {
  for (const auto& camera : raw.cameras) {
    if (!model.cameras.emplace(camera.id, camera.camera).second) {
      Reject(raw.cameras_file.string(),
             fmt::format("camera {}: expected one, found it twice", camera.id));
    }
  }
}

void AddPoints(const RawModel& raw, calib::SfmModel& model) {
  for (const auto& point : raw.points) {
    if (point.id == calib::SfmFeature::kNoPoint ||
        !model.points.emplace(point.id, point.point).second) {
      Reject(raw.points_file.string(),
             fmt::format("point {}: expected a unique id, found it twice", point.id));
    }
  }
}

void CheckImages(const RawModel& raw, const calib::SfmModel& model) {
  std::set<std::uint32_t> ids;
  std::set<std::string> names;
  for (const calib::SfmImage& image : raw.images) {
    const auto where = fmt::format("{}: image {}", raw.images_file.string(), image.id);
    if (!ids.insert(image.id).second) Reject(where, "expected a unique id, found it twice");
    RequireSafeName(image.name, where + ": its name");  // it is put behind folders of photos
    if (!names.insert(image.name).second) {
      Reject(where, fmt::format("expected a unique name, found '{}' twice", image.name));
    }
    if (!model.cameras.contains(image.camera_id)) {
      Reject(where, fmt::format("expected a camera of {}, found the absent id {}",
                                raw.cameras_file.filename().string(), image.camera_id));
    }
    for (size_t i = 0; i < image.features.size(); ++i) {
      const auto id = image.features[i].point_id;
      if (id != calib::SfmFeature::kNoPoint && !model.points.contains(id)) {
        Reject(where, fmt::format("feature {}: expected a point of {}, found the absent id {}", i,
                                  raw.points_file.filename().string(), id));
      }
    }
  }
}

// Tracks and features say the same thing twice. They must agree: a file cut between two images
// would otherwise pass for a smaller model.
void CheckTracks(const RawModel& raw) {
  std::unordered_map<std::uint32_t, const calib::SfmImage*> images;
  size_t seen_by_features = 0;
  for (const calib::SfmImage& image : raw.images) {
    images.emplace(image.id, &image);
    seen_by_features += static_cast<size_t>(
        std::count_if(image.features.begin(), image.features.end(),
                      [](const auto& f) { return f.point_id != calib::SfmFeature::kNoPoint; }));
  }
  std::set<std::pair<std::uint32_t, std::uint32_t>> seen_by_tracks;
  for (const auto& point : raw.points) {
    for (const RawTrackElement& element : point.track) {
      const auto image = images.find(element.image_id);
      if (image == images.end() || element.feature >= image->second->features.size() ||
          image->second->features[element.feature].point_id != point.id ||
          !seen_by_tracks.emplace(element.image_id, element.feature).second) {
        Reject(fmt::format("{}: point {}", raw.points_file.string(), point.id),
               fmt::format("its track names feature {} of image {}, which {} does not confirm; the "
                           "files do not belong together or one is cut short",
                           element.feature, element.image_id, raw.images_file.filename().string()));
      }
    }
  }
  if (seen_by_tracks.size() != seen_by_features) {
    Reject(
        raw.points_file.string(),
        fmt::format("expected tracks of {} features in all, as {} says, found {}", seen_by_features,
                    raw.images_file.filename().string(), seen_by_tracks.size()));
  }
}

}  // namespace

calib::CameraModel CheckedCameraModel(const std::string& where, int model_id) {
  const auto model = calib::CameraModelFromId(model_id);
  if (model) return *model;
  if (model_id == kEquirectangular) RejectEquirectangular(where);
  Reject(where, fmt::format("expected a camera model 0 to 16, found the unknown id {}; undistort "
                            "the images first (colmap image_undistorter)",
                            model_id));
}

void RejectEquirectangular(const std::string& where) {
  Reject(where,
         "the camera model EQUIRECTANGULAR is of whole panoramas and cannot be used; cut "
         "perspective images out of them and calibrate these");
}

calib::LensCamera CheckedCamera(const std::string& where, int model_id, std::uint64_t width_px,
                                std::uint64_t height_px, std::vector<double> params) {
  calib::LensCamera camera;
  camera.model = CheckedCameraModel(where, model_id);
  if (width_px < 1 || width_px > kLongestSidePx || height_px < 1 || height_px > kLongestSidePx) {
    Reject(where, fmt::format("expected an image size of 1 to {} px, found {} x {}", kLongestSidePx,
                              width_px, height_px));
  }
  camera.width_px = static_cast<int>(width_px);
  camera.height_px = static_cast<int>(height_px);
  camera.params = std::move(params);
  try {
    camera.Check();
  } catch (const std::invalid_argument& error) {
    Reject(where, error.what());
  }
  return camera;
}

double CheckedFinite(const std::string& where, double value) {
  if (!std::isfinite(value)) Reject(where, "expected a finite number, found NaN or infinity");
  return value;
}

Pose CheckedPose(const std::string& where, const double wxyz[4], const double translation[3]) {
  Pose cam_from_world;
  cam_from_world.rotation = Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
  cam_from_world.translation << translation[0], translation[1], translation[2];
  CheckedFinite(where, cam_from_world.rotation.coeffs().squaredNorm());
  CheckedFinite(where, cam_from_world.translation.squaredNorm());
  const double length = cam_from_world.rotation.norm();
  if (!(length > kShortestQuaternion)) {
    Reject(where, fmt::format("expected a rotation quaternion of length 1, found {}", length));
  }
  if (std::abs(length - 1) > kUnitLength) cam_from_world.rotation.normalize();
  return cam_from_world;
}

calib::SfmModel Assembled(RawModel raw) {
  calib::SfmModel model;
  AddCameras(raw, model);
  AddPoints(raw, model);
  CheckImages(raw, model);
  CheckTracks(raw);
  model.images = std::move(raw.images);
  std::sort(model.images.begin(), model.images.end(),
            [](const auto& a, const auto& b) { return a.name < b.name; });
  return model;
}

}  // namespace dtr::colmap
