#include "dtr/render/opening_view.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

namespace dtr {
namespace {

using Eigen::Vector3d;

double SpanOf(const std::vector<Vector3d>& centers) {
  std::vector<View> views(centers.size());
  std::vector<const View*> pointers;
  for (size_t i = 0; i < centers.size(); ++i) {
    views[i].cam_from_world.translation = -centers[i];
    pointers.push_back(&views[i]);
  }
  return CameraSpan(pointers, Vector3d::Zero());
}

std::vector<Vector3d> Ring(int count, double elevation_rad) {
  std::vector<Vector3d> centers;
  for (int i = 0; i < count; ++i) {
    const double azimuth = 2 * std::numbers::pi * i / count;
    centers.push_back(7 * Vector3d(std::cos(elevation_rad) * std::cos(azimuth),
                                   std::cos(elevation_rad) * std::sin(azimuth),
                                   std::sin(elevation_rad)));
  }
  return centers;
}

TEST(CameraSpan, IsTheAngleOfAnArcAndThatOfAllSidesForARing) {
  EXPECT_EQ(SpanOf({}), 0);
  EXPECT_EQ(SpanOf({{1, 2, 3}}), 0);
  EXPECT_EQ(SpanOf({{1, 2, 3}, {0, 0, 0}}), 0) << "a camera at the centre has no direction";
  EXPECT_NEAR(SpanOf({{-1, 0, 10}, {1, 0, 10}}), 2 * std::atan(0.1), 1e-9);
  EXPECT_EQ(SpanOf({{-1, 0, 0}, {1, 0, 0}}), std::numbers::pi);
  for (const int count : {4, 5, 24}) {
    EXPECT_EQ(SpanOf(Ring(count, 0)), std::numbers::pi);
    EXPECT_EQ(SpanOf(Ring(count, 45 * std::numbers::pi / 180)), std::numbers::pi);
    EXPECT_NEAR(SpanOf(Ring(count, 80 * std::numbers::pi / 180)), 20 * std::numbers::pi / 180,
                1e-9);
  }
}

TEST(CameraSpan, OneCameraApartFromManyDoesNotCount) {
  std::vector<Vector3d> centers(30, Vector3d(0, 0, 10));
  for (size_t i = 0; i < centers.size(); ++i) centers[i].x() = 0.01 * static_cast<double>(i);
  const double span = SpanOf(centers);
  centers.emplace_back(10, 0, 0);
  EXPECT_NEAR(SpanOf(centers), span, 0.1);
}

}  // namespace
}  // namespace dtr
