#include "calib/sfm/matching/lens_vote.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>

#include "calib/sfm/matching/zoom_vote.h"
#include "dtr/base/random.h"

namespace dtr::sfm::matching {
namespace {

constexpr double kFocal = 0.9;         // long sides
constexpr double kNoise = 0.3 / 1600;  // of features

// All pairs of seven photos about a box; of `zoomed`, the photos from the last but two on, the
// focal length is another one. Of a fisheye points lie nearer, so that they are farther off axis.
std::vector<VotePair> Pairs(double zoomed, bool fisheye = false,
                            const Eigen::Vector2d& centre = Eigen::Vector2d::Zero()) {
  constexpr int kPhotos = 7;
  Random random(3);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 80; ++i) {
    const double x = random.Uniform(-3, 3), y = random.Uniform(-2, 2);
    points.emplace_back(x, y, random.Uniform(fisheye ? 1.5 : 5, 10));
  }
  std::vector<Eigen::Matrix3d> rotations;
  std::vector<Eigen::Vector3d> translations;
  for (int i = 0; i < kPhotos; ++i) {
    rotations.push_back((Eigen::AngleAxisd(0.1 * (i - 3), Eigen::Vector3d::UnitY()) *
                         Eigen::AngleAxisd(0.15 * std::sin(2.0 * i), Eigen::Vector3d::UnitX()) *
                         Eigen::AngleAxisd(0.2 * std::cos(3.0 * i), Eigen::Vector3d::UnitZ()))
                            .toRotationMatrix());
    translations.push_back(-(
        rotations.back() * Eigen::Vector3d(0.8 * (i - 3), 0.4 * std::sin(1.0 * i), 0.3 * (i % 2))));
  }
  const auto focal = [&](int photo) { return photo >= kPhotos - 2 ? zoomed : kFocal; };
  std::vector<VotePair> pairs;
  for (int a = 0; a < kPhotos; ++a) {
    for (int b = a + 1; b < kPhotos; ++b) {
      VotePair pair;
      pair.photo_a = a;
      pair.photo_b = b;
      const auto seen = [&](int photo, const Eigen::Vector3d& p) {
        Eigen::Vector2d at = (rotations[photo] * p + translations[photo]).hnormalized();
        if (fisheye) at *= std::atan(at.norm()) / at.norm();
        const double dx = random.Normal();
        return Eigen::Vector2d(focal(photo) * at + centre +
                               kNoise * Eigen::Vector2d(dx, random.Normal()));
      };
      for (const auto& p : points) {
        const Eigen::Vector2d in_a = seen(a, p);
        pair.points.Add(in_a, seen(b, p));
      }
      RelativePose pose;
      pose.r = rotations[b] * rotations[a].transpose();
      pose.t = (translations[b] - pose.r * translations[a]).normalized();
      pair.fundamental = pose.Essential();
      pairs.push_back(pair);
      if (fisheye) continue;
      const Eigen::Vector3d k_a(1 / focal(a), 1 / focal(a), 1), k_b(1 / focal(b), 1 / focal(b), 1);
      pairs.back().fundamental = k_b.asDiagonal() * pose.Essential() * k_a.asDiagonal();
    }
  }
  return pairs;
}

TEST(LensVote, FindsTheFocalLengthWithinItsDeviation) {
  const auto vote = VoteOnLens(Pairs(kFocal), {});
  ASSERT_TRUE(vote);
  EXPECT_LT(std::abs(std::log(vote->lens.focal / kFocal)), 4 * vote->log_focal_deviation);
  EXPECT_LT(vote->log_focal_deviation, 0.01);
}

TEST(LensVote, FindsTheFocalLengthOfAFisheyeWithinItsDeviation) {
  VoteOptions options;
  options.fisheye = true;
  options.prior_focal = 0.4;
  const auto vote = VoteOnLens(Pairs(kFocal, true), options);
  ASSERT_TRUE(vote);
  EXPECT_TRUE(vote->lens.fisheye);
  EXPECT_LT(std::abs(std::log(vote->lens.focal / kFocal)), 4 * vote->log_focal_deviation);
  EXPECT_LT(vote->log_focal_deviation, 0.01);
  EXPECT_NEAR(vote->lens.k1, 0, 0.01);
}

TEST(LensVote, AFisheyesPixelIsItsAngleAndItsMagnificationThatOfThePlane) {
  constexpr double kStep = 1e-6;
  const VoteLens lens{0.4, -0.05, true};
  const Eigen::Vector2d direction(0.6, -0.8);
  const auto at = [&](double angle) {
    return Eigen::Vector2d(lens.focal * angle * (1 + lens.k1 * angle * angle) * direction);
  };
  double magnification = 0;
  const auto point = Unbent(lens, at(1.1), &magnification);
  ASSERT_TRUE(point);
  EXPECT_NEAR((*point - std::tan(1.1) * direction).norm(), 0, 1e-9);
  // Radial and tangential lengths on the plane over those on the photo.
  const double radial = (*Unbent(lens, at(1.1 + kStep), nullptr) - *point).norm() /
                        (at(1.1 + kStep) - at(1.1)).norm();
  const double tangential = std::tan(1.1) / at(1.1).norm();
  EXPECT_NEAR(magnification, std::sqrt(radial * tangential), 1e-4);
  EXPECT_FALSE(Unbent({0.4, 0, true}, 0.4 * 1.5 * direction, nullptr));
}

TEST(LensVote, APrincipalPointOffTheMiddleDoesNotBecomeFocalLength) {
  for (const double side : {-1.0, 1.0}) {
    const auto vote = VoteOnLens(Pairs(kFocal, false, side * Eigen::Vector2d(0.012, -0.01)), {});
    ASSERT_TRUE(vote);
    EXPECT_LT(std::abs(std::log(vote->lens.focal / kFocal)), 3 * vote->log_focal_deviation);
    EXPECT_LT(vote->log_focal_deviation, 0.01);
  }
}

// Matches of one zoomed photo agree with each other as well as any: only that photos differ tells.
TEST(LensVote, ItsDeviationTellsThatPhotosDisagree) {
  const auto agreed = VoteOnLens(Pairs(kFocal), {}), mixed = VoteOnLens(Pairs(1.05 * kFocal), {});
  ASSERT_TRUE(agreed && mixed);
  EXPECT_GT(mixed->log_focal_deviation, 3 * agreed->log_focal_deviation);
  EXPECT_GT(4 * mixed->log_focal_deviation, std::abs(std::log(mixed->lens.focal / kFocal)));
}

// Two of seven photos zoomed, the others not: each gets its own.
TEST(ZoomVote, FindsTheFocalLengthOfEveryPhoto) {
  for (const double zoomed : {0.6 * kFocal, kFocal, 1.33 * kFocal, 2.5 * kFocal}) {
    const auto vote = VoteOnZoom(Pairs(zoomed), {});
    ASSERT_TRUE(vote);
    ASSERT_EQ(vote->photos.size(), 7u);
    for (const auto& [photo, found] : vote->photos) {
      const double right = photo >= 5 ? zoomed : kFocal;
      EXPECT_LT(std::abs(std::log(found.focal / right)), 4 * found.log_deviation) << photo;
      EXPECT_LT(found.log_deviation, 0.01) << photo;
    }
  }
}

// What a vote on one focal length makes of zoomed photos costs far more than what each has by
// itself; of photos of one zoom it costs as much.
TEST(ZoomVote, ACommonFocalLengthOfZoomedPhotosCostsMore) {
  const auto ratio = [](double zoomed) {
    const auto pairs = Pairs(zoomed);
    std::map<int, double> common;
    for (int photo = 0; photo < 7; ++photo) common[photo] = VoteOnLens(pairs, {})->lens.focal;
    return VoteOnZoom(pairs, {})->cost / CostOfFocals(pairs, common, {})->cost;
  };
  EXPECT_LT(ratio(1.33 * kFocal), 0.5);
  EXPECT_GT(ratio(kFocal), 0.97);
}

TEST(LensVote, NoPairsVoteForNothing) {
  EXPECT_FALSE(VoteOnLens({}, {}));
  EXPECT_FALSE(VoteOnZoom({}, {}));
}

}  // namespace
}  // namespace dtr::sfm::matching
