// tests/cli/small_courtyard.h -- tiny exact photos with a COLMAP model of their true cameras.
#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <string>

namespace dtr::testing {

inline constexpr int kCourtyardViews = 7;
inline constexpr int kCourtyardWidthPx = 192, kCourtyardHeightPx = 128;

/// Makes `folder` with what MakeDataset writes (images/0000.jpg ..., cameras.json, depth/) and
/// sparse/, a COLMAP model of the true cameras and exact points that at least two of them see: a
/// calibration that needs no program to be found. The written world is scale * scene + offset.
void MakeSmallCourtyard(const std::filesystem::path& folder, double scale = 1,
                        const Eigen::Vector3d& offset = Eigen::Vector3d::Zero());

/// Replaces a photo by another picture of the same size.
void ChangePhoto(const std::filesystem::path& photo);

}  // namespace dtr::testing
