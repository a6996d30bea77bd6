#include "calib/sfm/mapping/triangulate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "tests/calib/sfm/mapping/synthetic_graph.h"
#include "tests/support/on_threads.h"

namespace dtr::sfm {
namespace {

using testing::GraphOf;
using testing::GraphSpec;
using testing::Scene;
using testing::Seen;

// Distance in units of the scene from each point to the nearest true one, sorted.
std::vector<double> DistancesToTruth(const calib::SfmModel& model, const Scene& scene) {
  std::vector<double> distances;
  for (const auto& [id, point] : model.points) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto& truth : scene.points) {
      nearest = std::min(nearest, (truth.p - point.p_in_world).norm());
    }
    distances.push_back(nearest);
  }
  std::sort(distances.begin(), distances.end());
  return distances;
}

TEST(TriangulateMatches, FindsThePointsThatGivenCamerasSee) {
  const Scene scene = testing::Ring(10, 600);
  GraphSpec spec;
  spec.outlier_share = 0.1;
  const Seen seen = GraphOf(scene, spec);
  const calib::SfmModel model = TriangulateMatches(seen.graph, scene.cam_from_world);

  ASSERT_EQ(model.images.size(), scene.images());
  for (const calib::SfmImage& image : model.images) {
    const Pose& given = scene.cam_from_world[image.id - 1];
    EXPECT_EQ(image.cam_from_world.translation, given.translation);
    EXPECT_EQ(image.cam_from_world.rotation.coeffs(), given.rotation.coeffs());
  }
  EXPECT_GT(model.points.size(), scene.points.size() / 2);
  // 0.4 px at a distance of 3 and 700 px of focal length are 0.002 units.
  const std::vector<double> distances = DistancesToTruth(model, scene);
  EXPECT_LT(distances[distances.size() / 2], 0.003);
  EXPECT_LT(distances[distances.size() * 95 / 100], 0.02);
}

// Half a pixel of all photos moves every point: what a slip of conventions would do must show.
TEST(TriangulateMatches, AnObservationShowsTheImageOfThePoint) {
  const Scene scene = testing::Ring(8, 400);
  GraphSpec exact;
  exact.noise_px = exact.outlier_share = 0;
  const Seen seen = GraphOf(scene, exact);
  const calib::SfmModel model = TriangulateMatches(seen.graph, scene.cam_from_world);
  size_t observations = 0;
  for (const calib::SfmImage& image : model.images) {
    const auto& shows = seen.shows[image.id - 1];
    for (size_t f = 0; f < image.features.size(); ++f) {
      if (image.features[f].point_id == calib::SfmFeature::kNoPoint) continue;
      const auto& point = model.points.at(image.features[f].point_id);
      EXPECT_LT((point.p_in_world - scene.points[static_cast<size_t>(shows[f])].p).norm(), 1e-6);
      ++observations;
    }
  }
  EXPECT_GT(observations, 400u);
}

TEST(TriangulateMatches, WrongCamerasHaveNoPoints) {
  const Scene scene = testing::Ring(8, 400);
  std::vector<Pose> wrong;  // neighbours stand 135 degrees apart
  for (size_t i = 0; i < 8; ++i) wrong.push_back(scene.cam_from_world[3 * i % 8]);
  const Seen seen = GraphOf(scene);
  const size_t right = TriangulateMatches(seen.graph, scene.cam_from_world).points.size();
  // Matches fit a point by chance alone.
  EXPECT_LT(TriangulateMatches(seen.graph, wrong).points.size(), right / 4);
}

TEST(TriangulateMatches, ThreadsChangeNoBitAndOnePosePerImageIsAsked) {
  const Scene scene = testing::Ring(6, 300);
  const Seen seen = GraphOf(scene);
  const auto one =
      OnThreads(1, [&] { return TriangulateMatches(seen.graph, scene.cam_from_world); });
  const auto three =
      OnThreads(3, [&] { return TriangulateMatches(seen.graph, scene.cam_from_world); });
  ASSERT_EQ(one.points.size(), three.points.size());
  for (const auto& [id, point] : one.points) {
    EXPECT_EQ(point.p_in_world, three.points.at(id).p_in_world);
  }
  EXPECT_THROW(
      OnThreads(
          1,
          [&] { return TriangulateMatches(seen.graph, std::span(scene.cam_from_world).first(5)); }),
      std::invalid_argument);
}

}  // namespace
}  // namespace dtr::sfm
