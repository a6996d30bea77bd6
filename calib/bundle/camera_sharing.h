// calib/bundle/camera_sharing.h -- may cameras of a model share their intrinsics? Held-out
// observations decide.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "calib/sfm_model.h"
#include "dtr/base/progress.h"

namespace dtr::calib {

struct SharingOptions {
  std::uint64_t seed = 0;              ///< of the points that are held out
  const Progress* progress = nullptr;  ///< asked whether to stop
};

struct SharedCameras {
  SfmModel model;  ///< with the cameras that share merged, under the lowest id of each group
  /// Camera ids of the model that was given; each group shares intrinsics. Sorted.
  std::vector<std::vector<std::uint32_t>> groups;
  /// Root mean Cauchy loss over points that cameras were not adjusted to: one camera for all, and
  /// one each; the 95 % bootstrap interval of the difference of the means (one each less one for
  /// all), px^2.
  double shared_px = 0, separate_px = 0, low_px2 = 0, high_px2 = 0;
  bool shared_converged = false;
  std::string not_tested;  ///< why cameras were left separate untested; empty: they were tested
};

/// Intrinsics are shared by as many of `cameras` (ids of cameras with images, of one model and
/// size) as held-out observations allow: cameras and poses are adjusted to half of the points and
/// tried on the other half, and the other way round. Separate intrinsics must explain points that
/// were held out better beyond chance (the bootstrap interval) and by 1 %. One camera for all is
/// tested first, then, for up to kMaxPairwise cameras, one for each two that are nearest in focal
/// length. At most 4000 points take part. Deterministic for any number of threads.
/// Throws Interrupted where `progress` asks for it.
SharedCameras ShareCameras(const SfmModel& model, std::vector<std::uint32_t> cameras,
                           const SharingOptions& options);

inline constexpr size_t kMaxPairwise = 12;

}  // namespace dtr::calib
