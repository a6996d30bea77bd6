#include "calib/sfm/mapping/adjust_stations.h"

#include <Eigen/Geometry>
#include <map>

#include "calib/bundle/rig_adjust.h"
#include "dtr/base/error.h"

namespace dtr::sfm {
namespace {

Pose CamFromStation(const GraphImage& image) {
  return {Eigen::Quaterniond(image.cam_from_station).normalized(), Eigen::Vector3d::Zero()};
}

}  // namespace

bool AdjustStations(const ViewGraph& graph, const std::vector<int>& nodes,
                    const std::vector<int>& image_of, const AdjustMapOptions& options,
                    calib::Bundle* bundle) {
  std::map<int, int> frame_of;  // by node
  std::vector<calib::RigImage> images;
  std::vector<Pose> rig_from_world;
  for (size_t i = 0; i < image_of.size(); ++i) {
    const auto image = static_cast<size_t>(image_of[i]);
    const Pose cam_from_rig =
        graph.images[image].station < 0 ? Pose{} : CamFromStation(graph.images[image]);
    const auto [frame, fresh] =
        frame_of.emplace(nodes[image], static_cast<int>(rig_from_world.size()));
    if (fresh) rig_from_world.push_back(cam_from_rig.Inverse() * bundle->images[i].cam_from_world);
    images.push_back({frame->second, cam_from_rig});
  }
  calib::AdjustOptions adjust;
  adjust.lens = calib::LensFreedom::kFixed;
  adjust.progress = options.progress;
  calib::Bundle moved;
  try {
    moved = calib::AdjustRig(*bundle, images, rig_from_world, adjust).bundle;
  } catch (const Interrupted&) {
    throw;
  } catch (const Error&) {
    return false;  // too few images or observations, all of which the mapper itself can cause
  }
  for (size_t p = 0; p < moved.points.size(); ++p) {
    // A point at infinity has no place: it stays where it was, until it is triangulated again.
    const bool is_place = moved.points[p].allFinite() && moved.points[p][3] > 0;
    if (!is_place) moved.points[p] = bundle->points[p];
  }
  for (const calib::BundleImage& image : moved.images) {
    if (!image.cam_from_world.translation.allFinite()) return false;
  }
  *bundle = std::move(moved);
  return true;
}

}  // namespace dtr::sfm
