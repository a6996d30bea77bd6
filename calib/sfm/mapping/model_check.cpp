#include "calib/sfm/mapping/model_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <stdexcept>

#include "calib/sfm/mapping/acceptance.h"

namespace dtr::sfm {
namespace {

// Photos that were taken from different places have two thirds and more of their matches explained;
// of a camera that only turned, what noise gives a depth: a fiftieth.
constexpr double kMinExplained = 0.2;
// A focal length that is farther from the one that pairs agree on than their vote ever erred: of
// photos of two zoom settings one lens with strong distortion may explain both.
constexpr double kMaxFocalFactor = 2;

MapCameras CamerasOf(const ViewGraph& graph, const calib::SfmModel& model) {
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
  cameras.rays = RaysOf(graph, cameras.lenses);
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

std::string WhyNotFocalOfPairs(const ViewGraph& graph, const MapCameras& cameras) {
  for (size_t i = 0; i < graph.images.size(); ++i) {
    const auto c = static_cast<size_t>(graph.images[i].camera);
    if (!cameras.placed[i] || !graph.focal_is_known[c]) continue;
    const double f = cameras.lenses[c].params[0], known = graph.cameras[c].params[0];
    if (std::max(f / known, known / f) <= kMaxFocalFactor) continue;
    return fmt::format(
        "the focal length of camera {} became {:.0f} px, where pairs of its photos agree on "
        "{:.0f} px: photos of several cameras or zoom settings need intrinsics of their own "
        "(`camera_per` folder or photo)",
        c + 1, f, known);
  }
  return "";
}

// Share of the matches between images of the model whose two features see one point of it.
double ExplainedShare(const ViewGraph& graph, const MapCameras& cameras,
                      std::span<const MapPoint> points) {
  constexpr size_t kNone = ~size_t{0};
  std::vector<std::vector<size_t>> point_of;
  for (const GraphImage& image : graph.images) point_of.emplace_back(image.pixels.size(), kNone);
  for (size_t p = 0; p < points.size(); ++p) {
    for (const TrackFeature& f : points[p].seen) point_of[f.image][f.feature] = p;
  }
  double all = 0, explained = 0;
  for (const PairGeometry& pair : graph.pairs) {
    if (!cameras.placed[pair.image_a] || !cameras.placed[pair.image_b]) continue;
    for (const auto& [a, b] : pair.matches) {
      const size_t p = point_of[pair.image_a][a];
      ++all;
      explained += p != kNone && p == point_of[pair.image_b][b] ? 1 : 0;
    }
  }
  return all > 0 ? explained / all : 0;
}

}  // namespace

std::string WhyRigsContradicted(const ViewGraph& graph, const calib::SfmModel& model) {
  constexpr double kMaxContradictedOfRigs = 0.25;
  const MapCameras cameras = CamerasOf(graph, model);
  const std::vector<MapPoint> points = PointsOfModel(graph, model);
  MapStatistics statistics;
  (void)WhyNotContradicted({graph, cameras, points, {}}, &statistics);
  if (statistics.contradicted_share <= kMaxContradictedOfRigs) return "";
  return fmt::format("pairs of views with {:.0f} % of all matches contradict the poses",
                     100 * statistics.contradicted_share);
}

std::string WhyContradicted(const ViewGraph& graph, const calib::SfmModel& model) {
  const MapCameras cameras = CamerasOf(graph, model);
  const std::vector<MapPoint> points = PointsOfModel(graph, model);
  const double explained = ExplainedShare(graph, cameras, points);
  if (explained < kMinExplained) {
    return fmt::format("only {:.0f} % of the matches became points", 100 * explained);
  }
  if (std::string why = WhyNotFocalOfPairs(graph, cameras); !why.empty()) return why;
  const MapEvidence evidence{graph, cameras, points, {}};
  MapStatistics statistics;
  if (std::string why = WhyNotContradicted(evidence, &statistics); !why.empty()) return why;
  return WhyNotJoined(evidence);
}

}  // namespace dtr::sfm
