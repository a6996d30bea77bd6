// dtr/eval/bench.h -- frames a second and what they are worth: time and truth side by side.
#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/eval/timed_renderer.h"
#include "dtr/render/options.h"
#include "dtr/types/dtr_set.h"

namespace dtr::eval {

struct BenchOptions {
  RenderOptions render;    ///< method, views, resolution and fill_holes are those of the rows
  std::vector<int> views;  ///< K of the rows, rising; empty: those of the founding report's tables
  std::vector<int> resolutions = {1, 2};
  int repeats = 10;  ///< timed frames per row and camera, after one that is not counted
  int cameras = 2;   ///< novel cameras, evenly among those that can be compared with a photo
  /// The camera to time, made from the photo's; empty: the photo's. Quality is always measured at
  /// the photo's own.
  std::function<PinholeCamera(const PinholeCamera&)> timed_camera;
};

/// One line of a table; times are means over the cameras of the medians over the repeats.
struct BenchRow {
  RenderMethod method = RenderMethod::kTwoPass;
  BlendWeight blend = BlendWeight::kInverseAngle;
  int resolution = 1;
  int views_used = 0;  ///< valid views that took part: K, or what there is
  Times frame, cpu;    ///< drawing alone
  Times read_back, read_back_cpu, fill, fill_cpu;
  std::optional<double> psnr_db;          ///< against the photo, whole, finished frame
  std::optional<double> psnr_covered_db;  ///< where some view saw the pixel
  double coverage = 0;
  double fps() const { return 1000 / frame.median_ms; }
  /// With everything an image on disk needs: drawn, read back, filled.
  double whole_ms() const { return frame.median_ms + read_back.median_ms + fill.median_ms; }
  double whole_cpu_ms() const {
    return cpu.median_ms + read_back_cpu.median_ms + fill_cpu.median_ms;
  }
};

/// PSNR of one less that of another, 0 where both are infinite: both equal the photos.
std::optional<double> LossDb(const std::optional<double>& of_db,
                             const std::optional<double>& against_db);

/// The two methods under equal conditions: the row pair of the finest resolution with the number of
/// views nearest to the default.
struct BenchComparison {
  int views_used = 0, resolution = 1;
  double ratio_two_pass_over_deferred = 0;  ///< of frame times: GPU clock, else processor time
  std::optional<double> loss_db;            ///< PSNR of two-pass less that of deferred
};

/// Why a resolution has no rows of more views.
struct BenchEnd {
  int resolution = 1;
  int views_used = 0, views_asked = 0;  ///< of its last row
  bool for_memory = false;  ///< the renderer's memory held no more; else no more were valid
};

struct BenchReport {
  int views_in_set = 0, width_px = 0, height_px = 0, repeats = 0;
  bool left_out = false;             ///< photos compared with were left out of the set's sources
  std::vector<std::string> cameras;  ///< names of the photos compared with
  std::vector<BenchRow> rows;        ///< by resolution, views, method (two-pass first)
  std::vector<BenchEnd> ends;        ///< of each resolution whose rows end early
  std::optional<BenchComparison> comparison;
};

/// The founding report's tables (section 2.8): frames a second by the number of views used and the
/// resolution, here of both methods. Novel cameras are held-out photos, else source photos left out
/// in turn. The methods take turns, so that what else the machine does meets both alike. Rows of a
/// resolution end where a method draws fewer views than asked for, which `ends` and a note tell.
/// `set` must be loaded with images, depth and held-out views. Throws UsageError when no photo is
/// left to compare with, and what the renderer throws.
BenchReport MeasureReportTable(const DtrSet& set, const BenchOptions& options,
                               TimedRenderer& renderer, Progress& progress);

/// Every weight (SPEC 4.5, with the parameters of options.render) with both methods and K views,
/// {1, 2, 4, 8} by default, at the first resolution: rows by K, weight, method. Photos, turns,
/// times, ends and errors as MeasureReportTable; there is no comparison.
BenchReport MeasureWeightTable(const DtrSet& set, const BenchOptions& options,
                               TimedRenderer& renderer, Progress& progress);

}  // namespace dtr::eval
