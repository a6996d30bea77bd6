#include "dtr/eval/bench_rows.h"

#include <algorithm>

#include "dtr/base/error.h"
#include "dtr/eval/metrics.h"
#include "dtr/render/finish_image.h"
#include "dtr/render/valid_views.h"

namespace dtr::eval {
namespace {

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

void Add(const Times& times, Times& sum) {
  sum.median_ms += times.median_ms;
  sum.spread_ms += times.spread_ms;
  sum.min_ms += times.min_ms;
  sum.max_ms += times.max_ms;
}

void Add(const std::optional<double>& value, std::optional<double>& sum, int& count) {
  if (!value) return;
  sum = sum.value_or(0) + *value;
  ++count;
}

void Measure(const Place& place, const std::vector<RenderOptions>& variants, int repeats,
             TimedRenderer& renderer, std::vector<RowSums>& sums) {
  const Pose& pose = place.photo->cam_from_world;
  const size_t count = variants.size();
  const auto finish = [&](const PinholeCamera& camera, RenderOptions options,
                          RenderResult& result) {
    options.fill_holes = options.smooth_edges = true;
    FinishImage(place.scene, camera, pose, options, result);
  };
  std::vector<FrameTimes> frames(count), read_backs(count), fills(count);
  for (size_t m = 0; m < count; ++m) {
    // Untimed: shaders are compiled and meshes made. Its image serves the quality.
    renderer.Draw(place.scene, place.photo->camera, pose, variants[m]);
    RenderResult result = renderer.ReadBack();
    finish(place.photo->camera, variants[m], result);
    const auto valid = static_cast<int>(SelectViews(place.scene, pose, variants[m]).views.size());
    sums[m].AddQuality(*place.photo, result, valid);
    if (!(place.timed == place.photo->camera)) {
      renderer.Draw(place.scene, place.timed, pose, variants[m]);
    }
  }
  for (int repeat = 0; repeat < repeats; ++repeat) {
    for (size_t m = 0; m < count; ++m) {
      frames[m].Add(renderer.Draw(place.scene, place.timed, pose, variants[m]));
      if (repeat >= kTailRepeats) continue;
      const StopWatch reading;
      RenderResult result = renderer.ReadBack();
      read_backs[m].Add(reading.Elapsed());
      const StopWatch filling;
      finish(place.timed, variants[m], result);
      fills[m].Add(filling.Elapsed());
    }
  }
  for (size_t m = 0; m < count; ++m) sums[m].AddTimes(frames[m], read_backs[m], fills[m]);
}

}  // namespace

std::vector<Place> PlacesToCompare(const DtrSet& set, const BenchOptions& options, int count,
                                   bool& left_out) {
  const Candidates candidates = PhotosToCompareWith(set);
  left_out = candidates.left_out;
  std::vector<Place> places;
  for (const View* photo : EvenlyAmong(candidates.views, count)) {
    std::vector<std::string> excluded;
    if (left_out) excluded.push_back(photo->id);
    places.push_back({photo, MakeRenderScene(set, excluded),
                      options.timed_camera ? options.timed_camera(photo->camera) : photo->camera});
  }
  return places;
}

void RowSums::AddTimes(const FrameTimes& frame, const FrameTimes& read_back,
                       const FrameTimes& fill) {
  ++cameras_;
  Add(frame.Frame(), row_.frame);
  Add(frame.Cpu(), row_.cpu);
  Add(read_back.Frame(), row_.read_back);
  Add(read_back.Cpu(), row_.read_back_cpu);
  Add(fill.Frame(), row_.fill);
  Add(fill.Cpu(), row_.fill_cpu);
}

void RowSums::AddQuality(const View& photo, const RenderResult& filled, int valid) {
  const auto drawn = static_cast<int>(filled.views_used.size());
  cut_ = cut_ || drawn < valid;
  Add(Psnr(filled.image, photo.image, photo.mask), row_.psnr_db, psnr_count_);
  Add(Psnr(filled.image, photo.image, Intersect(filled.coverage, photo.mask)), row_.psnr_covered_db,
      psnr_covered_count_);
  row_.coverage += ShareOf(filled.coverage, photo.mask);
  row_.views_used = std::max(row_.views_used, drawn);
}

BenchRow RowSums::Mean(const RenderOptions& options) const {
  BenchRow row = row_;
  row.method = options.method;
  row.blend = options.blend;
  row.resolution = options.resolution;
  for (Times* times :
       {&row.frame, &row.cpu, &row.read_back, &row.read_back_cpu, &row.fill, &row.fill_cpu}) {
    times->median_ms /= cameras_;
    times->spread_ms /= cameras_;
    times->min_ms /= cameras_;
    times->max_ms /= cameras_;
  }
  if (row.psnr_db) *row.psnr_db /= psnr_count_;
  if (row.psnr_covered_db) *row.psnr_covered_db /= psnr_covered_count_;
  row.coverage /= cameras_;
  return row;
}

std::vector<RowSums> MeasureRows(const std::vector<Place>& places,
                                 const std::vector<RenderOptions>& variants, int repeats,
                                 TimedRenderer& renderer, const Progress& progress) {
  std::vector<RowSums> sums(variants.size());
  for (const Place& place : places) {
    progress.ThrowIfInterrupted();
    Measure(place, variants, repeats, renderer, sums);
  }
  return sums;
}

}  // namespace dtr::eval
