#include "stereo/complete/complete.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "datasets/exact/analytic_scene.h"
#include "stereo/complete/expand.h"
#include "stereo/complete/outline_planes.h"
#include "tests/support/on_threads.h"

namespace dtr::stereo {
namespace {

using namespace dtr::testing;

constexpr float kFarZ = 1000;

/// Clouds, infinitely far.
void PaintSky(View& view) {
  for (int y = 0; y < view.depth.height(); ++y) {
    for (int x = 0; x < view.depth.width(); ++x) {
      if (view.depth(x, y) > 0) continue;
      const Eigen::Vector3d direction =
          view.cam_from_world.rotation.conjugate() * view.camera.RayFromPixel({x + 0.5, y + 0.5});
      const Eigen::Vector3d colour = SmoothColour(direction.normalized(), 0.3);
      for (int c = 0; c < 3; ++c) {
        view.image(x, y, c) = static_cast<std::uint8_t>(180 + 0.2 * colour[c]);
      }
    }
  }
}

/// Five cameras in a row before a wall that stands on the ground (y is down); above it is sky.
struct Row {
  static constexpr double kWallZ = 8, kTop = -1.2, kGround = 1;

  Row() {
    const Surface wall = [](const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
      const double t = Plane({0, 0, 1}, kWallZ)(o, d);
      return t < kNoHit && (o + t * d).y() > kTop ? t : kNoHit;
    };
    const Surface scene = Union(wall, Plane({0, 1, 0}, kGround));
    for (int i = 0; i < 5; ++i) {
      Shot shot;
      shot.id = "view" + std::to_string(i);
      shot.camera = PinholeCamera(160, 120, 150, 150, 80, 60);
      const double x = 0.5 * (i - 2);
      shot.cam_from_world = LookAt({x, 0, 0}, {0.3 * x, 0, kWallZ});
      shot.texture_period = 0.9;
      View view = Photograph(scene, shot);
      view.reference_baseline = 0.5;
      truth.push_back(view.depth);
      PaintSky(view);
      views.push_back(view);
      std::vector<int> others;
      for (int n = 0; n < 5; ++n) {
        if (n != i) others.push_back(n);
      }
      neighbours.push_back(others);
    }
  }

  /// A rectangle of every view loses its depth.
  void Hide(int x0, int y0, int x1, int y1) {
    for (View& view : views) {
      for (int y = y0; y < y1; ++y) {
        for (int x = x0; x < x1; ++x) view.depth(x, y) = 0;
      }
    }
  }

  /// A black letter L stands before the wall. Of its depth the top of the upright stroke is
  /// measured, down to y = `measured_to`.
  void PutBefore(double measured_to = -0.5) {
    constexpr double kZ = 5;
    for (size_t i = 0; i < views.size(); ++i) {
      View& view = views[i];
      const Eigen::Vector3d eye = view.CenterInWorld();
      for (int y = 0; y < view.depth.height(); ++y) {
        for (int x = 0; x < view.depth.width(); ++x) {
          const Eigen::Vector3d direction = view.cam_from_world.rotation.conjugate() *
                                            view.camera.RayFromPixel({x + 0.5, y + 0.5});
          const Eigen::Vector3d p = eye + (kZ - eye.z()) / direction.z() * direction;
          const bool upright = p.x() > -1 && p.x() < -0.5 && p.y() > -0.8 && p.y() < 0.8;
          const bool foot = p.x() > -1 && p.x() < 1 && p.y() > 0.4 && p.y() < 0.8;
          if (!upright && !foot) continue;
          for (int c = 0; c < 3; ++c) view.image(x, y, c) = 20;
          truth[i](x, y) = static_cast<float>((view.cam_from_world * p).z());
          view.depth(x, y) = p.y() < measured_to ? truth[i](x, y) : 0;
        }
      }
    }
  }

  std::vector<DepthImage> Completed(int threads, bool with_scene_planes = true) const {
    const ThreadLimit limit(threads);
    std::vector<CellView> cells;
    for (const View& view : views) cells.push_back(MakeCells(view));
    SilentProgress silent;
    std::vector<ScenePlane> planes;
    if (with_scene_planes) planes = PlanesToChoose(cells, neighbours);
    const auto completed = CompleteCells(cells, neighbours, planes, 2, silent);
    std::vector<DepthImage> depths;
    for (size_t i = 0; i < views.size(); ++i) {
      depths.push_back(ExpandCells(views[i], cells[i], completed[i], kFarZ));
    }
    return depths;
  }

