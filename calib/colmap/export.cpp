#include "calib/colmap/export.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "dtr/base/error.h"

namespace dtr::colmap {
namespace {

struct PointSums {
  Eigen::Vector3d rgb = Eigen::Vector3d::Zero();
  int coloured = 0;
  double error_px = 0;
  int measured = 0;
};

std::uint32_t CameraIdOf(calib::SfmModel& model, std::vector<PinholeCamera>& known,
                         const PinholeCamera& camera) {
  const auto same = std::find(known.begin(), known.end(), camera);
  const auto id = static_cast<std::uint32_t>(same - known.begin() + 1);
  if (same == known.end()) {
    known.push_back(camera);
    model.cameras[id] = FromPinhole(camera);
  }
  return id;
}

void AddObservation(const View& view, const SparsePoint& point, const Eigen::Vector2d& pixel,
                    PointSums& sums) {
  if (const auto seen = view.camera.PixelFromCam(view.cam_from_world * point.p_in_world)) {
    sums.error_px += (*seen - pixel).norm();
    ++sums.measured;
  }
}

void AddColours(const View& view, const ImageRgb8& image,
                const std::vector<const SparseObservation*>& seen, std::vector<PointSums>& sums) {
  for (const SparseObservation* one : seen) {
    if (!view.camera.Contains(one->pixel)) continue;
    const int x = static_cast<int>(one->pixel.x()), y = static_cast<int>(one->pixel.y());
    PointSums& sum = sums[static_cast<size_t>(one->point)];
    for (int c = 0; c < 3; ++c) sum.rgb[c] += image(x, y, c);
    ++sum.coloured;
  }
}

calib::SfmPoint PointFrom(const SparsePoint& point, const PointSums& sums,
                          const Eigen::Vector3d& world_origin) {
  calib::SfmPoint out;
  out.p_in_world = point.p_in_world + world_origin;
  for (size_t c = 0; c < 3 && sums.coloured > 0; ++c) {
    out.rgb[c] = static_cast<std::uint8_t>(
        std::lround(sums.rgb[static_cast<Eigen::Index>(c)] / sums.coloured));
  }
  if (sums.measured > 0) out.error_px = sums.error_px / sums.measured;
  return out;
}

}  // namespace

calib::LensCamera FromPinhole(const PinholeCamera& camera) {
  return {calib::CameraModel::kPinhole,
          camera.width_px(),
          camera.height_px(),
          {camera.fx_px(), camera.fy_px(), camera.cx_px(), camera.cy_px()}};
}

calib::SfmModel ModelFromViews(const DtrSet& set, const SparseScene& scene,
                               const std::function<ImageRgb8(const View&)>& image_of) {
  if (set.frames.size() != 1) {
    throw Error("export to COLMAP: expected a set with one frame, found " +
                std::to_string(set.frames.size()) + "; a COLMAP model shows one time step");
  }
  const auto& views = set.frames.front().views;
  calib::SfmModel model;
  std::vector<PinholeCamera> cameras;
  std::set<std::string> names;
  for (const View& view : views) {
    if (!names.insert(view.name).second) {
      throw Error(view.name +
                  ": expected a unique name, found it twice; COLMAP distinguishes images "
                  "by their names");
    }
    calib::SfmImage& image = model.images.emplace_back();
    image.id = static_cast<std::uint32_t>(model.images.size());
    image.name = view.name;
    image.camera_id = CameraIdOf(model, cameras, view.camera);
    // Stored poses act on p_world - world_origin.
    image.cam_from_world = view.cam_from_world;
    image.cam_from_world.translation -= view.cam_from_world.rotation * set.world_origin;
  }
  std::vector<PointSums> sums(scene.points.size());
  std::vector<std::vector<const SparseObservation*>> seen_by(views.size());
  for (const SparseObservation& seen : scene.observations) {
    if (seen.view < 0 || static_cast<size_t>(seen.view) >= views.size() || seen.point < 0 ||
        static_cast<size_t>(seen.point) >= scene.points.size()) {
      throw std::invalid_argument("ModelFromViews: an observation of a view or point not there");
    }
    const auto view = static_cast<size_t>(seen.view), point = static_cast<size_t>(seen.point);
    model.images[view].features.push_back({seen.pixel, point + 1});
    AddObservation(views[view], scene.points[point], seen.pixel, sums[point]);
    seen_by[view].push_back(&seen);
  }
  for (size_t i = 0; image_of && i < views.size(); ++i) {
    AddColours(views[i], image_of(views[i]), seen_by[i], sums);
  }
  for (size_t i = 0; i < scene.points.size(); ++i) {
    model.points[i + 1] = PointFrom(scene.points[i], sums[i], set.world_origin);
  }
  std::sort(model.images.begin(), model.images.end(),
            [](const auto& a, const auto& b) { return a.name < b.name; });
  return model;
}

}  // namespace dtr::colmap
