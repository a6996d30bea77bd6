#include "dtr/types/sparse_scene.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace dtr {
namespace {

// Point 0 is seen by views 0 and 1, point 1 by 1 and 2, point 2 by all three.
SparseScene ThreeViews() {
  SparseScene scene;
  for (int i = 0; i < 3; ++i) scene.points.push_back({Eigen::Vector3d(i, 0, 5)});
  scene.observations = {{0, 0, {1, 1}}, {0, 2, {2, 2}}, {1, 0, {3, 3}}, {1, 1, {4, 4}},
                        {1, 2, {5, 5}}, {2, 1, {6, 6}}, {2, 2, {7, 7}}};
  return scene;
}

TEST(RestrictToViews, KeepsPointsThatTwoKeptViewsSee) {
  const SparseScene kept = RestrictToViews(ThreeViews(), {true, true, false});
  ASSERT_EQ(kept.points.size(), 2u);  // point 1 has one kept observation left
  EXPECT_EQ(kept.points[1].p_in_world.x(), 2);
  ASSERT_EQ(kept.observations.size(), 4u);
  for (const SparseObservation& seen : kept.observations) {
    EXPECT_NE(seen.view, 2);
    EXPECT_LT(seen.point, 2);
  }
  EXPECT_EQ(kept.observations.back().pixel.x(), 5);
}

TEST(RestrictToViews, RejectsViewsThatAreNotThere) {
  EXPECT_THROW(RestrictToViews(ThreeViews(), {true, true}), std::invalid_argument);
}

}  // namespace
}  // namespace dtr
