#include "dtr/eval/bench.h"

#include <algorithm>
#include <array>
#include <cstdlib>

#include "dtr/base/error.h"
#include "dtr/eval/metrics.h"
#include "dtr/render/fill_holes.h"

namespace dtr::eval {
namespace {

// The larger number of each line of the report's tables: "2 to 3", "3 to 5", ...
constexpr std::array kReportViews{3, 5, 6, 8, 9, 12, 14};
constexpr std::array kMethods{RenderMethod::kTwoPass, RenderMethod::kDeferred};
// Reading back and filling do not vary with what the GPU does; they are timed a few times only.
constexpr int kTailRepeats = 3;

struct Candidates {
  std::vector<const View*> views;
  bool left_out = false;
};

Candidates PhotosToCompareWith(const DtrSet& set) {
  if (set.frames.empty()) throw Error("bench: the set has no frame");
  Candidates found;
  std::vector<const View*> sources;
  for (const View& view : set.frames.front().views) {
    if (view.image.empty()) continue;
    (view.role == ViewRole::kHeldOut ? found.views : sources).push_back(&view);
  }
  if (!found.views.empty()) return found;
  if (sources.size() < 2) {
    throw UsageError(
        "bench: expected a held-out view, or two source views to leave one out of, found " +
        std::to_string(sources.size()));
  }
  return {std::move(sources), true};
}

std::vector<const View*> EvenlyAmong(const std::vector<const View*>& views, int count) {
  const size_t wanted = std::min(views.size(), static_cast<size_t>(std::max(count, 1)));
  std::vector<const View*> chosen;
  for (size_t i = 0; i < wanted; ++i) {
    chosen.push_back(views[(2 * i + 1) * views.size() / (2 * wanted)]);
  }
  return chosen;
}

/// A camera to look from, the photo it is compared with and the views it is drawn from.
struct Place {
  const View* photo;
  RenderScene scene;
  PinholeCamera timed;
};

RenderOptions OptionsOf(const BenchOptions& options, int resolution, int views,
                        RenderMethod method) {
  RenderOptions render = options.render;
  render.resolution = resolution;
  render.views = views;
  render.method = method;
  render.fill_holes = false;
  return render;
}

/// Sums of a row over the cameras; Mean() divides.
class RowSums {
 public:
  void AddTimes(const FrameTimes& frame, const FrameTimes& read_back, const FrameTimes& fill) {
    ++cameras_;
    Add(frame.Frame(), row_.frame);
    Add(frame.Cpu(), row_.cpu);
    Add(read_back.Frame(), row_.read_back);
    Add(read_back.Cpu(), row_.read_back_cpu);
    Add(fill.Frame(), row_.fill);
    Add(fill.Cpu(), row_.fill_cpu);
  }
  void AddQuality(const View& photo, const RenderResult& filled) {
    Add(Psnr(filled.image, photo.image, photo.mask), row_.psnr_db, psnr_count_);
    Add(Psnr(filled.image, photo.image, Intersect(filled.coverage, photo.mask)),
        row_.psnr_covered_db, psnr_covered_count_);
    row_.coverage += ShareOf(filled.coverage, photo.mask);
    row_.views_used = std::max(row_.views_used, static_cast<int>(filled.views_used.size()));
  }
  BenchRow Mean(RenderMethod method, int resolution) const {
    BenchRow row = row_;
    row.method = method;
    row.resolution = resolution;
    for (Times* times :
         {&row.frame, &row.cpu, &row.read_back, &row.read_back_cpu, &row.fill, &row.fill_cpu}) {
      times->median_ms /= cameras_;
      times->spread_ms /= cameras_;
    }
    if (row.psnr_db) *row.psnr_db /= psnr_count_;
    if (row.psnr_covered_db) *row.psnr_covered_db /= psnr_covered_count_;
    row.coverage /= cameras_;
    return row;
  }

