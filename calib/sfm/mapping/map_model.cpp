#include "calib/sfm/mapping/map_model.h"

#include <algorithm>
#include <utility>

namespace dtr::sfm {
namespace {

// Each feature to one point: a resected image may have given a feature to a point while its old
// track has it, too.
void DropSharedFeatures(const ViewGraph& graph, std::vector<MapPoint>* points) {
  std::stable_sort(points->begin(), points->end(), [](const MapPoint& x, const MapPoint& y) {
    return x.seen.size() > y.seen.size();
  });
  std::vector<std::vector<char>> taken(graph.images.size());
  for (size_t i = 0; i < taken.size(); ++i) taken[i].assign(graph.images[i].pixels.size(), 0);
  for (MapPoint& point : *points) {
    std::erase_if(point.seen, [&](const TrackFeature& f) {
      return std::exchange(taken[static_cast<size_t>(f.image)][f.feature], char{1}) != 0;
    });
  }
  std::erase_if(*points, [](const MapPoint& point) { return point.seen.size() < 2; });
  std::stable_sort(points->begin(), points->end(),
                   [](const MapPoint& x, const MapPoint& y) { return x.track < y.track; });
}

}  // namespace

calib::SfmModel ModelOf(const ViewGraph& graph, const MapCameras& cameras,
                        std::vector<MapPoint>* points) {
  calib::SfmModel model;
  std::vector<size_t> index(graph.images.size());
  for (size_t i = 0; i < graph.images.size(); ++i) {
    if (!cameras.placed[i]) continue;
    const auto camera = static_cast<std::uint32_t>(graph.images[i].camera);
    model.cameras[camera + 1] = cameras.lenses[camera];
    calib::SfmImage image{static_cast<std::uint32_t>(i + 1),
                          graph.images[i].name,
                          camera + 1,
                          cameras.cam_from_world[i],
                          {}};
    for (const Eigen::Vector2d& pixel : graph.images[i].pixels) image.features.push_back({pixel});
    index[i] = model.images.size();
    model.images.push_back(std::move(image));
  }
  DropOutliers(graph, cameras, points);
  DropSharedFeatures(graph, points);
  for (size_t p = 0; p < points->size(); ++p) {
    const MapPoint& point = (*points)[p];
    double sum = 0;
    for (const TrackFeature& f : point.seen) {
      model.images[index[static_cast<size_t>(f.image)]].features[f.feature].point_id = p + 1;
      sum += ReprojectionErrorPx(graph, cameras, f, point.p_in_world);
    }
    model.points[p + 1] = {point.p_in_world, {}, sum / static_cast<double>(point.seen.size())};
  }
  std::sort(model.images.begin(), model.images.end(),
            [](const auto& x, const auto& y) { return x.name < y.name; });
  return model;
}

}  // namespace dtr::sfm
