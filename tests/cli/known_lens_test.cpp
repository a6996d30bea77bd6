// `dtr calibrate photos --lens`: intrinsics of another size, in time.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "dtr/base/files.h"
#include "tests/cli/compared_with_plaza.h"

namespace dtr::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kFocalPx = 373.335;  // of photos of 480 x 320 px, as the file of the case has it

class KnownLens : public ::testing::Test {
 protected:
  // A lens of these photos at another size, as ROS writes one.
  std::string Lens(int width, int height, double focal, const std::string& coefficients) {
    const fs::path file = folder_ / "lens.yaml";
    WriteFileAtomically(
        file, fmt::format("image_width: {}\nimage_height: {}\ncamera_name: cam\ncamera_matrix:\n"
                          "  rows: 3\n  cols: 3\n  data: [{}, 0.0, {}, 0.0, {}, {}, 0.0, 0.0, 1.0]\n"
                          "distortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n"
                          "  cols: 5\n  data: [{}]\n",
                          width, height, focal, width / 2.0 - 0.5, focal, height / 2.0 - 0.5,
                          coefficients));
    return file.string();
  }
  Ran Calibrate(const fs::path& photos, const std::string& lens) {
    return Dtr({"calibrate", "photos", photos.string(), "--lens", lens, "-o",
                (folder_ / "model").string()});
  }
  TemporaryFolder folder_;
};

TEST_F(KnownLens, OfAnotherSizeIsScaledAndHoldsFromTheFirstMatchOn) {
  const fs::path field = FieldCase("lens_late_and_scale");
  DTR_REQUIRE_DATA(field);
  const Ran ran = Calibrate(field / "photos", (field / "lens.yaml").string());
  ASSERT_EQ(ran.code, 0) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("--lens: intrinsics of 960 x 640 px are scaled to 480 x 320 px"));
  EXPECT_THAT(ran.err, Not(HasSubstr("focal length")));  // no vote
  const calib::SfmModel model = colmap::ReadModel(folder_ / "model");
  EXPECT_EQ(model.images.size(), 3u);
  ASSERT_EQ(model.cameras.size(), 1u);
  const calib::LensCamera& camera = model.cameras.begin()->second;
  EXPECT_EQ(camera.width_px, 480);
  EXPECT_NEAR(camera.params[0], kFocalPx, 1e-6);
  EXPECT_NEAR(camera.params[2], 240, 1e-6);
}

// k3 makes it a model that mapping does not adjust; then its photos must be those of such a lens:
// of plaza's it explains the matches worse, but all the same.
TEST_F(KnownLens, OfAModelThatIsNotAdjustedHoldsToo) {
  const fs::path field = FieldCase("lens_late_and_scale");
  DTR_REQUIRE_DATA(field);
  const Ran ran = Calibrate(field / "photos", Lens(960, 640, 746.67, "0.0, 0.0, 0.0, 0.0, 1e-4"));
  ASSERT_EQ(ran.code, 0) << ran.err;
  const calib::SfmModel model = colmap::ReadModel(folder_ / "model");
  EXPECT_EQ(model.images.size(), 3u);
  const calib::LensCamera& camera = model.cameras.begin()->second;
  EXPECT_EQ(camera.model, calib::CameraModel::kFullOpenCv);
  EXPECT_NEAR(camera.params[0], kFocalPx, 1e-6);
  EXPECT_NEAR(camera.params[8], 1e-4, 1e-12);
}

TEST_F(KnownLens, OfAnotherShapeIsRejectedBeforeAnyWork) {
  const fs::path field = FieldCase("lens_late_and_scale");
  DTR_REQUIRE_DATA(field);
  const auto rejected = [&](const std::string& lens, const std::string& why) {
    const Ran ran = Calibrate(field / "photos", lens);
    ExpectRejected(ran, kFailed, why);
    EXPECT_THAT(ran.err, HasSubstr("0004.jpg, which has 480 x 320 px"));
    EXPECT_THAT(ran.err, Not(HasSubstr("== features")));
  };
  rejected(Lens(1280, 720, 900, "0.0, 0.0, 0.0, 0.0, 0.0"),
           "another aspect ratio, so it was cropped or is of another camera; give the intrinsics of "
           "these photos");
  rejected(Lens(640, 960, 900, "0.0, 0.0, 0.0, 0.0, 0.0"),
           "it was rotated; give photos as the camera stored them");
}

}  // namespace
}  // namespace dtr::testing
