// LLFF files are made from COLMAP models; where both are there, they must say the same.
#include <gtest/gtest.h>

#include "calib/colmap/model_io.h"
#include "dtr/io/formats/llff.h"
#include "tests/support/test_data.h"

namespace dtr::io {
namespace {

TEST(Llff, PosesAreThoseOfTheColmapModelTheyWereMadeFrom) {
  const auto folder = testing::DataFolder() / "beer_colmap_model";
  DTR_REQUIRE_DATA(folder);
  const calib::SfmModel model = colmap::ReadModel(folder / "sparse/0");
  std::vector<SizedImage> images;
  for (const calib::SfmImage& image : model.images) images.push_back({image.name, 720, 1280});
  const CameraList list = ReadLlff(folder / "poses_bounds.npy", images).list;
  ASSERT_EQ(list.cameras.size(), 71u);
  constexpr double kSame = 1e-12;  // both are doubles of one run
  for (size_t i = 0; i < list.cameras.size(); ++i) {
    const Pose& found = list.cameras[i].cam_from_world;
    const Pose& expected = model.images[i].cam_from_world;
    EXPECT_EQ(list.cameras[i].name, model.images[i].name);
    EXPECT_LT((found.TargetOriginInSource() - expected.TargetOriginInSource()).norm(), kSame) << i;
    EXPECT_LT((found.rotation.toRotationMatrix() - expected.rotation.toRotationMatrix()).norm(),
              kSame)
        << i;
  }
}

}  // namespace
}  // namespace dtr::io
