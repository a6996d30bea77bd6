#include <gtest/gtest.h>

#include <numbers>

#include "calib/sfm/mapping/rotation_averaging.h"
#include "calib/sfm/mapping/so3.h"
#include "calib/sfm/mapping/tracks.h"
#include "tests/calib/sfm/mapping/synthetic_graph.h"

namespace dtr::sfm {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Vector3d RandomVector(Random* random) {
  const double x = random->Normal(), y = random->Normal();
  return {x, y, random->Normal()};
}

struct Truth {
  std::vector<Matrix3d> world;
  std::vector<RelativeRotation> pairs;
};

// Every image with its next eight; rotations with an error of 0.2 degrees.
Truth Chain(int images, double wrong_share) {
  Random random(5);
  Truth truth;
  for (int i = 0; i < images; ++i) truth.world.push_back(ExpOf(RandomVector(&random)));
  for (int a = 0; a < images; ++a) {
    for (int b = a + 1; b < std::min(images, a + 9); ++b) {
      RelativeRotation pair{{}, static_cast<int>(truth.pairs.size()), a, b};
      const bool wrong = random.Uniform() < wrong_share;
      const Vector3d error = RandomVector(&random) * (wrong ? 1 : 0.0035);
      pair.b_from_a = ExpOf(error) * truth.world[b] * truth.world[a].transpose();
      pair.covariance = 0.0035 * 0.0035 * Matrix3d::Identity();
      pair.matches = wrong ? 60 : 100;
      truth.pairs.push_back(pair);
    }
  }
  return truth;
}

double WorstDeg(const Truth& truth, const std::vector<Matrix3d>& found) {
  const Matrix3d gauge = found[0].transpose() * truth.world[0];
  double worst = 0;
  for (size_t i = 0; i < found.size(); ++i) {
    worst = std::max(worst, LogOf(found[i] * gauge * truth.world[i].transpose()).norm());
  }
  return worst * 180 / std::numbers::pi;
}

TEST(RotationAveraging, ASixthOfWrongPairsDoesNotMoveTheImages) {
  const Truth truth = Chain(40, 1.0 / 6);
  const auto support = TripletSupport(40, truth.pairs);
  const AveragedRotations averaged = AverageRotations(40, truth.pairs, support);
  // 0.2 degrees a pair, carried along a chain of 40 with eight bonds an image.
  EXPECT_LT(WorstDeg(truth, averaged.cam_from_world), 1.5);
}

TEST(RotationAveraging, TripletsTellRightPairsFromWrongOnes) {
  const Truth truth = Chain(40, 0.1);
  const auto support = TripletSupport(40, truth.pairs);
  const AveragedRotations averaged = AverageRotations(40, truth.pairs, support);
  for (size_t p = 0; p < truth.pairs.size(); ++p) {
    const RelativeRotation& pair = truth.pairs[p];
    const Matrix3d exact = truth.world[pair.image_b] * truth.world[pair.image_a].transpose();
    const double error = LogOf(pair.b_from_a * exact.transpose()).norm();
    if (error > 0.3) {
      EXPECT_LE(support[p], 0.34) << p;
      EXPECT_GT(averaged.misfit[p], 5) << p;
    }
    if (error < 0.02) {
      EXPECT_LT(averaged.misfit[p], 4) << p;
    }
  }
}

// Two groups of images; every pair across has its wrong pose, and most have the right one as twin.
TEST(ChooseTwins, PairsThatAreAllWrongAreChosenTogether) {
  constexpr int kImages = 10, kFirstGroup = 6;
  Random random(6);
  Truth truth;
  for (int i = 0; i < kImages; ++i) truth.world.push_back(ExpOf(RandomVector(&random)));
  for (int a = 0; a < kImages; ++a) {
    for (int b = a + 1; b < kImages; ++b) {
      RelativeRotation pair{{}, static_cast<int>(truth.pairs.size()), a, b};
      pair.covariance = 0.0035 * 0.0035 * Matrix3d::Identity();
      pair.matches = 100;
      const Matrix3d exact = truth.world[b] * truth.world[a].transpose();
      const bool across = a < kFirstGroup && b >= kFirstGroup;
      if (across || random.Uniform() < 0.3) {
        MatchedPose& wrong = pair.twin.emplace(pair);
        wrong.b_from_a = ExpOf(RandomVector(&random)) * exact;
      }
      pair.b_from_a = ExpOf(RandomVector(&random) * 0.0035) * exact;
      if (across) {
        pair.TakeTwin();
        if (random.Uniform() < 0.2) pair.twin.reset();
      }
      truth.pairs.push_back(pair);
    }
  }
  std::vector<RelativeRotation> chosen = truth.pairs;
  ChooseTwins(kImages, &chosen);
  int changed = 0;
  for (size_t p = 0; p < chosen.size(); ++p) {
    const RelativeRotation& pair = chosen[p];
    const bool across = pair.image_a < kFirstGroup && pair.image_b >= kFirstGroup;
    if (across && !pair.twin) continue;
    const Matrix3d exact = truth.world[pair.image_b] * truth.world[pair.image_a].transpose();
    EXPECT_LT(LogOf(pair.b_from_a * exact.transpose()).norm(), 0.02)
        << pair.image_a << " " << pair.image_b;
    changed += across ? 1 : 0;
  }
  EXPECT_GT(changed, 15);
}

// A small far object, where rotation and translation explain nearly the same, and a room.
TEST(PairPoses, AnUncertainRotationSaysSo) {
  std::vector<double> traces;
  for (const bool room : {false, true}) {
    const auto points = room ? testing::Box(400, {-4, -3, 5}, {4, 3, 9})
                             : testing::Box(400, {-2, -1.5, 30}, {2, 1.5, 32});
    testing::Scene scene{{testing::Lens()}, {}, {}, points};
    for (const double x : {0.0, 1.5}) {
      scene.cam_from_world.push_back(testing::LookAt({x, 0, 0}, {0, 0, room ? 7.0 : 31.0}));
    }
    testing::GraphSpec spec;
    spec.kind = PairKind::kUncalibrated;
    const testing::Seen seen = testing::GraphOf(scene, spec);
    const Rays rays = RaysOf(seen.graph, seen.graph.cameras);
    const std::vector<double> sigmas(2, 1 / 700.0);
    const auto rotations = RelativeRotationsOf(seen.graph, rays, sigmas);
    ASSERT_EQ(rotations.size(), 1u);
    ASSERT_TRUE(rotations[0]);
    const Matrix3d exact = scene.cam_from_world[1].rotation.toRotationMatrix() *
                           scene.cam_from_world[0].rotation.conjugate();
    const Vector3d error = LogOf(rotations[0]->b_from_a * exact.transpose());
    const Matrix3d covariance =
        rotations[0]->covariance + kRotationFloorRad * kRotationFloorRad * Matrix3d::Identity();
    EXPECT_LT(std::sqrt(error.dot(covariance.inverse() * error)), 3) << room;
    traces.push_back(rotations[0]->covariance.trace());
  }
  EXPECT_GT(traces[0], 10 * traces[1]);
}

TEST(Tracks, AMatchThatWouldShowOnePhotoTwiceIsLeftOut) {
  ViewGraph graph;
  for (int i = 0; i < 3; ++i) graph.images.push_back({"", 0, std::vector<Eigen::Vector2d>(3)});
  graph.pairs = {testing::Pair(0, 1), testing::Pair(0, 2), testing::Pair(1, 2)};
  graph.pairs[0].matches = {{0, 0}, {1, 1}};
  graph.pairs[1].matches = {{0, 0}};
  graph.pairs[2].matches = {{1, 0}, {2, 2}};  // 1 belongs to another point than 0
  const std::vector<int> order{0, 1, 2};
  const std::vector<Track> tracks = BuildTracks(graph, order);
  ASSERT_EQ(tracks.size(), 3u);
  EXPECT_EQ(tracks[0].size(), 3u);
  EXPECT_EQ(tracks[1].size(), 2u);
  EXPECT_EQ(tracks[2][0].feature, 2u);
}

}  // namespace
}  // namespace dtr::sfm
