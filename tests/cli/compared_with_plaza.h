// tests/cli/compared_with_plaza.h -- cameras that were found of photos of the synthetic `plaza`,
// against its own.
#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <vector>

#include "calib/colmap/model_io.h"
#include "calib/similarity.h"
#include "tests/cli/run_dtr.h"
#include "tests/support/test_data.h"

namespace dtr::testing {

inline std::filesystem::path Plaza() { return DataFolder() / "plaza"; }
inline std::filesystem::path FieldCase(const std::string& name) {
  return DataFolder() / "field" / name;
}

/// RMS distance of the cameras from where they are, after the best similarity, over the RMS
/// distance of these from their mean.
inline double PositionsOff(const calib::SfmModel& model) {
  const calib::SfmModel truth = colmap::ReadModel(Plaza() / "sparse");
  std::vector<Eigen::Vector3d> found, right;
  for (const calib::SfmImage& image : model.images) {
    for (const calib::SfmImage& own : truth.images) {
      if (own.name != image.name) continue;
      found.push_back(image.cam_from_world.TargetOriginInSource());
      right.push_back(own.cam_from_world.TargetOriginInSource());
    }
  }
  EXPECT_EQ(found.size(), model.images.size());
  const calib::Similarity aligned = calib::AlignPoints(found, right);
  const Eigen::Vector3d mean = calib::MeanOf(right);
  double spread = 0;
  for (const Eigen::Vector3d& p : right) {
    spread += (p - mean).squaredNorm() / static_cast<double>(right.size());
  }
  return calib::AlignmentRms(aligned, found, right) / std::sqrt(spread);
}

}  // namespace dtr::testing