 private:
  static void Add(const Times& times, Times& sum) {
    sum.median_ms += times.median_ms;
    sum.spread_ms += times.spread_ms;
  }
  static void Add(const std::optional<double>& value, std::optional<double>& sum, int& count) {
    if (!value) return;
    sum = sum.value_or(0) + *value;
    ++count;
  }
  BenchRow row_;
  int cameras_ = 0, psnr_count_ = 0, psnr_covered_count_ = 0;
};

/// All methods at one place with one resolution and number of views.
void Measure(const Place& place, const BenchOptions& options, int resolution, int views,
             TimedRenderer& renderer, std::array<RowSums, kMethods.size()>& sums) {
  const Pose& pose = place.photo->cam_from_world;
  std::array<FrameTimes, kMethods.size()> frames, read_backs, fills;
  std::array<RenderOptions, kMethods.size()> render;
  const auto fill = [&](size_t m, const PinholeCamera& camera, RenderResult& result) {
    FillHolesFromViews(place.scene, camera, pose, render[m], result);
  };
  for (size_t m = 0; m < kMethods.size(); ++m) {
    render[m] = OptionsOf(options, resolution, views, kMethods[m]);
    // Untimed: shaders are compiled and meshes made. Its picture serves the quality.
    renderer.Draw(place.scene, place.photo->camera, pose, render[m]);
    RenderResult result = renderer.ReadBack();
    fill(m, place.photo->camera, result);
    sums[m].AddQuality(*place.photo, result);
    renderer.Draw(place.scene, place.timed, pose, render[m]);
  }
  for (int repeat = 0; repeat < options.repeats; ++repeat) {
    for (size_t m = 0; m < kMethods.size(); ++m) {
      frames[m].Add(renderer.Draw(place.scene, place.timed, pose, render[m]));
      if (repeat >= kTailRepeats) continue;
      const StopWatch reading;
      RenderResult result = renderer.ReadBack();
      read_backs[m].Add(reading.Elapsed());
      const StopWatch filling;
      fill(m, place.timed, result);
      fills[m].Add(filling.Elapsed());
    }
  }
  for (size_t m = 0; m < kMethods.size(); ++m) {
    sums[m].AddTimes(frames[m], read_backs[m], fills[m]);
  }
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
    if (two_pass.psnr_db && deferred.psnr_db) best->loss_db = *two_pass.psnr_db - *deferred.psnr_db;
  }
  return best;
}

}  // namespace

BenchReport MeasureReportTable(const DtrSet& set, const BenchOptions& options,
                               TimedRenderer& renderer, Progress& progress) {
  const Candidates candidates = PhotosToCompareWith(set);
  std::vector<Place> places;
  for (const View* photo : EvenlyAmong(candidates.views, options.cameras)) {
    std::vector<std::string> excluded;
    if (candidates.left_out) excluded.push_back(photo->id);
    places.push_back({photo, MakeRenderScene(set, excluded),
                      options.timed_camera ? options.timed_camera(photo->camera) : photo->camera});
  }
  BenchReport report;
  report.views_in_set = static_cast<int>(places.front().scene.views.size());
  report.width_px = places.front().timed.width_px();
  report.height_px = places.front().timed.height_px();
  report.repeats = options.repeats;
  report.left_out = candidates.left_out;
  for (const Place& place : places) report.cameras.push_back(place.photo->name);

  const std::vector<int> views = ViewsOfRows(options, report.views_in_set);
  progress.Stage("bench", static_cast<int>(views.size() * options.resolutions.size()));
  int done = 0;
  for (const int resolution : options.resolutions) {
    for (const int k : views) {
      std::array<RowSums, kMethods.size()> sums;
      for (const Place& place : places) {
        progress.ThrowIfInterrupted();
        Measure(place, options, resolution, k, renderer, sums);
      }
      for (size_t m = 0; m < kMethods.size(); ++m) {
        report.rows.push_back(sums[m].Mean(kMethods[m], resolution));
      }
      progress.Update(++done);
      if (report.rows.back().views_used < k) break;  // more views are not valid here
    }
  }
  report.comparison = Compare(report.rows, renderer.HasGpuClock());
  return report;
}

}  // namespace dtr::eval
