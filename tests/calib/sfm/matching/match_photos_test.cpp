#include "calib/sfm/matching/match_photos.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <stdexcept>

#include "tests/calib/sfm/matching/match_world.h"

namespace dtr::sfm {
namespace {

double RotationErrorDeg(const PairGeometry& pair, const Where& a, const Where& b) {
  const Eigen::Matrix3d truth = b.r * a.r.transpose();
  return Eigen::AngleAxisd(truth.transpose() * pair.b_rotation_a).angle() / kRad;
}

double DirectionErrorDeg(const PairGeometry& pair, const Where& a, const Where& b) {
  const Eigen::Vector3d truth = (b.t - b.r * a.r.transpose() * a.t).normalized();
  return std::acos(std::clamp(truth.dot(pair.b_translation_a), -1.0, 1.0)) / kRad;
}

TEST(MatchPhotos, FindsRotationAndDirectionOfAllPairs) {
  const auto photos = Photos(WorldOf(500, 1, false), Camera(kFocalPx));
  const MatchResult result = Match(photos, Camera(kFocalPx), true);
  ASSERT_EQ(result.graph.pairs.size(), 10u);
  for (const PairGeometry& pair : result.graph.pairs) {
    const Where& a = Places()[static_cast<size_t>(pair.image_a)];
    const Where& b = Places()[static_cast<size_t>(pair.image_b)];
    EXPECT_EQ(pair.kind, PairKind::kCalibrated);
    EXPECT_LT(RotationErrorDeg(pair, a, b), 0.15);
    EXPECT_LT(DirectionErrorDeg(pair, a, b), 1.5);
    EXPECT_GT(pair.matches.size(), 100u);
  }
}

// A watermark: features at the same pixels of every photo.
void DrawOver(std::vector<MatchPhoto>& photos, int count) {
  Random random(77);
  const World looks = WorldOf(count, 78, false);
  for (int i = 0; i < count; ++i) {
    const auto x = static_cast<float>(random.Uniform(0, 1000));
    const auto y = static_cast<float>(random.Uniform(0, 750));
    for (MatchPhoto& photo : photos) {
      photo.features.keypoints.push_back({x, y, 2, 0});
      photo.features.descriptors.push_back(Near(looks.looks[static_cast<size_t>(i)], 0.05, random));
    }
  }
}

TEST(MatchPhotos, WhatIsDrawnOverEveryPhotoIsLeftOut) {
  auto photos = Photos(WorldOf(500, 1, false), Camera(kFocalPx));
  std::vector<size_t> of_scene;
  for (const MatchPhoto& photo : photos) of_scene.push_back(photo.features.keypoints.size());
  DrawOver(photos, 500);
  const MatchResult result = Match(photos, Camera(kFocalPx), true);
  ASSERT_EQ(result.notes.size(), 1u);
  EXPECT_NE(result.notes[0].find("in 5 photos, are of features that keep their position"),
            std::string::npos)
      << result.notes[0];
  ASSERT_EQ(result.graph.pairs.size(), 10u);
  for (const PairGeometry& pair : result.graph.pairs) {
    const auto a = static_cast<size_t>(pair.image_a), b = static_cast<size_t>(pair.image_b);
    EXPECT_LT(RotationErrorDeg(pair, Places()[a], Places()[b]), 0.15);
    for (const auto& [i, j] : pair.matches) {
      EXPECT_LT(i, of_scene[a]);
      EXPECT_LT(j, of_scene[b]);
    }
  }
}

TEST(MatchPhotos, TheSceneOfACameraThatStoodStillIsNotLeftOut) {
  const World world = WorldOf(500, 1, false);
  std::vector<MatchPhoto> photos;
  for (std::uint64_t i = 0; i < 5; ++i) {
    photos.push_back(Photo(world, Places()[i < 4 ? 0 : 1], Camera(kFocalPx), 10));
  }
  const MatchResult result = Match(photos, Camera(kFocalPx), true);
  EXPECT_TRUE(result.notes.empty());
  ASSERT_GE(result.graph.pairs.size(), 6u);
  EXPECT_GT(result.graph.pairs[0].matches.size(), 100u);
}

TEST(MatchPhotos, VotesForFocalLengthAndDistortion) {
  for (const double k1 : {0.0, -0.2}) {
    const auto photos = Photos(WorldOf(600, 2, false), Camera(kFocalPx, k1));
    const MatchResult result = Match(photos, Camera(1250), false);
    const calib::LensCamera& voted = result.graph.cameras[0];
    EXPECT_TRUE(result.graph.focal_is_known[0]);
    EXPECT_NEAR(voted.params[0], kFocalPx, 0.02 * kFocalPx);
    EXPECT_NEAR(voted.params[3], k1, 0.03);
    EXPECT_EQ(result.notes.size(), 1u);
  }
}

TEST(MatchPhotos, HoldsAFocalLengthThatTheVoteDoesNotContradict) {
  const auto photos = Photos(WorldOf(500, 2, false), Camera(kFocalPx));
  const double exif_px = 1.03 * kFocalPx;
  const MatchResult held = MatchPhotos(photos, std::vector{Camera(exif_px)}, {true}, {});
  EXPECT_DOUBLE_EQ(held.graph.cameras[0].params[0], exif_px);
  const MatchResult changed = MatchPhotos(photos, std::vector{Camera(2 * kFocalPx)}, {true}, {});
  EXPECT_NEAR(changed.graph.cameras[0].params[0], kFocalPx, 0.02 * kFocalPx);
}

// One homography explains each pair of a plane: any focal length agrees with it.
TEST(MatchPhotos, APlaneHasNoVoteOnTheFocalLength) {
  const auto photos = Photos(WorldOf(600, 9, true), Camera(kFocalPx));
  const MatchResult unknown = Match(photos, Camera(1250), false);
  EXPECT_FALSE(unknown.graph.focal_is_known[0]);
  EXPECT_DOUBLE_EQ(unknown.graph.cameras[0].params[0], 1250);
  ASSERT_EQ(unknown.notes.size(), 1u);
  EXPECT_NE(unknown.notes[0].find("do not determine the focal length"), std::string::npos);
  const MatchResult known = MatchPhotos(photos, std::vector{Camera(1.6 * kFocalPx)}, {true}, {});
  EXPECT_DOUBLE_EQ(known.graph.cameras[0].params[0], 1.6 * kFocalPx);
  EXPECT_TRUE(known.graph.focal_is_known[0]);
}

TEST(MatchPhotos, PhotosWithoutOverlapGiveNoPair) {
  const Where where = At({0, 0, 0}, 0);
  const std::vector<MatchPhoto> photos = {
      Photo(WorldOf(600, 3, false), where, Camera(kFocalPx), 1),
      Photo(WorldOf(600, 4, false), where, Camera(kFocalPx), 2)};
  EXPECT_TRUE(Match(photos, Camera(kFocalPx), true).graph.pairs.empty());
  EXPECT_TRUE(Match(photos, Camera(kFocalPx), false).graph.pairs.empty());
}

TEST(MatchPhotos, ACameraThatOnlyTurnsIsARotation) {
  const World world = WorldOf(600, 5, false);
  const Where a = At({0, 0, 0}, 0), b = At({0, 0, 0}, 9, 4);
  const MatchResult result =
      Match({Photo(world, a, Camera(kFocalPx), 1), Photo(world, b, Camera(kFocalPx), 2)},
            Camera(kFocalPx), true);
  ASSERT_EQ(result.graph.pairs.size(), 1u);
  EXPECT_EQ(result.graph.pairs[0].kind, PairKind::kRotation);
  EXPECT_LT(RotationErrorDeg(result.graph.pairs[0], a, b), 0.05);
  EXPECT_EQ(result.graph.pairs[0].b_translation_a.norm(), 0);
}

TEST(MatchPhotos, APlaneIsSaidToBeOne) {
  const World world = WorldOf(600, 6, true);
  const MatchResult result = Match({Photo(world, Places()[0], Camera(kFocalPx), 1),
                                    Photo(world, Places()[3], Camera(kFocalPx), 2)},
                                   Camera(kFocalPx), true);
  ASSERT_EQ(result.graph.pairs.size(), 1u);
  EXPECT_EQ(result.graph.pairs[0].kind, PairKind::kPlanar);
}

TEST(MatchPhotos, IdenticalPhotosAreARotationByNothing) {
  const MatchPhoto photo = Photo(WorldOf(300, 7, false), At({0, 0, 0}, 0), Camera(kFocalPx), 1);
  const MatchResult result = Match({photo, photo}, Camera(kFocalPx), true);
  ASSERT_EQ(result.graph.pairs.size(), 1u);
  EXPECT_EQ(result.graph.pairs[0].kind, PairKind::kRotation);
  EXPECT_LT(Eigen::AngleAxisd(result.graph.pairs[0].b_rotation_a).angle(), 1e-4);
}

TEST(MatchPhotos, PhotosWithNoOrOneFeatureGetNoPairs) {
  const World world = WorldOf(100, 8, false);
  MatchPhoto none = Photo(world, At({0, 0, 0}, 0), Camera(kFocalPx), 1), one = none;
  none.features = {};
  one.features.keypoints.resize(1);
  one.features.descriptors.resize(1);
  const MatchPhoto full = Photo(world, At({0.5, 0, 0}, 0), Camera(kFocalPx), 2);
  const MatchResult result = Match({none, one, full}, Camera(kFocalPx), false);
  EXPECT_TRUE(result.graph.pairs.empty());
  EXPECT_EQ(result.graph.images.size(), 3u);
  EXPECT_TRUE(Match({}, Camera(kFocalPx), false).graph.images.empty());
}

TEST(MatchPhotos, AnyNumberOfThreadsGivesTheSame) {
  const auto photos = Photos(WorldOf(400, 9, false), Camera(kFocalPx, -0.1));
  const MatchResult one = Match(photos, Camera(1200), false, 1);
  const MatchResult three = Match(photos, Camera(1200), false, 3);
  EXPECT_EQ(one.graph.cameras[0].params, three.graph.cameras[0].params);
  ASSERT_EQ(one.graph.pairs.size(), three.graph.pairs.size());
  for (size_t i = 0; i < one.graph.pairs.size(); ++i) {
    EXPECT_EQ(one.graph.pairs[i].matches, three.graph.pairs[i].matches);
    EXPECT_EQ(one.graph.pairs[i].b_rotation_a, three.graph.pairs[i].b_rotation_a);
    EXPECT_EQ(one.graph.pairs[i].b_translation_a, three.graph.pairs[i].b_translation_a);
  }
}

TEST(MatchPhotos, WhatDoesNotBelongTogetherIsRejected) {
  MatchPhoto photo;
  photo.camera = 1;
  const std::vector cameras = {Camera(kFocalPx)};
  EXPECT_THROW(MatchPhotos(std::vector{photo}, cameras, {true}, {}), std::invalid_argument);
  photo.camera = 0;
  EXPECT_THROW(MatchPhotos(std::vector{photo}, cameras, {}, {}), std::invalid_argument);
  photo.features.keypoints.resize(1);
  EXPECT_THROW(MatchPhotos(std::vector{photo}, cameras, {true}, {}), std::invalid_argument);
}

}  // namespace
}  // namespace dtr::sfm