  /// Share of the pixels that lost their depth that is within 2 % of the truth.
  double ShareRight(const std::vector<DepthImage>& completed) const {
    int right = 0, all = 0;
    for (size_t i = 0; i < views.size(); ++i) {
      for (int y = 0; y < truth[i].height(); ++y) {
        for (int x = 0; x < truth[i].width(); ++x) {
          if (views[i].depth(x, y) > 0 || !(truth[i](x, y) > 0)) continue;
          ++all;
          right += std::abs(completed[i](x, y) / truth[i](x, y) - 1) < 0.02F;
        }
      }
    }
    return static_cast<double>(right) / all;
  }

  std::vector<View> views;
  std::vector<DepthImage> truth;
  std::vector<std::vector<int>> neighbours;
};

TEST(CompleteDepth, AHoleInAWallIsWall) {
  Row row;
  row.Hide(50, 55, 110, 70);
  EXPECT_GT(row.ShareRight(row.Completed(1)), 0.97);
}

TEST(CompleteDepth, GroundOfWhichNothingWasMeasuredIsFound) {
  Row row;
  row.Hide(0, 85, 160, 120);
  EXPECT_GT(row.ShareRight(row.Completed(1)), 0.9);
}

// Whatever direction one looks in from its foot, the wall is measured first: by directions alone 41
// % are right.
TEST(CompleteDepth, ASurfaceWithoutTextureGoesOnToItsOutline) {
  Row row;
  row.PutBefore();
  EXPECT_GT(row.ShareRight(row.Completed(1, false)), 0.75);
}

// Nothing is measured of the letter; the wall is, all around it.
TEST(OutlinePlanes, ASurfaceWithoutTextureLiesWhereItsOutlineIsOneInAllViews) {
  Row row;
  row.PutBefore(-1);
  std::vector<CellView> cells;
  for (const View& view : row.views) cells.push_back(MakeCells(view));
  const std::vector<const CellView*> others = {&cells[0], &cells[1], &cells[3], &cells[4]};
  const Grid<float> planes = OutlinePlanes(cells[2], others, {});
  int right = 0, letter = 0;
  for (int y = 0; y < cells[2].colour.height(); ++y) {
    for (int x = 0; x < cells[2].colour.width(); ++x) {
      if (cells[2].colour(x, y, 0) > 25 || cells[2].inverse_depth(x, y) > 0) continue;
      ++letter;
      const ViewPlane plane(planes(x, y, 0), planes(x, y, 1), planes(x, y, 2));
      const float z = row.truth[2](x * cells[2].cell_px, y * cells[2].cell_px);
      right += std::abs(plane.dot(cells[2].RayOf(x, y)) * z - 1) < 0.05F;
    }
  }
  ASSERT_GT(letter, 500);
  EXPECT_GT(right, 0.9 * letter);
}

TEST(CompleteDepth, SkyIsFar) {
  const Row row;
  const std::vector<DepthImage> completed = row.Completed(1);
  int far = 0, sky = 0;
  for (size_t i = 0; i < row.views.size(); ++i) {
    for (int y = 0; y < 25; ++y) {
      for (int x = 0; x < 160; ++x) {
        if (row.truth[i](x, y) > 0) continue;
        ++sky;
        far += completed[i](x, y) == kFarZ;
      }
    }
  }
  ASSERT_GT(sky, 1000);
  EXPECT_GT(far, 0.9 * sky);
}

TEST(CompleteDepth, WhatWasMeasuredOrIsMaskedGetsNone) {
  Row row;
  row.Hide(50, 55, 110, 70);
  View& view = row.views[2];
  view.mask = Mask(160, 120, 1, 255);
  for (int x = 60; x < 80; ++x) view.mask(x, 60) = 0;
  const DepthImage completed = row.Completed(1)[2];
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) {
      if (view.depth(x, y) > 0 || view.mask(x, y) == 0) {
        ASSERT_EQ(completed(x, y), 0) << x << " " << y;
      }
    }
  }
}

TEST(CompleteDepth, DoesNotDependOnThreads) {
  Row row;
  row.Hide(0, 70, 160, 120);
  EXPECT_EQ(row.Completed(1), row.Completed(4));
}

TEST(CompleteDepth, OneViewAndAViewWithoutDepthAreNoTrouble) {
  Row row;
  row.Hide(50, 55, 110, 70);
  row.views.resize(1), row.truth.resize(1);
  row.neighbours = {{}};
  EXPECT_NO_THROW(row.Completed(1));
  Row without;
  without.views[1].depth = DepthImage(160, 120);
  EXPECT_GT(without.ShareRight(without.Completed(1)), 0.8);
}

}  // namespace
}  // namespace dtr::stereo
