#include "calib/sfm/mapping/model_check.h"

#include <map>
#include <stdexcept>

#include "calib/sfm/mapping/acceptance.h"

namespace dtr::sfm {
namespace {

MapCameras CamerasOf(const ViewGraph& graph, const calib::SfmModel& model, int threads) {
  std::map<std::string, size_t> index;
  for (size_t i = 0; i < graph.images.size(); ++i) index[graph.images[i].name] = i;
  MapCameras cameras;
  cameras.lenses = graph.cameras;
  cameras.placed.assign(graph.images.size(), 0);
  cameras.cam_from_world.resize(graph.images.size());
  for (const calib::SfmImage& image : model.images) {
    const auto found = index.find(image.name);
    if (found == index.end() ||
        image.features.size() != graph.images[found->second].pixels.size()) {
      throw std::invalid_argument("WhyContradicted: the model is not of the graph: " + image.name);
    }
    cameras.placed[found->second] = 1;
    cameras.cam_from_world[found->second] = image.cam_from_world;
    cameras.lenses[static_cast<size_t>(graph.images[found->second].camera)] =
        model.cameras.at(image.camera_id);
  }
  cameras.rays = RaysOf(graph, cameras.lenses, threads);
  return cameras;
}

std::vector<MapPoint> PointsOfModel(const ViewGraph& graph, const calib::SfmModel& model) {
  std::map<std::string, const calib::SfmImage*> image_of;
  for (const calib::SfmImage& image : model.images) image_of[image.name] = &image;
  std::map<std::uint64_t, MapPoint> points;
  for (const auto& [id, point] : model.points) points[id].p_in_world = point.p_in_world;
  for (size_t i = 0; i < graph.images.size(); ++i) {
    const auto found = image_of.find(graph.images[i].name);
    if (found == image_of.end()) continue;
    const auto& features = found->second->features;
    for (size_t f = 0; f < features.size(); ++f) {
      const auto point = points.find(features[f].point_id);
      if (point == points.end()) continue;
      point->second.seen.push_back({static_cast<int>(i), static_cast<std::uint32_t>(f)});
    }
  }
  std::vector<MapPoint> list;
  for (auto& [id, point] : points) list.push_back(std::move(point));
  return list;
}

}  // namespace

std::string WhyContradicted(const ViewGraph& graph, const calib::SfmModel& model, int threads) {
  const MapCameras cameras = CamerasOf(graph, model, threads);
  const std::vector<MapPoint> points = PointsOfModel(graph, model);
  const MapEvidence evidence{graph, cameras, points, {}};
  MapStatistics statistics;
  if (std::string why = WhyNotContradicted(evidence, &statistics); !why.empty()) return why;
  return WhyNotJoined(evidence);
}

}  // namespace dtr::sfm
