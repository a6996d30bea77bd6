// Which photos the hard sets consist of.
#include <cmath>
#include <functional>
#include <numbers>

#include "datasets/hard/hard_scenes.h"
#include "datasets/hard/hard_sets.h"
#include "datasets/layout.h"

namespace dtr::datasets {
namespace {

using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kEyeHeight = 1.5;
constexpr double kTele = 50;  // mm, where the others have 28

std::vector<HardPhoto> Photos(int count, const std::function<Pose(int)>& pose_of) {
  std::vector<HardPhoto> photos(static_cast<size_t>(count));
  for (int i = 0; i < count; ++i) photos[static_cast<size_t>(i)].cam_from_world = pose_of(i);
  return photos;
}

// Some of a layout's poses.
std::vector<HardPhoto> Some(const std::vector<Pose>& poses, const std::vector<int>& which) {
  return Photos(static_cast<int>(which.size()),
                [&](int i) { return poses[static_cast<size_t>(which[static_cast<size_t>(i)])]; });
}

std::vector<HardPhoto> All(const std::vector<Pose>& poses) {
  return Photos(static_cast<int>(poses.size()),
                [&](int i) { return poses[static_cast<size_t>(i)]; });
}

std::vector<HardPhoto> WithoutExif(std::vector<HardPhoto> photos) {
  for (HardPhoto& photo : photos) photo.has_exif = false;
  return photos;
}

std::vector<HardPhoto> WithExif(std::vector<HardPhoto> photos, double factor) {
  for (HardPhoto& photo : photos) photo.exif_factor = factor;
  return photos;
}

// Three of them with a longer focal length.
std::vector<HardPhoto> Zoomed(std::vector<HardPhoto> photos) {
  for (const size_t i : {size_t{1}, size_t{4}, size_t{6}}) photos[i].focal_35mm = kTele;
  return photos;
}

// Those three by another camera, whose images are square.
std::vector<HardPhoto> Mixed(std::vector<HardPhoto> photos) {
  for (HardPhoto& photo : photos = Zoomed(std::move(photos))) {
    if (photo.focal_35mm == kTele) photo.width_px = photo.height_px = 400;
  }
  return photos;
}

// A small wave, another one per axis.
Vector3d Bob(int i) { return {std::sin(2.3 * i), std::cos(1.7 * i), std::sin(3.1 * i)}; }

Pose Turned(int i, const Vector3d& eye, double up) {
  const double angle = 12 * kDegree * i;
  return LookAt(eye, eye + Vector3d(std::sin(angle), std::cos(angle), up));
}

Pose Turned(int i, const Vector3d& eye) { return Turned(i, eye, 0.05 * std::sin(3.0 * i)); }

void AddWalks(const std::shared_ptr<const Scene>& yard, std::vector<HardSet>& sets) {
  sets.push_back(
      {"straight_walk", "sideways on a straight line, parallel axes", yard, Photos(8, [](int i) {
         const Vector3d eye(-3.5 + i, -8, 1.7);
         return LookAt(eye, eye + Vector3d(0.15, 1, 0));
       })});
  sets.push_back({"forward_walk", "straight ahead along the axis", yard, Photos(8, [](int i) {
                    const Vector3d eye(0.3, -9 + 0.8 * i, 1.7);
                    return LookAt(eye, eye + Vector3d(0.05, 1, 0.02));
                  })});
}

void AddRotations(const std::shared_ptr<const Scene>& room, std::vector<HardSet>& sets) {
  const Vector3d eye(0, 0, kEyeHeight);
  sets.push_back({"pure_rotation", "turned about one point", room,
                  Photos(8, [&](int i) { return Turned(i, eye); })});
  sets.push_back({"near_rotation", "turned, moved by 1 % of the distance", room,
                  Photos(8, [&](int i) { return Turned(i, eye + 0.03 * Bob(i)); })});
  auto photos = Photos(7, [&](int i) { return Turned(i, eye, 0.05); });
  HardPhoto aside;
  const Vector3d from(0.5, -0.3, kEyeHeight);
  aside.cam_from_world = LookAt(from, from + Vector3d(0.4, 1, 0.05));
  photos.push_back(aside);
  sets.push_back({"rotation_plus_one", "turned about one point, one photo from aside", room,
                  std::move(photos)});
}

void AddWalls(const std::shared_ptr<const Scene>& plane, std::vector<HardSet>& sets) {
  const auto arc = MakeLayout(*plane, "arc", 8);
  sets.push_back({"wall", "nothing but a plane", plane, All(arc)});
  sets.push_back({"wall_no_exif", "a plane, without EXIF", plane, WithoutExif(All(arc))});
  sets.push_back({"wall_straight", "a plane, straight walk, without EXIF", plane,
                  WithoutExif(Photos(7, [](int i) {
                    const Vector3d eye(-2.4 + 0.8 * i, -6, 0.2);
                    return LookAt(eye, eye + Vector3d(0, 1, 0));
                  }))});
}

void AddStairs(const std::shared_ptr<const Scene>& stairs, std::vector<HardSet>& sets) {
  const auto arc = MakeLayout(*stairs, "arc", 8);
  const auto add = [&](const char* name, const char* what, std::vector<HardPhoto> photos) {
    sets.push_back({name, what, stairs, std::move(photos)});
  };
  const auto two = Some(arc, {2, 4}), three = Some(arc, {1, 3, 5}), all = All(arc);
  add("two_views", "two photos", two);
  add("three_views", "three photos", three);
  add("two_no_exif", "two photos without EXIF", WithoutExif(two));
  add("three_no_exif", "three photos without EXIF", WithoutExif(three));
  add("exif_16", "EXIF's focal length 1.6 times too long", WithExif(all, 1.6));
  add("exif_06", "EXIF's focal length 1.6 times too short", WithExif(all, 1 / 1.6));
  auto spoilt = all;
  spoilt[2].blur_px = 5;
  spoilt[5].gain = 0.03;
  spoilt[6].blur_px = 12;
  add("blur_dark", "two photos blurred by motion, one dark", std::move(spoilt));
  add("mixed_focal", "two cameras of other focal lengths", Mixed(all));
  add("mixed_no_exif", "two cameras, without EXIF", WithoutExif(Mixed(all)));
  add("zoom_same_size", "a zoom lens at two settings, without EXIF", WithoutExif(Zoomed(all)));
  add("identical", "one photo four times", Some(arc, {0, 0, 0, 0}));
  add("duplicates", "two of four photos twice", Some(arc, {0, 2, 4, 4, 6, 6}));
}

void AddClusters(const std::shared_ptr<const Scene>& yard, std::vector<HardSet>& sets) {
  auto photos = Photos(8, [](int i) {
    const double k = i % 4;
    return i < 4 ? LookAt({-6 + 0.7 * k, -4, 1.6}, {-8 + 0.2 * k, 9, 2})
                 : LookAt({3.5 + 0.7 * k, -4, 1.7}, {8 - 0.2 * k, 9, 2});
  });
  sets.push_back(
      {"two_clusters", "two groups of photos that show nothing in common", yard, photos});
  photos[3].cam_from_world = LookAt({-3.0, -5, 1.6}, {-2.5, 9, 2});
  photos[4].cam_from_world = LookAt({2.5, -5, 1.7}, {2.5, 9, 2});
  sets.push_back({"clusters_joined", "two groups joined by one pair", yard, std::move(photos)});
}

void AddRepetitions(std::vector<HardSet>& sets) {
  const auto street = std::make_shared<const Scene>(HardStreet());
  const auto walk = Photos(10, [](int i) {
    const Vector3d eye(-5 + 10.0 * i / 9, -4.5, 1.6 + 0.1 * std::sin(2.0 * i));
    return LookAt(eye, {eye.x() + 0.1 * std::sin(3.0 * i), 0, 1.5});
  });
  sets.push_back({"street_alike", "two equal facades side by side", street, walk});
  std::vector<HardPhoto> gap;
  for (const size_t i : {0, 1, 2, 7, 8, 9}) gap.push_back(walk[i]);
  sets.push_back(
      {"street_alike_gap", "two equal facades, nothing between seen", street, std::move(gap)});
  const auto ring = Photos(18, [](int i) {
    const double angle = 20 * kDegree * i;
    return LookAt(Vector3d(6 * std::sin(angle), -6 * std::cos(angle), 2) + 0.12 * Bob(i),
                  Vector3d(0, 0, 1.3));
  });
  sets.push_back({"ring_alike", "around a house whose opposite sides are equal",
                  std::make_shared<const Scene>(HardHouse(true)), ring});
  sets.push_back({"ring_alike_floor", "the same on a paved floor",
                  std::make_shared<const Scene>(HardHouse(false)), ring});
}

}  // namespace

std::vector<HardSet> HardSets() {
  constexpr std::uint64_t kSeed = 1;
  const auto scene = [](const char* name) {
    return std::make_shared<const Scene>(MakeScene(name, kSeed));
  };
  const auto yard = scene("courtyard");
  std::vector<HardSet> sets;
  AddWalks(yard, sets);
  AddRotations(scene("room"), sets);
  AddWalls(scene("plane"), sets);
  AddStairs(scene("stairs"), sets);
  AddClusters(yard, sets);
  AddRepetitions(sets);
  return sets;
}

}  // namespace dtr::datasets
