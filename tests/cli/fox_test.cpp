// Fifty photos of a phone in front of papered walls, without EXIF (`fox_refused`): planes leave two
// poses of a pair, and patterns repeat.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "tests/cli/compared_with_plaza.h"

namespace dtr::testing {
namespace {

using Eigen::Vector3d;
using nlohmann::json;

// The published camera centres by the names of the photos; more photos than the case has.
std::map<std::string, Vector3d> CentresOf(const json& transforms) {
  std::map<std::string, Vector3d> centres;
  for (const json& frame : transforms.at("frames")) {
    const std::string file = frame.at("file_path");
    Vector3d centre;
    for (size_t axis = 0; axis < 3; ++axis) {
      centre[static_cast<Eigen::Index>(axis)] = frame.at("transform_matrix").at(axis).at(3);
    }
    centres[file.substr(file.rfind('/') + 1)] = centre;
  }
  return centres;
}

TEST(Fox, EveryPhotoGetsItsPublishedCameraFromOurOwnMapper) {
  const auto field = FieldCase("fox_refused");
  DTR_REQUIRE_DATA(field);
  const TemporaryFolder folder;
  const std::string output = (folder / "cal").string();
  const Ran ran = DtrOk(
      {"calibrate", "photos", (field / "images").string(), "-o", output, "--features", "4096"});
  EXPECT_EQ(ran.err.find("COLMAP's mapper"), std::string::npos) << ran.err;
  const json transforms = json::parse(Text(field / "transforms_published.json"));
  const auto published = CentresOf(transforms);
  const calib::SfmModel model = colmap::ReadModel(output);
  EXPECT_EQ(model.images.size(), 50u);
  ASSERT_EQ(model.cameras.size(), 1u);
  const double focal_px = model.cameras.begin()->second.params[0];
  EXPECT_NEAR(focal_px, transforms.at("fl_x").get<double>(), 0.005 * focal_px);

  std::vector<Vector3d> found, right;
  Vector3d mean = Vector3d::Zero();
  for (const calib::SfmImage& image : model.images) {
    found.push_back(image.cam_from_world.TargetOriginInSource());
    right.push_back(published.at(image.name));
    mean += right.back() / static_cast<double>(model.images.size());
  }
  double spread = 0;
  for (const Vector3d& centre : right) spread += (centre - mean).squaredNorm();
  spread = std::sqrt(spread / static_cast<double>(right.size()));
  const calib::Similarity aligned = calib::AlignPoints(found, right);
  EXPECT_LT(calib::AlignmentRms(aligned, found, right), 0.005 * spread);  // measured: 0.0015
}

}  // namespace
}  // namespace dtr::testing
