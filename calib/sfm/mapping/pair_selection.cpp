#include "calib/sfm/mapping/pair_selection.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <numbers>
#include <numeric>

#include "calib/sfm/mapping/points.h"
#include "dtr/base/order_statistics.h"

namespace dtr::sfm {
namespace {

constexpr double kMinSupport = 0.12;  // of a pair's triplets
constexpr double kMaxMisfit = 5;      // standard deviations of a pair's own rotation
constexpr int kFilterPasses = 2;

using Eigen::Matrix3d;

// The rotation of a pair as one of the nodes that its images belong to, whose world is that of
// their station.
RelativeRotation OfNodes(const ViewGraph& graph, const std::vector<int>& nodes,
                         RelativeRotation rotation) {
  const Matrix3d& a = graph.images[rotation.image_a].cam_from_station;
  const Matrix3d& b = graph.images[rotation.image_b].cam_from_station;
  const auto turn = [&](MatchedPose& pose) {
    pose.b_from_a = b.transpose() * pose.b_from_a * a;
    pose.b_translation_a = b.transpose() * pose.b_translation_a;
    pose.covariance = b.transpose() * pose.covariance * b;
  };
  turn(rotation);
  if (rotation.twin) turn(*rotation.twin);
  rotation.image_a = nodes[rotation.image_a];
  rotation.image_b = nodes[rotation.image_b];
  return rotation;
}

// Keeps the pairs of the part with the most images (of equal ones, that with the first image).
std::vector<char> LargestPart(int images, std::vector<RelativeRotation>* pairs) {
  std::vector<int> parent(images), size(images, 1);
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const RelativeRotation& pair : *pairs) {
    const int a = root(pair.image_a), b = root(pair.image_b);
    if (a == b) continue;
    parent[std::max(a, b)] = std::min(a, b);
    size[std::min(a, b)] += size[std::max(a, b)];
  }
  int best = 0;
  for (int i = 0; i < images; ++i) {
    if (root(i) == i && size[i] > size[best]) best = i;
  }
  std::vector<char> in(images);
  for (int i = 0; i < images; ++i) in[i] = root(i) == best ? 1 : 0;
  std::erase_if(*pairs, [&](const RelativeRotation& pair) { return !in[pair.image_a]; });
  return in;
}

template <typename Keep>
void KeepIf(std::vector<RelativeRotation>* pairs, std::vector<double>* support, Keep keep) {
  size_t kept = 0;
  for (size_t p = 0; p < pairs->size(); ++p) {
    if (!keep(p)) continue;
    (*pairs)[kept] = (*pairs)[p];
    (*support)[kept++] = (*support)[p];
  }
  pairs->resize(kept);
  support->resize(kept);
}

// Takes the twins that agree better with the averaged rotations.
void TakeAgreeingTwins(std::vector<RelativeRotation>* pairs, AveragedRotations* averaged) {
  for (size_t p = 0; p < pairs->size(); ++p) {
    RelativeRotation& pair = (*pairs)[p];
    if (!pair.twin) continue;
    const double misfit = MisfitOf(*pair.twin, averaged->cam_from_world[pair.image_a],
                                   averaged->cam_from_world[pair.image_b]);
    if (misfit >= averaged->misfit[p]) continue;
    pair.TakeTwin();
    averaged->misfit[p] = misfit;
  }
}

void Summarise(const AveragedRotations& averaged, MapStatistics* statistics) {
  std::vector<double> angles = averaged.angle_rad, misfits = averaged.misfit;
  if (angles.empty()) return;
  statistics->rotation_median_deg = UpperMedian(angles) * 180 / std::numbers::pi;
  statistics->rotation_misfit = UpperMedian(misfits);
}

std::vector<LeftOut> LeftOutOf(const ViewGraph& graph, const std::vector<char>& connected) {
  std::vector<int> matches(graph.images.size());
  for (const PairGeometry& pair : graph.pairs) {
    for (const auto& [i, other] :
         {std::pair{pair.image_a, pair.image_b}, std::pair{pair.image_b, pair.image_a}}) {
      if (connected[other])
        matches[i] = std::max(matches[i], static_cast<int>(pair.matches.size()));
    }
  }
  std::vector<LeftOut> left_out;
  for (size_t i = 0; i < connected.size(); ++i) {
    if (connected[i]) continue;
    left_out.push_back(
        {static_cast<int>(i),
         matches[i] < kMinPairMatches
             ? fmt::format("at most {} matches with any photo of the map", matches[i])
             : fmt::format("its pairs (up to {} matches) disagree with the others' rotations",
                           matches[i])});
  }
  return left_out;
}

}  // namespace

