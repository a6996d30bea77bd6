#include "dtr/advise/advise.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <stdexcept>

#include "datasets/exact/analytic_scene.h"
#include "dtr/advise/look.h"
#include "dtr/advise/places.h"
#include "tests/support/on_threads.h"

namespace dtr::advise {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::Photograph;
using testing::Plane;
using testing::Square;
using testing::Surface;

constexpr double kWallZ = 10;

// Cameras at these places on the x axis, all looking along z, 51 degrees wide.
std::vector<CoarseView> Row(const Surface& surface, const std::vector<double>& places) {
  std::vector<CoarseView> views;
  for (size_t i = 0; i < places.size(); ++i) {
    testing::Shot shot;
    shot.id = fmt::format("{:02}", i);
    shot.cam_from_world.translation = {-places[i], 0, 0};
    views.push_back(MakeCoarse(Photograph(surface, shot), kCoarseSidePx));
  }
  return views;
}

Advice AdviseOn(const std::vector<CoarseView>& views, const AdviseOptions& options = {}) {
  SilentProgress progress;
  return Advise(views, options, progress);
}

Place PlaceCalled(const Advice& advice, const std::string& where) {
  for (const Place& place : advice.places) {
    if (place.where == where) return place;
  }
  throw std::out_of_range(where);
}

TEST(VisibilityOf, KnowsSeenHiddenBeyondAndNothing) {
  const auto views = Row(Square(0, 0, kWallZ, 2), {0});
  const CoarseView& view = views[0];
  EXPECT_EQ(VisibilityOf(view, {0, 0, kWallZ}, 0.03), Visibility::kSeen);
  EXPECT_EQ(VisibilityOf(view, {0, 0, 1.2 * kWallZ}, 0.03), Visibility::kHidden);
  EXPECT_EQ(VisibilityOf(view, {0, 0, 0.8 * kWallZ}, 0.03), Visibility::kBeyond);
  EXPECT_EQ(VisibilityOf(view, {3.5, 0, kWallZ}, 0.03), Visibility::kNothing);
  EXPECT_EQ(VisibilityOf(view, {30, 0, kWallZ}, 0.03), Visibility::kOutside);
  EXPECT_EQ(VisibilityOf(view, {0, 0, -1}, 0.03), Visibility::kOutside);
}

TEST(Advise, AnglesAreThoseOfTheWorld) {
  // Half-way between two cameras 2 apart, each wall point is seen from 1 further left or right.
  const auto views = Row(Plane({0, 0, 1}, kWallZ), {0, 2});
  const Advice advice = AdviseOn(views);
  const Place between = PlaceCalled(advice, "between 00 and 01");
  EXPECT_NEAR(between.seen_share, 1, 1e-12);
  EXPECT_NEAR(between.gap_deg, std::atan(1 / kWallZ) * 180 / std::numbers::pi, 0.2);
  EXPECT_FALSE(between.poor);
  // A whole step beyond the last camera half a step's width of the wall was seen by nobody.
  const Place beyond = PlaceCalled(advice, "beyond 01, away from 00");
  EXPECT_NEAR(beyond.unseen_share, 1 / (kWallZ * 0.96), 0.015);
  EXPECT_NEAR(beyond.cam_from_world.TargetOriginInSource().x(), 3, 1e-12);
}

TEST(Advise, ADenseRowNeedsNoCameraBetween) {
  const auto views = Row(Plane({0, 0, 1}, kWallZ), {0, 1, 2, 3, 4, 5, 6});
  const Advice advice = AdviseOn(views, {.max_unseen = 0.1});
  for (const Place& place : advice.places) EXPECT_FALSE(place.poor) << place.where;
  EXPECT_THAT(advice.add, IsEmpty());
}

TEST(Advise, AsksForACameraWhereOneIsMissing) {
  const auto views = Row(Plane({0, 0, 1}, kWallZ), {0, 1, 2, 8, 9, 10});
  const Advice advice = AdviseOn(views, {.max_unseen = 0.1});
  ASSERT_FALSE(advice.add.empty());
  const Place& first = advice.places[advice.add[0].place];
  const double x = first.cam_from_world.TargetOriginInSource().x();
  EXPECT_TRUE(x > 2 && x < 8) << first.where;
  EXPECT_GT(advice.add[0].poor_before, advice.add[0].poor_after);
}

TEST(Advise, SkyIsNotWhatACameraCouldMend) {
  // Only the lower half of the images has a surface.
  const auto views = Row(Square(0, 50, kWallZ, 50), {0, 1, 2, 3});
  for (const Place& place : AdviseOn(views).places) {
    if (place.where.starts_with("beyond")) continue;
    EXPECT_NEAR(place.depthless_share, 0.5, 0.03) << place.where;
    EXPECT_LT(place.unseen_share, 0.03);  // by the cameras that stay
    EXPECT_FALSE(place.poor);
  }
}

TEST(Advise, WhatAPillarHidesFromEverybodyIsUnseen) {
  const Surface scene = testing::Union(Plane({0, 0, 1}, kWallZ), Square(0, 0, 2, 0.5));
  const auto views = Row(scene, {-0.2, 0.2});
  const Advice advice = AdviseOn(views);
  // The shadow on the wall that both cameras cannot see, from 1.5 to the right of them.
  Place aside{"aside", views[0].camera, Pose{}};
  aside.cam_from_world.translation = {-1.5, 0, 0};
  const Look look = LookFrom(aside, views);
  Measure(look, {}, aside);
  // Of the 9.6 x 7.2 of the wall that it sees: both images end 1.3 before its own, and the
  // shadows of the pillar share 3.4 x 5.
  EXPECT_NEAR(aside.unseen_share, 1.3 / 9.6 + 3.4 * 5 / (9.6 * 7.2), 0.02);
  EXPECT_LT(aside.depthless_share, 0.02);
}

TEST(Advise, CamerasThatAddNothingMayGoTogether) {
  const auto views = Row(Plane({0, 0, 1}, kWallZ), {0, 0.01, 0.02, 0.03, 4, 4.01});
  const Advice advice = AdviseOn(views, {.redundant_share = 0.98});
  ASSERT_EQ(advice.redundant.size(), 4u) << "one of each cluster stays";
  for (const Redundant& view : advice.redundant) EXPECT_GE(view.covered_share, 0.98);
  const Advice strict = AdviseOn(Row(Plane({0, 0, 1}, kWallZ), {0, 4}), {});
  EXPECT_THAT(strict.redundant, IsEmpty());
}

// Two rows of cameras that stand close, and a gap between them: what is asked for lies between
// cameras that stay, and is measured by them.
TEST(Advise, AsksForNoCameraBetweenTwoThatAddNothing) {
  const auto views = Row(Plane({0, 0, 1}, kWallZ), {0, 0.01, 0.02, 8, 8.01, 8.02});
  const Advice advice = AdviseOn(views, {.redundant_share = 0.98});
  ASSERT_FALSE(advice.redundant.empty());
  ASSERT_FALSE(advice.add.empty());
  for (const Redundant& gone : advice.redundant) {
    for (const Place& place : advice.places) {
      EXPECT_THAT(place.where, ::testing::Not(HasSubstr(gone.name)));
    }
  }
  EXPECT_THAT(advice.places[advice.add.front().place].where, HasSubstr("between"));
}

TEST(WhyPoor, NamesTheLimitsThatAPlaceMissesAndNoOther) {
  Place place;
  place.unseen_share = 0.01, place.gap_deg = 16.4;
  EXPECT_EQ(WhyPoor(place, {}), "what it sees is up to 16 degrees from the nearest photo");
  place.unseen_share = 0.12;
  EXPECT_EQ(
      WhyPoor(place, {}),
      "12 % of what it sees is in no photo, what it sees is up to 16 degrees from the nearest "
      "photo");
  place.gap_deg = 3;
  EXPECT_EQ(WhyPoor(place, {}), "12 % of what it sees is in no photo");
  place.unseen_share = 0;
  EXPECT_EQ(WhyPoor(place, {}), "");
}

TEST(Advise, IsTheSameForAnyNumberOfThreads) {
  const auto views = Row(Plane({0, 0, 1}, kWallZ), {0, 1, 2, 8, 9, 10});
  const Advice one = OnThreads(1, [&] { return AdviseOn(views, {}); });
  const Advice three = OnThreads(3, [&] { return AdviseOn(views, {}); });
  ASSERT_EQ(one.places.size(), three.places.size());
  for (size_t i = 0; i < one.places.size(); ++i) {
    EXPECT_EQ(one.places[i].gap_deg, three.places[i].gap_deg);
    EXPECT_EQ(one.places[i].unseen_share, three.places[i].unseen_share);
  }
  ASSERT_EQ(one.add.size(), three.add.size());
  for (size_t i = 0; i < one.add.size(); ++i) EXPECT_EQ(one.add[i].place, three.add[i].place);
}

TEST(Advise, RejectsALoneViewAndBearsViewsWithoutDepth) {
  EXPECT_THROW(AdviseOn(Row(Plane({0, 0, 1}, kWallZ), {0})), std::invalid_argument);
  const Advice blind = AdviseOn(Row(Square(0, 0, -5, 1), {0, 1, 1}));
  for (const Place& place : blind.places) {
    EXPECT_EQ(place.seen_share, 0);
    EXPECT_TRUE(std::isfinite(place.gap_deg));
  }
  EXPECT_THAT(blind.redundant, IsEmpty());
}

}  // namespace
}  // namespace dtr::advise
