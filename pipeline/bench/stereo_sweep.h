// pipeline/bench/stereo_sweep.h -- the depth stage of a set with frozen cameras as a stage
// to sweep: engine, preset and image size, by what `dtr stereo` takes and what its depth maps are
// worth.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/eval/held_out.h"
#include "dtr/eval/sweep.h"
#include "pipeline/core/depth_settings.h"

namespace dtr::pipeline {

struct StereoSweepOptions {
  std::filesystem::path set;
  std::filesystem::path work;   ///< existing folder for the sets made; each is removed after use
  std::filesystem::path truth;  ///< of EvaluateDepth; empty: images alone are evaluated
  /// Long sides of the images to try, the first the default; 0 and what is larger: as they are.
  /// Empty: as they are, seven tenths, half.
  std::vector<int> max_sizes_px;
  RenderOptions render;
  /// Called for every measurement, as renderers may remember views by their addresses.
  std::function<eval::RenderFunction()> make_renderer;
  std::uint64_t seed = 0;
};

/// Cost: processor seconds of RecomputeDepth, which is what `dtr stereo` does; images of another
/// size are made before (area averages, as in `dtr build`). Error: with truth the share of true
/// pixels without a depth within 1 %, else RMS levels of held-out photos (of source views left out
/// in turn where there are none), which are always compared at their own size. Figure
/// `build_cpu_s`, where the set records what its calibration took: the cost, and all that `dtr
/// build` spent on other stages.
class StereoSweep {
 public:
  /// Throws Error for a broken set, UsageError for one without source views.
  StereoSweep(StereoSweepOptions options, Progress& progress);
  eval::SweepStage Stage() const;  ///< its functions borrow this object

 private:
  eval::SweepMeasurement Measure(const eval::SweepSetting& setting) const;

  StereoSweepOptions options_;
  Progress& progress_;
  std::vector<eval::SweepAxis> axes_;
  std::optional<double> other_stages_s_;  ///< processor time of the build but for depth
};

/// Writes a copy of a set, without depth, whose source images have at most this long side; held-out
/// photos keep theirs. Throws as SetWriter does.
void WriteResized(const std::filesystem::path& from, const std::filesystem::path& to,
                  int max_size_px, Progress& progress);

}  // namespace dtr::pipeline
