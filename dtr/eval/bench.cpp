#include "dtr/eval/bench.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <utility>

#include "dtr/eval/bench_rows.h"

namespace dtr::eval {
namespace {

// The larger number of each line of the report's tables: "2 to 3", "3 to 5", ...
constexpr std::array kReportViews{3, 5, 6, 8, 9, 12, 14};
constexpr std::array kMethods{RenderMethod::kTwoPass, RenderMethod::kDeferred};
constexpr std::array kWeightViews{1, 2, 4, 8};
constexpr std::array kBlends{BlendWeight::kCosine, BlendWeight::kExponential, BlendWeight::kAngle,
                             BlendWeight::kInverseAngle, BlendWeight::kKNearest};

std::vector<RenderOptions> MethodsOf(const BenchOptions& options, int resolution, int views) {
  std::vector<RenderOptions> variants;
  for (const RenderMethod method : kMethods) {
    variants.push_back(options.render);
    variants.back().resolution = resolution;
    variants.back().views = views;
    variants.back().method = method;
    variants.back().fill_holes = variants.back().smooth_edges = false;  // timed apart
  }
  return variants;
}

std::vector<int> ViewsOfRows(const BenchOptions& options, int sources) {
  if (!options.views.empty()) return options.views;
  std::vector<int> views;
  for (const int k : kReportViews) {
    if (k <= sources) views.push_back(k);
  }
  // The report's set of 9 views ends with all of them.
  if (views.empty()) views.push_back(sources);
  return views;
}

std::optional<BenchComparison> Compare(const std::vector<BenchRow>& rows, bool gpu_clock) {
  std::optional<BenchComparison> best;
  const int default_views = RenderOptions{}.views;
  for (size_t i = 0; i + 1 < rows.size(); i += kMethods.size()) {
    const BenchRow &two_pass = rows[i], &deferred = rows[i + 1];
    const auto distance = [&](int views) { return std::abs(views - default_views); };
    if (best && (two_pass.resolution > best->resolution ||
                 (two_pass.resolution == best->resolution &&
                  distance(two_pass.views_used) >= distance(best->views_used)))) {
      continue;
    }
    best = BenchComparison{two_pass.views_used, two_pass.resolution, 0, std::nullopt};
    const auto time = [&](const BenchRow& row) {
      return gpu_clock ? row.frame.median_ms : row.cpu.median_ms;
    };
    best->ratio_two_pass_over_deferred = time(two_pass) / time(deferred);
    best->loss_db = LossDb(two_pass.psnr_db, deferred.psnr_db);
  }
  return best;
}

/// Whether the last pair of rows, of `asked` views, is the last of its resolution.
std::optional<BenchEnd> EndOfRows(const std::vector<BenchRow>& rows, int asked,
                                  const std::vector<RowSums>& sums) {
  const bool for_memory =
      std::any_of(sums.begin(), sums.end(), [](const RowSums& s) { return s.cut(); });
  int fewest = asked;
  for (size_t m = 0; m < kMethods.size(); ++m) {
    fewest = std::min(fewest, rows[rows.size() - 1 - m].views_used);
  }
  if (fewest == asked && !for_memory) return std::nullopt;
  return BenchEnd{rows.back().resolution, fewest, asked, for_memory};
}

std::string NoteOf(const BenchEnd& end) {
  const std::string where = "resolution " + std::to_string(end.resolution) + ": no rows beyond " +
                            std::to_string(end.views_asked) + " views: ";
  return end.for_memory ? "WARNING: " + where + "memory holds only " +
                              std::to_string(end.views_used) + " of them; give `gpu_memory`"
                        : where + "only " + std::to_string(end.views_used) + " are valid here";
}

void Describe(const std::vector<Place>& places, const BenchOptions& options, BenchReport& report) {
  report.views_in_set = static_cast<int>(places.front().scene.views.size());
  report.width_px = places.front().timed.width_px();
  report.height_px = places.front().timed.height_px();
  report.repeats = options.repeats;
  for (const Place& place : places) report.cameras.push_back(place.photo->name);
}

}  // namespace

std::optional<double> LossDb(const std::optional<double>& of_db,
                             const std::optional<double>& against_db) {
  if (!of_db || !against_db) return std::nullopt;
  return *of_db == *against_db ? 0 : *of_db - *against_db;
}

BenchReport MeasureReportTable(const DtrSet& set, const BenchOptions& options,
                               TimedRenderer& renderer, Progress& progress) {
  BenchReport report;
  const std::vector<Place> places = PlacesToCompare(set, options, options.cameras, report.left_out);
  Describe(places, options, report);
  const std::vector<int> views = ViewsOfRows(options, report.views_in_set);
  progress.Stage("bench", static_cast<int>(views.size() * options.resolutions.size()));
  int done = 0;
  for (const int resolution : options.resolutions) {
    for (const int k : views) {
      const std::vector<RenderOptions> variants = MethodsOf(options, resolution, k);
      const auto sums = MeasureRows(places, variants, options.repeats, renderer, progress);
      for (size_t m = 0; m < sums.size(); ++m) report.rows.push_back(sums[m].Mean(variants[m]));
      progress.Update(++done);
      if (const auto end = EndOfRows(report.rows, k, sums)) {
        report.ends.push_back(*end);
        progress.Note(NoteOf(*end));
        break;
      }
    }
  }
  report.comparison = Compare(report.rows, renderer.HasGpuClock());
  return report;
}

BenchReport MeasureWeightTable(const DtrSet& set, const BenchOptions& options,
                               TimedRenderer& renderer, Progress& progress) {
  BenchReport report;
  const std::vector<Place> places = PlacesToCompare(set, options, options.cameras, report.left_out);
  Describe(places, options, report);
  const std::vector<int> views = options.views.empty()
                                     ? std::vector<int>(kWeightViews.begin(), kWeightViews.end())
                                     : options.views;
  progress.Stage("bench", static_cast<int>(views.size() * kBlends.size()));
  int done = 0;
  for (const int k : views) {
    bool ended = false;
    for (const BlendWeight blend : kBlends) {
      std::vector<RenderOptions> variants = MethodsOf(options, options.resolutions.front(), k);
      for (RenderOptions& variant : variants) variant.blend = blend;
      const auto sums = MeasureRows(places, variants, options.repeats, renderer, progress);
      for (size_t m = 0; m < sums.size(); ++m) report.rows.push_back(sums[m].Mean(variants[m]));
      progress.Update(++done);
      if (const auto end = EndOfRows(report.rows, k, sums); end && !std::exchange(ended, true)) {
        report.ends.push_back(*end);
        progress.Note(NoteOf(*end));
      }
    }
    if (ended) break;
  }
  return report;
}

}  // namespace dtr::eval
