// dtr/eval/bench_rows.h -- what rows of all tables have in common: where they look from, and how a
// row is measured. Internal to dtr/eval.
#pragma once
#include <optional>
#include <vector>

#include "dtr/eval/bench.h"

namespace dtr::eval {

/// A camera to look from, the photo it is compared with and the views it is drawn from.
struct Place {
  const View* photo;
  RenderScene scene;
  PinholeCamera timed;
};

/// `count` photos evenly among those that can be compared with (held-out ones, else source photos,
/// each left out of its own scene). Throws Error and UsageError as MeasureReportTable.
std::vector<Place> PlacesToCompare(const DtrSet& set, const BenchOptions& options, int count,
                                   bool& left_out);

/// Sums of a row over the places; Mean() divides.
class RowSums {
 public:
  void AddTimes(const FrameTimes& frame, const FrameTimes& read_back, const FrameTimes& fill);
  /// `valid`: views that were to be drawn (SPEC 1.2).
  void AddQuality(const View& photo, const RenderResult& filled, int valid);
  /// Some image was drawn from fewer views than are valid: the renderer had no room for them.
  bool cut() const { return cut_; }
  BenchRow Mean(const RenderOptions& options) const;

 private:
  BenchRow row_;
  bool cut_ = false;
  int cameras_ = 0, psnr_count_ = 0, psnr_covered_count_ = 0;
};

/// One row for each of `variants` (fill_holes is not looked at), measured at all places. Variants
/// take turns frame by frame, so that what else the machine does meets all alike.
std::vector<RowSums> MeasureRows(const std::vector<Place>& places,
                                 const std::vector<RenderOptions>& variants, int repeats,
                                 TimedRenderer& renderer, const Progress& progress);

}  // namespace dtr::eval
