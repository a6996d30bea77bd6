#include "pipeline/build/detail/build_options.h"

#include <fmt/format.h>

#include "capture/video/frames.h"
#include "dtr/base/error.h"
#include "pipeline/build/capture.h"

namespace dtr::pipeline {

BuildOptions ByPreset(BuildOptions options) {
  const Preset& preset = PresetCalled(options.depth.preset);
  if (options.max_size_px < 0) options.max_size_px = preset.max_size_px;
  if (options.sfm.features == 0 && options.poses.empty()) options.sfm.features = preset.features;
  if (options.sfm.features == 0) options.sfm.features = MaxFeaturesOf(options.sfm.engine);
  return options;
}

void RequireOptions(const BuildOptions& options) {
  if (options.holdout_strict && (options.holdout.empty() || !options.poses.empty())) {
    throw UsageError(
        "`holdout_strict`: keeps the photos of `holdout` out of SfM; it needs `holdout` and "
        "no `poses`");
  }
  if (options.metres.any() && (!options.poses.empty() || !options.rig.empty() || !options.refine)) {
    throw UsageError(
        "`gps`, `distance`: constrain the bundle adjustment of what SfM finds; expected no "
        "`poses`, `rig` or `no_refine` beside them (dtr calibrate scale takes any finished set)");
  }
  if (options.sfm.camera_per != CameraPer::kAuto &&
      (!options.poses.empty() || !options.rig.empty())) {
    throw UsageError(
        "`camera_per`: says which photos share intrinsics that SfM finds; those of `poses` and "
        "`rig` are known; leave out one of them");
  }
  const bool from_video = !VideosFor(options.photos, options.video).empty();
  if (from_video && options.metres.gps) {
    throw UsageError(
        "`gps`: expected photos, which say where they were taken, found a video; give `distance` "
        "or use dtr calibrate scale");
  }
  if (options.refine_poses && options.poses.empty()) {
    throw UsageError(
        "`refine`: adjusts the cameras of `poses`; expected `poses` (cameras that SfM finds are "
        "adjusted without it)");
  }
  if (options.rig.empty()) return;
  if (!options.poses.empty()) {
    throw UsageError("`rig`: sets the poses of what SfM finds; expected no `poses` beside it");
  }
  if (!options.refine) {
    throw UsageError("`rig`: is bundle adjustment; expected no `no_refine` beside it");
  }
  if (!from_video) return;
  if (!options.video.synchronised) {
    throw UsageError(
        "`rig`: needs frames taken at the same times; expected `synchronised` for videos");
  }
  if (std::filesystem::exists(options.photos / "timestamps.csv")) {
    throw UsageError(fmt::format(
        "`rig` {}: expected videos whose frames of equal number are taken at one time, found {}, "
        "which says which are; give photos, one folder per camera, of equal names",
        options.rig.string(), (options.photos / "timestamps.csv").string()));
  }
}

void RequirePanoramaOptions(const BuildOptions& options) {
  const auto reject = [](bool given, const char* what) {
    if (given) {
      throw UsageError(std::string("the photos are panoramas, whose views are a rig with known "
                                   "intrinsics: ") +
                       what);
    }
  };
  reject(!options.rig.empty(), "leave out `rig`");
  reject(!options.refine, "leave out `no_refine`");
  reject(options.sfm.camera_per != CameraPer::kAuto, "leave out `camera_per`");
  reject(
      options.metres.any(),
      "leave out `gps` and `distance`; dtr calibrate scale takes the finished set, with the folder "
      "of the panoramas or with distances");
  reject(options.sfm.engine == sfm::SfmEngine::kColmap,
         "COLMAP 3.8 cannot hold one; use `sfm` auto or global");
}

}  // namespace dtr::pipeline
