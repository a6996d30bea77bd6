// One folder per camera through COLMAP: intrinsics are those of each camera.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "calib/colmap/model_io.h"
#include "dtr/base/process.h"
#include "tests/cli/run_dtr.h"
#include "tests/support/test_data.h"

namespace dtr::testing {
namespace {

// Measured: 420.3 and 300.4; COLMAP does not repeat itself exactly.
constexpr double kFocalPx = 3;

TEST(FolderCamerasThroughColmap, TwoCamerasWithoutExifInTwoFoldersGetIntrinsicsOfTheirOwn) {
  const auto photos = DataFolder() / "field" / "lens_per_folder" / "photos";
  DTR_REQUIRE_DATA(photos);
  if (FindProgram("colmap").empty()) GTEST_SKIP() << "SKIPPED: colmap is absent";
  const TemporaryFolder folder;
  const Ran ran = DtrOk({"calibrate", "photos", photos, "-o", folder / "model", "--feature-size",
                         "480", "--features", "1500", "--json", folder / "report.json"});
  const calib::SfmModel model = colmap::ReadModel(folder / "model");
  EXPECT_EQ(model.images.size(), 14u);
  for (const calib::SfmImage& image : model.images) {
    const double truth_px = image.name.rfind("cam0/", 0) == 0 ? 420 : 300;
    EXPECT_NEAR(model.cameras.at(image.camera_id).params[0], truth_px, kFocalPx) << image.name;
  }
  const auto json = nlohmann::json::parse(Text(folder / "report.json"));
  const auto& test = json.at("camera_sharing").at("tests").at(0);
  EXPECT_EQ(test.at("cameras").size(), 2u);
  EXPECT_LT(test.at("separate_px"), 0.8 * test.at("shared_px").get<double>());
  EXPECT_NE((ran.out + ran.err).find("14 photos in 2 folders: separate intrinsics per folder"),
            std::string::npos);
}

}  // namespace
}  // namespace dtr::testing
