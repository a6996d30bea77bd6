#include "calib/sparse_from_sfm.h"

#include <algorithm>
#include <set>
#include <stdexcept>

#include "calib/lens_map.h"
#include "calib/models/fisheye.h"
#include "calib/undistort.h"
#include "dtr/base/error.h"

namespace dtr::calib {
namespace {

const SfmImage& ImageNamed(const SfmModel& model, const std::string& name) {
  const auto image =
      std::lower_bound(model.images.begin(), model.images.end(), name,
                       [](const SfmImage& a, const std::string& b) { return a.name < b; });
  if (image == model.images.end() || image->name != name) {
    throw Error(name +
                ": expected an image of the structure-from-motion model, found none of this "
                "name; it did not register or belongs to another model");
  }
  return *image;
}

// Far from the axis of a fisheye a pixel of the pinhole view is many of the photo, in which the
// feature was measured; beyond the view's edge by any factor.
bool IsSeen(const Eigen::Vector2d& pixel, const LensCamera& lens, const PinholeCamera& view) {
  return !IsFisheye(lens.model) || (pixel.x() >= 0 && pixel.y() >= 0 &&
                                    pixel.x() <= view.width_px() && pixel.y() <= view.height_px());
}

// Observations of one view, by point id, the first feature of each.
std::map<std::uint64_t, Eigen::Vector2d> ObservationsOf(const SfmImage& image, const LensMap& lens,
                                                        const LensCamera& camera,
                                                        const PinholeCamera& undistorted) {
  std::map<std::uint64_t, Eigen::Vector2d> pixels;
  for (const SfmFeature& feature : image.features) {
    if (feature.point_id == SfmFeature::kNoPoint || pixels.contains(feature.point_id)) continue;
    const auto pixel = UndistortedPixel(lens, undistorted, feature.pixel);
    if (pixel && IsSeen(*pixel, camera, undistorted)) {
      pixels.emplace(feature.point_id, *pixel);
    }
  }
  return pixels;
}

}  // namespace

SparseScene ToSparseScene(const SfmModel& model, std::span<const std::string> view_names,
                          std::span<const PinholeCamera> undistorted,
                          const Eigen::Vector3d& world_origin) {
  if (view_names.size() != undistorted.size()) {
    throw std::invalid_argument("ToSparseScene: one camera per view name is needed");
  }
  std::map<std::uint32_t, LensMap> lenses;
  std::set<std::string> listed;
  std::vector<std::map<std::uint64_t, Eigen::Vector2d>> seen;
  std::map<std::uint64_t, int> views_of_point;
  for (size_t view = 0; view < view_names.size(); ++view) {
    if (!listed.insert(view_names[view]).second) {
      throw Error(view_names[view] + ": expected every view once, found it twice");
    }
    const SfmImage& image = ImageNamed(model, view_names[view]);
    const auto lens = lenses.try_emplace(image.camera_id, model.cameras.at(image.camera_id)).first;
    seen.push_back(
        ObservationsOf(image, lens->second, model.cameras.at(image.camera_id), undistorted[view]));
    for (const auto& [id, pixel] : seen.back()) ++views_of_point[id];
  }
  SparseScene scene;
  std::map<std::uint64_t, int> index_of_point;
  for (const auto& [id, views] : views_of_point) {
    if (views < 2) continue;
    index_of_point[id] = static_cast<int>(scene.points.size());
    scene.points.push_back({model.points.at(id).p_in_world - world_origin});
  }
  for (size_t view = 0; view < seen.size(); ++view) {
    for (const auto& [id, pixel] : seen[view]) {
      const auto index = index_of_point.find(id);
      if (index == index_of_point.end()) continue;
      scene.observations.push_back({static_cast<int>(view), index->second, pixel});
    }
  }
  return scene;
}

}  // namespace dtr::calib
