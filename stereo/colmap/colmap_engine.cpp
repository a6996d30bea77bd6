#include "stereo/colmap/colmap_engine.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "calib/colmap/dense.h"
#include "dtr/base/order_statistics.h"
#include "dtr/base/size_text.h"

namespace dtr::stereo {
namespace {

namespace fs = std::filesystem;

/// How far cameras may differ: what writing them as text and reading them again can cost, and far
/// below what a depth could show.
constexpr double kCameraTolerancePx = 0.05;
/// The same for centres, as a share of the distance to the nearest other camera.
constexpr double kCentreTolerance = 1e-3;
/// Standard deviation of a match, pixels of disparity.
constexpr double kMatchSigmaPx = 0.5;

std::string Stem(const std::string& name) { return fs::path(name).replace_extension().string(); }

/// Images by the name of a view: the same, or the same but for the extension.
class ByName {
 public:
  explicit ByName(const std::vector<colmap::DenseImage>& images) {
    for (const colmap::DenseImage& image : images) {
      whole_[image.name] = &image;
      const auto [entry, first] = stems_.emplace(Stem(image.name), &image);
      if (!first) entry->second = nullptr;
    }
  }
  const colmap::DenseImage* Find(const std::string& name) const {
    if (const auto found = whole_.find(name); found != whole_.end()) return found->second;
    const auto found = stems_.find(Stem(name));
    return found != stems_.end() ? found->second : nullptr;
  }

 private:
  std::map<std::string, const colmap::DenseImage*> whole_, stems_;
};

/// Distance to the nearest other camera that is elsewhere.
double NearestCamera(std::span<const StereoView> views, size_t index) {
  double nearest = std::numeric_limits<double>::infinity();
  const Eigen::Vector3d centre = views[index].cam_from_world.TargetOriginInSource();
  for (size_t i = 0; i < views.size(); ++i) {
    if (i == index) continue;
    const double distance = (views[i].cam_from_world.TargetOriginInSource() - centre).norm();
    if (distance > 0) nearest = std::min(nearest, distance);
  }
  return nearest;
}

/// What keeps the image from being the view's; empty when it is.
std::string Difference(const StereoView& view, const colmap::DenseImage& image,
                       const Eigen::Vector3d& world_origin, double nearest_camera) {
  const PinholeCamera& a = view.camera;
  const PinholeCamera& b = image.camera;
  if (a.width_px() != b.width_px() || a.height_px() != b.height_px()) {
    return "an image of " + SizeText(a.width_px(), a.height_px()) + ", found " +
           SizeText(b.width_px(), b.height_px());
  }
  const double off_px =
      std::max({std::abs(a.fx_px() - b.fx_px()), std::abs(a.fy_px() - b.fy_px()),
                std::abs(a.cx_px() - b.cx_px()), std::abs(a.cy_px() - b.cy_px())});
  if (!(off_px <= kCameraTolerancePx)) {
    return "its focal lengths and principal point, found " + std::to_string(off_px) +
           " px of difference";
  }
  const double turned_px =
      a.fx_px() * view.cam_from_world.rotation.angularDistance(image.cam_from_world.rotation);
  if (!(turned_px <= kCameraTolerancePx)) {
    return "its rotation, found " + std::to_string(turned_px) + " px of difference";
  }
  const double moved = (view.cam_from_world.TargetOriginInSource() + world_origin -
                        image.cam_from_world.TargetOriginInSource())
                           .norm();
  if (!(moved <= kCentreTolerance * nearest_camera)) {
    return "its centre, found " + std::to_string(100 * moved / nearest_camera) +
           " % of the distance to the next camera away";
  }
  return {};
}

double MedianBaseline(std::span<const StereoView> views, int reference,
                      std::span<const int> neighbours) {
  std::vector<double> baselines;
  const auto centre = [&](int view) {
    return views[static_cast<size_t>(view)].cam_from_world.TargetOriginInSource();
  };
  for (const int n : neighbours) baselines.push_back((centre(n) - centre(reference)).norm());
  return UpperMedian(baselines);
}

}  // namespace

ColmapEngine::ColmapEngine(const fs::path& workspace, std::span<const std::string> names,
                           std::span<const StereoView> views, const Eigen::Vector3d& world_origin) {
  const std::vector<colmap::DenseImage> images = colmap::ReadDenseWorkspace(workspace);
  const ByName by_name(images);
  for (size_t i = 0; i < views.size(); ++i) {
    const colmap::DenseImage* image = by_name.Find(names[i]);
    const std::string difference =
        image == nullptr ? "an image of this name, found none"
                         : Difference(views[i], *image, world_origin, NearestCamera(views, i));
    if (!difference.empty()) {
      throw Error(workspace.string() + ": view " + names[i] + ": expected " + difference +
                  "; make the workspace from this set (dtr export `format` colmap)");
    }
    maps_.push_back(image->depth_map);
    if (!image->depth_map.empty() && !image->geometric) ++photometric_maps_;
  }
}

DepthEstimate ColmapEngine::Estimate(std::span<const StereoView> views, int reference,
                                     std::span<const int> neighbours, const DepthRange&,
                                     const EngineOptions&) const {
  const StereoView& view = views[static_cast<size_t>(reference)];
  const fs::path& file = maps_.at(static_cast<size_t>(reference));
  const std::string who = "view " + std::to_string(reference);
  if (file.empty()) throw NoUsablePair(who + ": the workspace has no depth map of it");
  if (neighbours.empty()) throw NoUsablePair(who + ": no neighbours");
  const int w = view.camera.width_px(), h = view.camera.height_px();
  DepthEstimate estimate{colmap::ReadDenseDepth(file, w, h), Grid<float>(w, h)};
  const double baseline = MedianBaseline(views, reference, neighbours);
  if (!(baseline > 0)) throw NoUsablePair(who + ": its neighbours stand where it does");
  const auto sigma = static_cast<float>(kMatchSigmaPx / (view.camera.fx_px() * baseline));
  const bool masked = view.mask != nullptr && !view.mask->empty();
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      float& z = estimate.depth(x, y);
      if (masked && (*view.mask)(x, y) == 0) z = 0;
      if (!DepthImage::IsHole(z)) estimate.inverse_depth_sigma(x, y) = sigma;
    }
  }
  return estimate;
}

}  // namespace dtr::stereo