std::vector<double> SigmasOf(const ViewGraph& graph) {
  std::vector<double> sigmas;
  for (const GraphImage& image : graph.images) {
    const calib::LensCamera& lens = graph.cameras[image.camera];
    sigmas.push_back(LimitPx(1, lens) / lens.params[0]);
  }
  return sigmas;
}

std::vector<int> NodesOf(const ViewGraph& graph) {
  std::map<int, int> first_of;
  std::vector<int> nodes;
  for (size_t i = 0; i < graph.images.size(); ++i) {
    const int station = graph.images[i].station, image = static_cast<int>(i);
    nodes.push_back(station < 0 ? image : first_of.emplace(station, image).first->second);
  }
  return nodes;
}

Rotations SelectPairs(const ViewGraph& graph, const Rays& rays, const MapOptions& options,
                      MapStatistics* statistics) {
  const auto images = static_cast<int>(graph.images.size());
  Rotations result;
  const std::vector<int> nodes = NodesOf(graph);
  std::vector<RelativeRotation> pairs;
  bool parallax = false;
  for (auto& rotation : RelativeRotationsOf(graph, rays, SigmasOf(graph), options.progress)) {
    if (!rotation || rotation->matches < kMinPairMatches) continue;
    if (nodes[rotation->image_a] == nodes[rotation->image_b]) continue;
    parallax = parallax || graph.pairs[rotation->pair].kind != PairKind::kRotation;
    pairs.push_back(OfNodes(graph, nodes, *rotation));
  }
  statistics->pairs = static_cast<int>(graph.pairs.size());
  statistics->pairs_without_rotation = statistics->pairs - static_cast<int>(pairs.size());
  const size_t with_rotation = pairs.size();
  result.connected = LargestPart(images, &pairs);
  if (pairs.empty()) {
    result.why_not = "no pair of photos has enough matches that one rotation explains";
  } else if (!parallax) {
    result.why_not = "no pair of photos shows parallax: the camera was rotated at one position";
  }
  if (result.why_not.empty()) {
    ChooseTwins(images, &pairs);
    std::vector<double> support = TripletSupport(images, pairs);
    KeepIf(&pairs, &support, [&](size_t p) { return support[p] >= kMinSupport; });
    AveragedRotations averaged;
    for (int pass = 0; pass <= kFilterPasses; ++pass) {
      if (pass > 0) {
        TakeAgreeingTwins(&pairs, &averaged);
        KeepIf(&pairs, &support, [&](size_t p) { return averaged.misfit[p] <= kMaxMisfit; });
      }
      result.connected = LargestPart(images, &pairs);
      support = TripletSupport(images, pairs);
      averaged = AverageRotations(images, pairs, support);
    }
    Summarise(averaged, statistics);
    for (int i = 0; i < images; ++i) {
      const Matrix3d& of_node = averaged.cam_from_world[nodes[i]];
      const bool is_node = graph.images[i].station < 0;
      result.cam_from_world.push_back(is_node ? of_node
                                              : graph.images[i].cam_from_station * of_node);
    }
    if (pairs.empty()) result.why_not = "the rotations of all pairs disagree";
  }
  statistics->pairs_dropped = static_cast<int>(with_rotation - pairs.size());
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const auto& x, const auto& y) { return x.matches > y.matches; });
  for (const RelativeRotation& pair : pairs) result.pairs.push_back(pair.pair);
  const std::vector<char> of_nodes = result.connected;
  for (int i = 0; i < images; ++i) result.connected[i] = of_nodes[nodes[i]];
  result.left_out = LeftOutOf(graph, result.connected);
  return result;
}

}  // namespace dtr::sfm
