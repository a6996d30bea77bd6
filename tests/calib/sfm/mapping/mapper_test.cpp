#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "calib/sfm/mapping/global_mapper.h"
#include "calib/sfm/mapping/model_check.h"
#include "calib/sfm/matching/planar_poses.h"
#include "tests/calib/sfm/mapping/synthetic_graph.h"
#include "tests/support/on_threads.h"

namespace dtr::sfm {
namespace {

using Eigen::Vector3d;
using testing::Box;
using testing::Compare;
using testing::GraphOf;
using testing::GraphSpec;
using testing::LookAt;
using testing::Scene;
using testing::ScenePoint;
using testing::Seen;

// Positions to 0.5 % of the path and 0.1 degrees: noise of 0.4 px leaves about a tenth of that.
constexpr double kPositionShare = 5e-3, kRotationDeg = 0.1;

void ExpectSolved(const Mapped& mapped, const Scene& scene, double position_share = kPositionShare,
                  double rotation_deg = kRotationDeg) {
  EXPECT_EQ(mapped.why_not, "");
  EXPECT_EQ(mapped.model.images.size(), scene.images());
  if (mapped.model.images.size() < 2) return;
  const testing::MapErrors errors = Compare(mapped.model, scene);
  EXPECT_LT(errors.position_share, position_share);
  EXPECT_LT(errors.rotation_deg, rotation_deg);
}

void ExpectSolvedOrRefused(const Mapped& mapped, const Scene& scene) {
  if (!mapped.why_not.empty()) return;
  ExpectSolved(mapped, scene, 0.02, 0.5);
}

TEST(GlobalMapper, ARingIsClosed) {
  const Scene scene = testing::Ring(16);
  ExpectSolved(MapGlobally(GraphOf(scene).graph, {}), scene);
}

TEST(GlobalMapper, PairsWithoutRotationsAreFitted) {
  const Scene scene = testing::Ring(14);
  GraphSpec spec;
  spec.kind = PairKind::kUncalibrated;
  ExpectSolved(MapGlobally(GraphOf(scene, spec).graph, {}), scene);
}

TEST(GlobalMapper, AGridOf25) {
  Scene scene{{testing::Lens()}, {}, {}, Box(700, {-3, -3, 6}, {3, 3, 9})};
  for (int i = 0; i < 25; ++i) {
    const double x = i % 5 - 2.0, y = i / 5 - 2.0;
    scene.cam_from_world.push_back(LookAt({x, y, 0.1 * (i % 3)}, {0.3 * x, 0.3 * y, 8}));
  }
  ExpectSolved(MapGlobally(GraphOf(scene).graph, {}), scene);
}

TEST(GlobalMapper, TwoAndThreePhotos) {
  for (const int images : {2, 3}) {
    Scene scene{{testing::Lens()}, {}, {}, Box(300, {-3, -2, 6}, {3, 2, 9})};
    for (int i = 0; i < images; ++i) {
      scene.cam_from_world.push_back(LookAt({1.0 * i, 0.2 * i * i, 0}, {0, 0, 8}));
    }
    ExpectSolved(MapGlobally(GraphOf(scene).graph, {}), scene, 0.02, 0.3);
  }
}

TEST(GlobalMapper, TwoPhotosDoNotDetermineAFocalLength) {
  Scene scene{{testing::Lens()}, {}, {}, Box(300, {-3, -2, 6}, {3, 2, 9})};
  for (int i = 0; i < 2; ++i) {
    scene.cam_from_world.push_back(LookAt({1.0 * i, 0, 0}, {0, 0, 8}));
  }
  Seen seen = GraphOf(scene);
  seen.graph.focal_is_known[0] = false;
  EXPECT_THAT(MapGlobally(seen.graph, {}).why_not, ::testing::HasSubstr("focal length"));
}

Scene Walk(int images) {
  Scene scene{{testing::Lens()}, {}, {}, Box(120 * images, {-4, -3, 5}, {0.8 * images + 4, 3, 8})};
  for (int i = 0; i < images; ++i) {
    scene.cam_from_world.push_back(LookAt({0.8 * i, 0, 0}, {0.8 * i, 0, 6}));
  }
  return scene;
}

TEST(GlobalMapper, AStraightWalk) {
  const Scene scene = Walk(14);
  ExpectSolved(MapGlobally(GraphOf(scene).graph, {}), scene, 0.01, 0.3);
}

// Without anything that fixes it, focal length and depth of a straight walk with parallel axes grow
// together: what EXIF or a vote told holds it.
TEST(GlobalMapper, AStraightWalkKeepsTheKnownFocalLength) {
  const Mapped mapped = MapGlobally(GraphOf(Walk(8)).graph, {});
  EXPECT_EQ(mapped.why_not, "");
  ASSERT_EQ(mapped.model.cameras.size(), 1u);
  EXPECT_NEAR(mapped.model.cameras.at(1).params[0], 700, 0.02 * 700);
}

TEST(GlobalMapper, AWellDeterminedFocalLengthIsNotDrawnToAWrongOne) {
  Seen seen = GraphOf(testing::Ring(16));
  seen.graph.cameras[0].params[0] *= 1.1;
  const Mapped mapped = MapGlobally(seen.graph, {});
  EXPECT_EQ(mapped.why_not, "");
  EXPECT_NEAR(mapped.model.cameras.at(1).params[0], 700, 0.003 * 700);
}

TEST(GlobalMapper, AStraightWalkAlongAPlane) {
  Scene scene = Walk(10);
  for (auto& point : scene.points) point.p.z() = 7;
  GraphSpec spec;
  spec.kind = PairKind::kPlanar;
  ExpectSolvedOrRefused(MapGlobally(GraphOf(scene, spec).graph, {}), scene);
}

TEST(GlobalMapper, AForwardWalk) {
  Scene scene{{testing::Lens()}, {}, {}, {}};
  Random random(8);
  for (int i = 0; i < 1500; ++i) {
    const double z = random.Uniform(2, 30), s = random.Uniform(-2, 2);
    const double side = i % 2 == 0 ? -2 : 2;
    scene.points.push_back(
        {i % 4 < 2 ? Vector3d(side, s, z) : Vector3d(s, side, z), Vector3d::Zero()});
  }
  for (int i = 0; i < 12; ++i) {
    scene.cam_from_world.push_back(
        LookAt({0.05 * std::sin(2.0 * i), 0, 0.9 * i}, {0, 0.1 * std::cos(1.0 * i), 0.9 * i + 20}));
  }
  ExpectSolvedOrRefused(MapGlobally(GraphOf(scene).graph, {}), scene);
}

TEST(GlobalMapper, PureRotationIsRefused) {
  Scene scene{{testing::Lens()}, {}, {}, Box(900, {-20, -4, 9}, {20, 4, 20})};
  for (int i = 0; i < 8; ++i) {
    scene.cam_from_world.push_back(LookAt({0, 0, 0}, {0.8 * i - 3, 0, 10}));
  }
  GraphSpec spec;
  spec.kind = PairKind::kRotation;
  EXPECT_THAT(MapGlobally(GraphOf(scene, spec).graph, {}).why_not, ::testing::HasSubstr("rotated"));
  // And where verification took it for something else.
  spec.kind = PairKind::kUncalibrated;
  EXPECT_NE(MapGlobally(GraphOf(scene, spec).graph, {}).why_not, "");
}

TEST(GlobalMapper, APlane) {
  Scene scene{{testing::Lens()}, {}, {}, Box(500, {-4, -3, 8}, {4, 3, 8})};
  for (int i = 0; i < 12; ++i) {
    const double x = 1.5 * (i % 4) - 2.2, y = 1.4 * (i / 4) - 1.4;
    scene.cam_from_world.push_back(LookAt({x, y, 0.4 * (i % 3)}, {0.1 * x, 0.2 * y, 8}));
  }
  GraphSpec spec;
  spec.kind = PairKind::kPlanar;
  ExpectSolvedOrRefused(MapGlobally(GraphOf(scene, spec).graph, {}), scene);
}

TEST(GlobalMapper, TwoCamerasWithDistortion) {
  Scene scene = testing::Ring(16);
  scene.lenses = {testing::Lens(700, -0.1), testing::Lens(900, 0.08)};
  for (int i = 0; i < 16; ++i) scene.lens_of.push_back(i % 2);
  Seen seen = GraphOf(scene);
  for (calib::LensCamera& camera : seen.graph.cameras) {
    camera.params[0] *= 1.05;
    camera.params[3] = 0;
  }
  const Mapped mapped = MapGlobally(seen.graph, {});
  ExpectSolved(mapped, scene, 0.01, 0.2);
  ASSERT_EQ(mapped.model.cameras.size(), 2u);
  EXPECT_NEAR(mapped.model.cameras.at(1).params[0], 700, 7);
  EXPECT_NEAR(mapped.model.cameras.at(2).params[0], 900, 9);
  EXPECT_NEAR(mapped.model.cameras.at(1).params[3], -0.1, 0.02);
}

TEST(GlobalMapper, AWrongFocalLength) {
  const Scene scene = testing::Ring(16);
  GraphSpec spec;
  spec.kind = PairKind::kUncalibrated;
  for (const double factor : {1.6, 1 / 1.6}) {
    Seen seen = GraphOf(scene, spec);
    seen.graph.focal_is_known[0] = false;
    seen.graph.cameras[0].params[0] *= factor;
    ExpectSolvedOrRefused(MapGlobally(seen.graph, {}), scene);
  }
}

TEST(GlobalMapper, AFewWrongPairsAreDropped) {
  const Scene scene = testing::Ring(16);
  GraphSpec spec;
  Seen seen = GraphOf(scene, spec);
  Random random(9);
  for (int i = 0; i < 3; ++i) {
    PairGeometry pair = testing::Pair(i, i + 8);
    pair.b_rotation_a = LookAt({random.Normal(), 1, 2}, {0, 0, 0}).rotation.toRotationMatrix();
    pair.b_translation_a = Vector3d::UnitX();
    for (std::uint32_t k = 0; k < 25; ++k) pair.matches.emplace_back(3 * k, 2 * k);
    seen.graph.pairs.push_back(pair);
  }
  testing::SortPairs(&seen.graph);
  ExpectSolved(MapGlobally(seen.graph, {}), scene);
}

// A walk along a street whose facade repeats after nine photos: photos of one look like those of
// the other, and pairs of them agree with each other.
TEST(GlobalMapper, EqualFacadesAreNotFoldedIntoOne) {
  for (const int wrong_every : {1, 3}) {
    Scene scene{{testing::Lens()}, {}, {}, Box(900, {-2, -3, 5}, {5, 3, 8})};
    constexpr double kStep = 0.8;
    constexpr int kRepeats = 16;
    const size_t facade = scene.points.size();
    for (size_t p = 0; p < facade; ++p) {
      scene.points.push_back(
          {scene.points[p].p + Vector3d(kStep * kRepeats, 0, 0), Vector3d::Zero()});
    }
    for (const auto& p : Box(700, {5, -3, 5}, {kStep * kRepeats - 2, 3, 8}, 11)) {
      scene.points.push_back(p);
    }
    for (int i = 0; i < 22; ++i) {
      scene.cam_from_world.push_back(LookAt({kStep * i, 0.2 * (i % 2), 0}, {kStep * i, 0, 6}));
    }
    GraphSpec spec;
    Seen seen = GraphOf(scene, spec);
    Random random(12);
    for (int a = 0; a < 6; ++a) {
      for (int b = kRepeats; b < 22; ++b) {
        if ((a + b) % wrong_every != 0) continue;
        std::vector<int> of_b;
        for (const int p : seen.shows[b]) {
          const auto at = static_cast<size_t>(p);
          of_b.push_back(at >= facade && at < 2 * facade ? p - static_cast<int>(facade) : -1);
        }
        Pose shifted = scene.cam_from_world[b];
        shifted.translation += shifted.rotation * Vector3d(kStep * kRepeats, 0, 0);
        const Pose b_from_a = shifted * scene.cam_from_world[a].Inverse();
        PairGeometry pair = testing::MatchPair(seen, a, b, of_b, b_from_a, spec, &random);
        if (pair.matches.size() > 30) seen.graph.pairs.push_back(pair);
      }
    }
    testing::SortPairs(&seen.graph);
    const Mapped mapped = MapGlobally(seen.graph, {});
    ExpectSolvedOrRefused(mapped, scene);
  }
}

constexpr int kWallPoints = 500;
constexpr double kWallZ = 8;

Scene Wall() {
  return {{testing::Lens()}, {}, {}, Box(kWallPoints, {-4, -3, kWallZ}, {4, 3, kWallZ})};
}

// Gives a pair the other pose that the wall leaves, the scene's first points; whether it is another
// by 4 degrees and more.
bool TakeOtherPoseOfWall(const Scene& scene, const Seen& seen, PairGeometry* pair) {
  matching::PointPairs on_wall;
  for (const auto& [a, b] : pair->matches) {
    const int point_a = seen.shows[pair->image_a][a], point_b = seen.shows[pair->image_b][b];
    if (point_a >= kWallPoints || point_b >= kWallPoints) continue;
    const calib::LensCamera& lens = scene.lenses[0];
    on_wall.Add(lens.RayFromPixel(seen.graph.images[pair->image_a].pixels[a])->hnormalized(),
                lens.RayFromPixel(seen.graph.images[pair->image_b].pixels[b])->hnormalized());
  }
  const Pose& a_from_world = scene.cam_from_world[pair->image_a];
  const Pose b_from_a = scene.cam_from_world[pair->image_b] * a_from_world.Inverse();
  const Eigen::Matrix3d rotation = b_from_a.rotation.toRotationMatrix();
  const Vector3d normal = a_from_world.rotation * Vector3d::UnitZ();
  const double distance = kWallZ - a_from_world.TargetOriginInSource().z();
  const auto both = matching::PosesOfPlane(
      rotation + b_from_a.translation * normal.transpose() / distance, on_wall);
  if (!both) return false;
  const auto off = [&](const matching::RelativePose& pose) { return (pose.r - rotation).norm(); };
  const auto& other = (*both)[off((*both)[0]) > off((*both)[1]) ? 0 : 1];
  EXPECT_LT(std::min(off((*both)[0]), off((*both)[1])), 1e-6);
  pair->b_rotation_a = other.r;
  pair->b_translation_a = other.t;
  return off(other) > 0.1;
}

// Photos of a wall with a few things before it: verification may take a pair for the other of the
// two poses that the wall leaves.
TEST(GlobalMapper, PairsWithTheOtherPoseOfTheirPlaneAreFound) {
  Scene scene = Wall();
  for (const auto& p : Box(40, {-2, -2, 6}, {2, 2, 7}, 9)) scene.points.push_back(p);
  for (int i = 0; i < 14; ++i) {
    const double x = 2.0 * (i % 5) - 4, y = 1.8 * (i / 5) - 2;
    scene.cam_from_world.push_back(LookAt({x, y, 0.5 * (i % 3)}, {0, 0.1 * y, 8}));
  }
  Seen seen = GraphOf(scene);
  int turned = 0;
  for (size_t k = 0; k < seen.graph.pairs.size(); ++k) {
    if (k % 5 > 1) continue;
    turned += TakeOtherPoseOfWall(scene, seen, &seen.graph.pairs[k]) ? 1 : 0;
  }
  ASSERT_GT(4 * turned, static_cast<int>(seen.graph.pairs.size()));
  ExpectSolved(MapGlobally(seen.graph, {}), scene);
}

// What stands before a wall is seen from one side alone: all pairs of photos from the left and from
// the right have the wall only, and no single one of them in its right pose agrees with others.
TEST(GlobalMapper, AGroupOfPhotosThatSharesOnlyAPlaneIsJoinedByTheOtherPosesOfAllItsPairs) {
  Scene scene = Wall();
  for (const double side : {-1.0, 1.0}) {
    for (ScenePoint p : Box(200, {-2, -2, 5.5}, {2, 2, 7.5}, side < 0 ? 9 : 10)) {
      p.normal = Vector3d(side, 0, -0.2).normalized();
      scene.points.push_back(p);
    }
  }
  constexpr int kLeft = 8;
  constexpr int kEvery = 10;  // point is found again from the other side
  for (int i = 0; i < kLeft + 5; ++i) {
    const double side = i < kLeft ? -1 : 1, y = 0.9 * (i % 3) - 1;
    scene.cam_from_world.push_back(
        LookAt({side * (2.5 + 0.5 * (i % kLeft)), y, 0.4 * (i % 4)}, {0.3 * side, 0.2 * y, 7.5}));
  }
  Seen seen = GraphOf(scene);
  int across = 0, turned = 0;
  for (PairGeometry& pair : seen.graph.pairs) {
    if (pair.image_a >= kLeft || pair.image_b < kLeft) continue;
    std::erase_if(pair.matches, [&](const auto& match) {
      return seen.shows[pair.image_a][match.first] % kEvery != 0;
    });
    ++across;
    turned += TakeOtherPoseOfWall(scene, seen, &pair) ? 1 : 0;
  }
  ASSERT_GE(across, 20);
  ASSERT_EQ(turned, across);
  const Mapped mapped = MapGlobally(seen.graph, {});
  ExpectSolved(mapped, scene);
  EXPECT_EQ(mapped.statistics.pairs_dropped, 0);
}

// A wallpaper whose pattern repeats: photos of one place match photos of another.
struct Wallpaper {
  Seen seen;
  Scene scene;
};
// A photo sees 4 units to each side.
Wallpaper PhotographWallpaper(double repeat, int photos_of_both) {
  Wallpaper wallpaper{{}, {{testing::Lens()}, {}, {}, Box(500, {-2.5, -2, 5}, {2.5, 2, 7})}};
  Scene& scene = wallpaper.scene;
  const size_t pattern = scene.points.size();
  for (size_t p = 0; p < pattern; ++p) {
    scene.points.push_back({scene.points[p].p + Vector3d(repeat, 0, 0), Vector3d::Zero()});
  }
  if (repeat > 6) {
    for (const auto& p : Box(500, {2.5, -2, 5}, {repeat - 2.5, 2, 7}, 9)) scene.points.push_back(p);
  }
  for (int i = 0; i < 20; ++i) {
    const double x = repeat * i / 19.0;
    scene.cam_from_world.push_back(LookAt({x, 0.5 * (i % 2), 0}, {x, 0, 6}));
  }
  for (int i = 0; i < photos_of_both; ++i) {
    scene.cam_from_world.push_back(LookAt({1 + 2.0 * i, 1.0 - i, -5}, {3, 0, 6}));
  }
  const GraphSpec spec;
  wallpaper.seen = GraphOf(scene, spec);
  Random random(12);
  for (int a = 0; a < 5; ++a) {
    for (int b = 15; b < 20; ++b) {
      std::vector<int> of_b;
      for (const int p : wallpaper.seen.shows[b]) {
        const int first = p - static_cast<int>(pattern);
        of_b.push_back(first >= 0 && first < static_cast<int>(pattern) ? first : -1);
      }
      Pose shifted = scene.cam_from_world[b];
      shifted.translation += shifted.rotation * Vector3d(repeat, 0, 0);
      PairGeometry pair = testing::MatchPair(
          wallpaper.seen, a, b, of_b, shifted * scene.cam_from_world[a].Inverse(), spec, &random);
      wallpaper.seen.graph.pairs.push_back(pair);
    }
  }
  testing::SortPairs(&wallpaper.seen.graph);
  return wallpaper;
}

// That there are two of what looks alike shows where photos see both.
TEST(GlobalMapper, PairsOfARepeatedPatternDoNotContradictAMapWhosePhotosSeeBothPlaces) {
  const Wallpaper wallpaper = PhotographWallpaper(6, 4);
  ExpectSolved(MapGlobally(wallpaper.seen.graph, {}), wallpaper.scene);
}

TEST(GlobalMapper, WithoutSuchPhotosTheyDo) {
  const Wallpaper wallpaper = PhotographWallpaper(12, 0);
  EXPECT_THAT(MapGlobally(wallpaper.seen.graph, {}).why_not, ::testing::HasSubstr("contradict"));
}

// Two groups with points of their own; one pair of photos across has points that no other sees.
TEST(GlobalMapper, TwoClustersJoinedByOnePairAreRefused) {
  Scene scene{{testing::Lens()}, {}, {}, Box(400, {-3, -2, 6}, {3, 2, 9})};
  for (const auto& p : Box(400, {20, -2, 6}, {26, 2, 9}, 6)) scene.points.push_back(p);
  for (int i = 0; i < 12; ++i) {
    const double x = i < 6 ? 0 : 23;
    scene.cam_from_world.push_back(LookAt({x + 0.7 * (i % 6) - 2, 0.3 * (i % 2), 0}, {x, 0, 8}));
  }
  Random random(7);
  Seen seen = GraphOf(scene);
  // New features of photos 5 and 6 that show the same far points.
  PairGeometry pair = testing::Pair(5, 6);
  const Pose b_from_a = scene.cam_from_world[6] * scene.cam_from_world[5].Inverse();
  pair.b_rotation_a = b_from_a.rotation.toRotationMatrix();
  pair.b_translation_a = b_from_a.translation.normalized();
  for (const auto& point : Box(4000, {-60, -20, 40}, {80, 20, 90}, 13)) {
    const auto a = scene.lenses[0].PixelFromCam(scene.cam_from_world[5] * point.p);
    const auto b = scene.lenses[0].PixelFromCam(scene.cam_from_world[6] * point.p);
    if (!a || !b || a->x() < 0 || a->x() > 960 || b->x() < 0 || b->x() > 960) continue;
    pair.matches.emplace_back(seen.graph.images[5].pixels.size(),
                              seen.graph.images[6].pixels.size());
    const double dx = random.Normal();
    seen.graph.images[5].pixels.push_back(*a + 0.3 * Eigen::Vector2d(dx, random.Normal()));
    seen.graph.images[6].pixels.push_back(*b);
  }
  ASSERT_GT(pair.matches.size(), 60u);
  seen.graph.pairs.push_back(pair);
  testing::SortPairs(&seen.graph);
  EXPECT_NE(MapGlobally(seen.graph, {}).why_not, "");
}

TEST(WhyContradicted, AModelOfTheMatchesPassesAndOneOfMixedUpPhotosDoesNot) {
  const Seen seen = GraphOf(testing::Ring(12));
  calib::SfmModel model = MapGlobally(seen.graph, {}).model;
  ASSERT_EQ(model.images.size(), 12u);
  EXPECT_EQ(WhyContradicted(seen.graph, model), "");
  calib::SfmModel mixed_up = model;
  std::swap(mixed_up.images[1].cam_from_world, mixed_up.images[5].cam_from_world);
  EXPECT_THAT(WhyContradicted(seen.graph, mixed_up), ::testing::HasSubstr("contradict"));
  calib::SfmModel without_points = model;
  without_points.points.clear();
  EXPECT_THAT(WhyContradicted(seen.graph, without_points),
              ::testing::HasSubstr("only 0 % of the matches became points"));
  ViewGraph zoomed = seen.graph;
  zoomed.focal_is_known[0] = 1;
  zoomed.cameras[0].params[0] *= 2.2;
  EXPECT_THAT(WhyContradicted(zoomed, model), ::testing::HasSubstr("camera_per"));
  model.images[0].name = "another.jpg";
  EXPECT_THROW(WhyContradicted(seen.graph, model), std::invalid_argument);
}

TEST(GlobalMapper, APhotoWithoutMatchesIsLeftOutAndNamed) {
  Scene scene = testing::Ring(12);
  Seen seen = GraphOf(scene);
  seen.graph.images.push_back({"other.jpg", 0, {{1, 1}, {2, 2}}});
  const Mapped mapped = MapGlobally(seen.graph, {});
  EXPECT_EQ(mapped.why_not, "");
  EXPECT_EQ(mapped.model.images.size(), 12u);
  ASSERT_EQ(mapped.left_out.size(), 1u);
  EXPECT_EQ(mapped.left_out[0].image, 12);
  EXPECT_THAT(mapped.left_out[0].why, ::testing::HasSubstr("at most 0 matches"));
}

TEST(GlobalMapper, TheNumberOfThreadsDoesNotChangeABit) {
  const ViewGraph graph = GraphOf(testing::Ring(10)).graph;
  const Mapped one = OnThreads(1, [&] { return MapGlobally(graph, {}); });
  const Mapped three = OnThreads(3, [&] { return MapGlobally(graph, {}); });
  ASSERT_EQ(one.model.images.size(), three.model.images.size());
  for (size_t i = 0; i < one.model.images.size(); ++i) {
    const Pose &a = one.model.images[i].cam_from_world, &b = three.model.images[i].cam_from_world;
    EXPECT_TRUE(a.translation == b.translation && a.rotation.coeffs() == b.rotation.coeffs());
  }
  ASSERT_EQ(one.model.points.size(), three.model.points.size());
  for (const auto& [id, point] : one.model.points) {
    EXPECT_EQ(point.p_in_world, three.model.points.at(id).p_in_world);
  }
  EXPECT_EQ(one.model.cameras.at(1).params, three.model.cameras.at(1).params);
}

TEST(GlobalMapper, GraphsThatAreNoneAreRejected) {
  EXPECT_NE(MapGlobally({}, {}).why_not, "");
  const ViewGraph good = GraphOf(testing::Ring(4)).graph;
  const auto rejected = [&](const std::function<void(ViewGraph*)>& spoil) {
    ViewGraph graph = good;
    spoil(&graph);
    EXPECT_THROW(MapGlobally(graph, {}), std::invalid_argument);
  };
  ASSERT_FALSE(good.pairs.empty());
  rejected([](ViewGraph* g) { g->pairs[0].image_b = 4; });
  rejected([](ViewGraph* g) { g->pairs[0].image_a = -1; });
  rejected([](ViewGraph* g) { g->pairs[0].matches[0].first = 1u << 30; });
  rejected([](ViewGraph* g) { g->images[0].camera = 1; });
  rejected([](ViewGraph* g) { g->images[0].pixels[0].x() = std::nan(""); });
  rejected([](ViewGraph* g) { g->cameras[0].params[0] = -1; });
  rejected([](ViewGraph* g) { g->focal_is_known.clear(); });
}

}  // namespace
}  // namespace dtr::sfm
