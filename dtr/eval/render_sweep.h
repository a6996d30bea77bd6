// dtr/eval/render_sweep.h -- rendering as a stage to sweep: method, K, resolution, weight and the
// tolerances, by what a frame costs and how far it is from a photo.
#pragma once
#include <vector>

#include "dtr/eval/bench_rows.h"
#include "dtr/eval/sweep.h"

namespace dtr::eval {

struct RenderSweepOptions {
  /// `render` is the default setting, `views` and `resolutions` the values to try (empty: ours; the
  /// first is the default), the rest as for the tables.
  BenchOptions bench;
};

/// Rendering of one set with one renderer. Borrows all three, which must outlive it.
///
/// Cost: drawing a frame, by the GPU's clock or else in processor time, median of the repeats, mean
/// over the cameras. Error: 255 * 10^(-PSNR/20) of the mean PSNR over the cameras, whole frame,
/// holes filled and edges smoothed; 1e-6 where every pixel is equal.
class RenderSweep {
 public:
  /// Throws UsageError when no photo is left to compare with.
  RenderSweep(const DtrSet& set, const RenderSweepOptions& options, TimedRenderer& renderer,
              const Progress& progress);

  /// Its functions borrow this object.
  SweepStage Stage() const;
  RenderOptions OptionsOf(const SweepSetting& setting) const;
  /// Names of the photos compared with.
  std::vector<std::string> Cameras() const;

 private:
  bool Applies(const SweepSetting& setting, size_t axis) const;
  SweepMeasurement Measure(const SweepSetting& setting) const;

  RenderSweepOptions options_;
  TimedRenderer& renderer_;
  const Progress& progress_;
  std::vector<Place> places_;
  std::vector<SweepAxis> axes_;
};

/// The error of images of this PSNR, in 8-bit levels.
double RmsLevels(double psnr_db);

}  // namespace dtr::eval
