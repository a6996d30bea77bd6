// SPEC 4.8: how far an image is from a view's own.
#include "dtr/render/frame.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace dtr {
namespace {

/// Looks along z from x to the right of the origin; the scene centre is 10 before the origin.
View At(double x, const PinholeCamera& camera) {
  View view;
  view.camera = camera;
  view.cam_from_world.translation = {-x, 0, 0};
  return view;
}

const PinholeCamera kCamera(96, 72, 100, 100, 48, 36);
const Eigen::Vector3d kCentre(0, 0, 10);

TEST(CornersMovedPx, IsZeroAtTheViewsOwnPlaceWhateverTheSizeOfTheImage) {
  const View view = At(3, kCamera);
  EXPECT_NEAR(CornersMovedPx(view, kCamera, view.cam_from_world, kCentre), 0, 1e-12);
  EXPECT_NEAR(CornersMovedPx(view, kCamera.Resized(48, 36), view.cam_from_world, kCentre), 0,
              1e-12);
}

TEST(CornersMovedPx, CountsMotionTurningAndAWiderImage) {
  const View view = At(0.1, kCamera);
  EXPECT_NEAR(CornersMovedPx(view, kCamera, Pose(), kCentre), 1, 1e-9);  // 100 * 0.1 / 10
  const Pose turned{Eigen::Quaterniond(Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitY())),
                    Eigen::Vector3d::Zero()};
  const double moved = CornersMovedPx(At(0, kCamera), kCamera, turned, kCentre);
  EXPECT_GT(moved, 1);  // 100 * 0.01 in the middle, more towards the corners
  EXPECT_LT(moved, 1.5);
  const PinholeCamera wider(106, 72, 100, 100, 53, 36);
  EXPECT_NEAR(CornersMovedPx(At(0, kCamera), wider, Pose(), kCentre), 5, 1e-9);
}

TEST(CornersMovedPx, IsInfiniteWhereTheViewLooksTheOtherWay) {
  View view = At(0, kCamera);
  view.cam_from_world.rotation = Eigen::AngleAxisd(3.14, Eigen::Vector3d::UnitY());
  EXPECT_EQ(CornersMovedPx(view, kCamera, Pose(), kCentre),
            std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace dtr
