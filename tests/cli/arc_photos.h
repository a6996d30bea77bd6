// tests/cli/arc_photos.h -- photos that COLMAP can register.
#pragma once
#include <filesystem>

namespace dtr::testing {

inline constexpr int kArcPhotos = 9;

/// Makes `folder`/images/0000.jpg ... 0008.jpg, 480x320 px (the smallest at which SIFT finds enough
/// here), taken along an arc, with what else MakeDataset writes. `noise`: standard deviation of
/// sensor noise, of 255.
void MakeArcPhotos(const std::filesystem::path& folder, double noise = 0);

}  // namespace dtr::testing
