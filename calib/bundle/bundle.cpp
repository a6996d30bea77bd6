#include "calib/bundle/bundle.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>

#include "calib/bundle/adjust.h"
#include "calib/lens_groups.h"
#include "dtr/base/error.h"

namespace dtr::calib {
namespace {

// Observations of the points that at least two images see, sorted; points in the order of their
// keys.
struct Track {
  std::vector<std::pair<int, Eigen::Vector2d>> observations;  // image, pixel
};

void AddObservation(Track& track, int image, const Eigen::Vector2d& pixel) {
  const bool again =
      std::any_of(track.observations.begin(), track.observations.end(),
                  [image](const auto& observation) { return observation.first == image; });
  if (!again) track.observations.emplace_back(image, pixel);
}

void AppendPoint(const Eigen::Vector3d& p_in_world, const Track& track, Bundle& bundle) {
  const int point = static_cast<int>(bundle.points.size());
  bundle.points.push_back(p_in_world.homogeneous());
  for (const auto& [image, pixel] : track.observations) {
    bundle.observations.push_back({image, point, pixel});
  }
}

// How far from the middle of the cameras a place may be, in units of their spread, before it is as
// good as at infinity: beyond, its parallax is below any pixel.
constexpr double kAsGoodAsInfinite = 1e7;

double Spread(const Bundle& bundle, Eigen::Vector3d* middle) {
  *middle = Eigen::Vector3d::Zero();
  for (const BundleImage& image : bundle.images) {
    *middle += image.cam_from_world.TargetOriginInSource();
  }
  *middle /= static_cast<double>(bundle.images.size());
  double squared = 0;
  for (const BundleImage& image : bundle.images) {
    squared += (image.cam_from_world.TargetOriginInSource() - *middle).squaredNorm();
  }
  return std::sqrt(squared / static_cast<double>(bundle.images.size()));
}

void AddOwnLenses(const SfmModel& model, Bundle& bundle) {
  for (const SfmImage& image : model.images) {
    bundle.images.push_back(
        {image.name, static_cast<int>(bundle.lenses.size()), image.cam_from_world});
    bundle.lenses.push_back(model.cameras.at(image.camera_id));
  }
}

Eigen::Vector2d PrincipalPoint(const LensCamera& lens) {
  const auto at = static_cast<size_t>(FocalCount(lens.model));
  return {lens.params[at], lens.params[at + 1]};
}

/// Adds images that share a lens where their cameras are of one LensGroup. `camera_of_image`: ids
/// in `cameras`, one per name and pose.
void AddSharedLenses(const std::map<std::uint32_t, LensCamera>& cameras,
                     std::span<const std::uint32_t> camera_of_image,
                     std::span<const std::string> names, std::span<const Pose> cam_from_world,
                     Bundle& bundle) {
  std::map<std::uint32_t, int> lens_of_camera;
  for (const LensGroup& group : LensGroups(cameras)) {
    for (const std::uint32_t id : group.cameras) {
      lens_of_camera[id] = static_cast<int>(bundle.lenses.size());
    }
    bundle.lenses.push_back(group.lens);
  }
  for (size_t i = 0; i < names.size(); ++i) {
    const int lens = lens_of_camera.at(camera_of_image[i]);
    bundle.images.push_back({names[i], lens, cam_from_world[i],
                             PrincipalPoint(cameras.at(camera_of_image[i])) -
                                 PrincipalPoint(bundle.lenses[static_cast<size_t>(lens)])});
  }
}

void AddSharedLenses(const SfmModel& model, Bundle& bundle) {
  std::map<std::uint32_t, LensCamera> used;  // a lens without observations would be undetermined
  std::vector<std::uint32_t> camera_of_image;
  std::vector<std::string> names;
  std::vector<Pose> poses;
  for (const SfmImage& image : model.images) {
    used.emplace(image.camera_id, model.cameras.at(image.camera_id));
    camera_of_image.push_back(image.camera_id);
    names.push_back(image.name);
    poses.push_back(image.cam_from_world);
  }
  AddSharedLenses(used, camera_of_image, names, poses, bundle);
}

/// The image's camera: its lens, with its own principal point.
LensCamera CameraOf(const Bundle& bundle, const BundleImage& image) {
  LensCamera camera = bundle.lenses[static_cast<size_t>(image.lens)];
  const auto at = static_cast<size_t>(FocalCount(camera.model));
  camera.params[at] += image.shift_px.x();
  camera.params[at + 1] += image.shift_px.y();
  return camera;
}

}  // namespace

Bundle BundleOf(const SfmModel& model, bool separate_lenses) {
  Bundle bundle;
  std::map<std::uint64_t, Track> tracks;
  if (separate_lenses) {
    AddOwnLenses(model, bundle);
  } else {
    AddSharedLenses(model, bundle);
  }
  for (size_t i = 0; i < model.images.size(); ++i) {
    const SfmImage& image = model.images[i];
    for (const SfmFeature& feature : image.features) {
      if (feature.point_id == SfmFeature::kNoPoint) continue;
      AddObservation(tracks[feature.point_id], static_cast<int>(i), feature.pixel);
    }
  }
  for (const auto& [id, track] : tracks) {
    if (track.observations.size() < 2) continue;
    bundle.point_ids.push_back(id);
    AppendPoint(model.points.at(id).p_in_world, track, bundle);
  }
  return bundle;
}

Bundle BundleOf(std::span<const PinholeCamera> cameras, std::span<const Pose> cam_from_world,
                std::span<const std::string> names, const SparseScene& scene) {
  Bundle bundle;
  std::map<std::vector<double>, std::uint32_t> id_of;
  std::map<std::uint32_t, LensCamera> distinct;
  std::vector<std::uint32_t> camera_of_image;
  for (const PinholeCamera& c : cameras) {
    const LensCamera lens{CameraModel::kPinhole,
                          c.width_px(),
                          c.height_px(),
                          {c.fx_px(), c.fy_px(), c.cx_px(), c.cy_px()}};
    std::vector<double> key = lens.params;
    key.push_back(c.width_px());
    key.push_back(c.height_px());
    const auto id = static_cast<std::uint32_t>(distinct.size());
    camera_of_image.push_back(id_of.try_emplace(std::move(key), id).first->second);
    distinct.emplace(camera_of_image.back(), lens);
  }
  AddSharedLenses(distinct, camera_of_image, names, cam_from_world, bundle);
  std::vector<Track> tracks(scene.points.size());
  for (const SparseObservation& o : scene.observations) {
    AddObservation(tracks.at(static_cast<size_t>(o.point)), o.view, o.pixel);
  }
  for (size_t p = 0; p < tracks.size(); ++p) {
    if (tracks[p].observations.size() >= 2) {
      AppendPoint(scene.points[p].p_in_world, tracks[p], bundle);
    }
  }
  return bundle;
}

namespace {

// Observations of points they do not belong to, as structure from motion leaves them out, too
// (COLMAP: more than 4 px).
struct Wrong {
  std::set<std::pair<int, std::uint64_t>> of_images;  ///< image, point id
  std::map<std::uint64_t, int> right_of_point;        ///< observations that stay
};

Wrong WrongObservations(const Bundle& bundle) {
  constexpr double kMaxPx = 4;
  Wrong wrong;
  const auto residuals = Residuals(bundle);
  for (size_t i = 0; i < residuals.size(); ++i) {
    const BundleObservation& o = bundle.observations[i];
    const auto id = bundle.point_ids[static_cast<size_t>(o.point)];
    if (residuals[i].norm() <= kMaxPx) {
      ++wrong.right_of_point[id];
    } else {
      wrong.of_images.insert({o.image, id});  // NaN, too: no pixel
    }
  }
  return wrong;
}

// Gives the model the bundle's cameras. Images that shared a camera, but have shifts, get one each,
// with ids above all others; what they shared stays as their lens, under its id, though no image
// uses it: the database that the model came from knows the lens by it.
void TakeCameras(const Bundle& bundle, bool separate_lenses, SfmModel& model) {
  const std::uint32_t first_own =
      model.cameras.empty() || separate_lenses ? 1 : model.cameras.rbegin()->first + 1;
  std::map<std::uint32_t, int> users;
  std::vector<bool> shifted(bundle.lenses.size());
  for (size_t i = 0; i < bundle.images.size(); ++i) {
    ++users[model.images[i].camera_id];
    const auto lens = static_cast<size_t>(bundle.images[i].lens);
    shifted[lens] = shifted[lens] || !bundle.images[i].shift_px.isZero(0);
  }
  model.cameras.clear();
  for (size_t i = 0; i < bundle.images.size(); ++i) {
    const BundleImage& of = bundle.images[i];
    const auto lens = static_cast<size_t>(of.lens);
    std::uint32_t& id = model.images[i].camera_id;
    if (separate_lenses || (shifted[lens] && users.at(id) > 1)) {
      if (!separate_lenses) model.cameras[id] = bundle.lenses[lens];
      id = first_own + static_cast<std::uint32_t>(i);
    }
    model.cameras[id] = CameraOf(bundle, of);
  }
}

}  // namespace

SfmModel ModelOf(const Bundle& bundle, const SfmModel& model, bool separate_lenses, int* dropped) {
  SfmModel out = model;
  TakeCameras(bundle, separate_lenses, out);
  for (size_t i = 0; i < bundle.images.size(); ++i) {
    out.images[i].cam_from_world = bundle.images[i].cam_from_world;
  }
  Eigen::Vector3d middle;
  const double reach = kAsGoodAsInfinite * Spread(bundle, &middle);
  std::map<std::uint64_t, SfmPoint> points;
  for (size_t p = 0; p < bundle.points.size(); ++p) {
    const Eigen::Vector4d& h = bundle.points[p];
    const Eigen::Vector3d place = h.head<3>() / h[3];
    if (!(h[3] > 0) || !place.allFinite() || !((place - middle).norm() <= reach)) continue;
    SfmPoint point = model.points.at(bundle.point_ids[p]);
    point.p_in_world = place;
    points.emplace(bundle.point_ids[p], point);
  }
  const auto wrong = WrongObservations(bundle);
  for (auto at = points.begin(); at != points.end();) {
    const auto found = wrong.right_of_point.find(at->first);
    const bool placed = found != wrong.right_of_point.end() && found->second >= 2;
    at = placed ? std::next(at) : points.erase(at);
  }
  if (dropped != nullptr) *dropped = static_cast<int>(model.points.size() - points.size());
  out.points = std::move(points);
  for (size_t i = 0; i < out.images.size(); ++i) {
    for (SfmFeature& feature : out.images[i].features) {
      if (!out.points.contains(feature.point_id) ||
          wrong.of_images.contains({static_cast<int>(i), feature.point_id})) {
        feature.point_id = SfmFeature::kNoPoint;
      }
    }
  }
  return out;
}

void CheckBundle(const Bundle& bundle) {
  const auto reject = [](const std::string& what) { throw Error("bundle adjustment: " + what); };
  if (bundle.images.size() < 2) {
    reject(fmt::format("expected at least 2 images, found {}", bundle.images.size()));
  }
  if (bundle.observations.empty()) reject("expected points that two images see, found none");
  for (const LensCamera& lens : bundle.lenses) {
    try {
      lens.Check();
    } catch (const std::invalid_argument& error) {
      reject(error.what());
    }
    if (!IsAdjustable(lens.model)) {
      reject("expected intrinsics model other than " + NameOf(lens.model) +
             "; undistort the images first");
    }
  }
  const auto lenses = static_cast<int>(bundle.lenses.size());
  for (const BundleImage& image : bundle.images) {
    if (image.lens < 0 || image.lens >= lenses) {
      reject(fmt::format("{}: expected intrinsics 0 to {}, found {}", image.name, lenses - 1,
                         image.lens));
    }
    if (!image.shift_px.allFinite() || !image.cam_from_world.rotation.coeffs().allFinite() ||
        !image.cam_from_world.translation.allFinite()) {
      reject(image.name + ": expected a finite pose and principal point");
    }
  }
  for (size_t p = 0; p < bundle.points.size(); ++p) {
    if (!bundle.points[p].allFinite() || bundle.points[p].isZero()) {
      reject(fmt::format("point {}: expected a finite position or direction", p));
    }
  }
  const auto images = static_cast<int>(bundle.images.size());
  const auto points = static_cast<int>(bundle.points.size());
  for (const BundleObservation& o : bundle.observations) {
    if (o.image < 0 || o.image >= images || o.point < 0 || o.point >= points ||
        !o.pixel.allFinite()) {
      reject(
          fmt::format("expected observations of images 0 to {} and points 0 to {} at finite "
                      "pixels, found image {}, point {}",
                      images - 1, points - 1, o.image, o.point));
    }
  }
}

}  // namespace dtr::calib
