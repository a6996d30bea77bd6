#include "pipeline/dynamic/detail/recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <set>

#include "capture/video/frames.h"
#include "dtr/base/error.h"
#include "dtr/io/image_io.h"
#include "pipeline/core/photos/rig_names.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr double kPhotosPerSecond = 24;  // as dtr join has it

// What cameras have, by time in frames: which shot each has then.
using ShotsByTime = std::map<size_t, std::map<size_t, size_t>>;

ShotsByTime ShotsOf(const RigLayout& layout) {
  const std::vector<size_t> times = FrameTimes(layout.frames);
  std::map<std::string, size_t> time_of;
  for (size_t i = 0; i < times.size(); ++i) time_of[layout.frames[i]] = times[i];
  ShotsByTime shots;
  for (size_t i = 0; i < layout.shots.size(); ++i) {
    shots[time_of.at(layout.shots[i].frame)][layout.shots[i].camera] = i;
  }
  return shots;
}

// `slowest`: of videos of different rates.
double StepsPerSecond(const RigLayout& layout, const StepChoice& choice,
                      const std::optional<double>& slowest) {
  if (choice.fps) return *choice.fps;
  if (slowest) return *slowest;
  const RigShot& first = layout.shots.front();
  if (first.number < 0) return kPhotosPerSecond;
  const double rate = capture::VideoReader(first.file).frames_per_second();
  return rate > 0 ? rate : kPhotosPerSecond;
}

// Frames of equal number are of one time only where all videos run at one rate. Others keep the
// frames nearest in time to those of the slowest, under its numbers; its rate is returned.
std::optional<double> ResampleToOneRate(const fs::path& folder, RigLayout& layout,
                                        Progress& progress) {
  constexpr double kSameRate = 1e-6;  // relative
  if (layout.shots.front().number < 0 || fs::exists(folder / "timestamps.csv")) return {};
  std::map<fs::path, double> rates;
  for (const RigShot& shot : layout.shots) rates.emplace(shot.file, 0);
  for (auto& [file, rate] : rates) {
    rate = capture::VideoReader(file).frames_per_second();
    if (!(rate > 0)) return {};  // not stated
  }
  const auto slower = [](const auto& a, const auto& b) { return a.second < b.second; };
  const auto [slowest, rate] = *std::min_element(rates.begin(), rates.end(), slower);
  const auto [fastest, most] = *std::max_element(rates.begin(), rates.end(), slower);
  if (most - rate <= kSameRate * rate) return {};
  progress.Note(fmt::format(
      "{}: {:.3f} frames per second, {}: {:.3f}; of faster videos the frames nearest in time are "
      "taken, at most {:.1f} ms off",
      slowest.filename().string(), rate, fastest.filename().string(), most, 500 / most));
  std::map<fs::path, std::map<int, size_t>> at;
  for (size_t i = 0; i < layout.shots.size(); ++i) {
    at[layout.shots[i].file][layout.shots[i].number] = i;
  }
  RigLayout resampled = layout;
  resampled.shots.clear();
  std::set<int> numbers;
  for (const auto& [file, own_rate] : rates) {
    const std::map<int, size_t>& own = at[file];
    for (int number = 0;; ++number) {
      const int nearest = static_cast<int>(std::lround(number * own_rate / rate));
      if (nearest > own.rbegin()->first) break;
      const auto shot = own.find(nearest);
      if (shot == own.end()) continue;
      resampled.shots.push_back(layout.shots[shot->second]);
      resampled.shots.back().frame = std::to_string(number);
      numbers.insert(number);
    }
  }
  std::stable_sort(resampled.shots.begin(), resampled.shots.end(),
                   [](const RigShot& a, const RigShot& b) { return a.camera < b.camera; });
  resampled.frames.clear();
  for (const int number : numbers) resampled.frames.push_back(std::to_string(number));
  layout = std::move(resampled);
  return rate;
}

// Those of `frames` (indices) that all cameras have, each camera's image `later` frames after its
// number.
std::vector<RecordedStep> WholeSteps(const fs::path& folder, const RigLayout& layout,
                                     const std::vector<size_t>& frames,
                                     const std::vector<int>& later, double fps,
                                     Progress& progress) {
  const ShotsByTime shots = ShotsOf(layout);
  const std::vector<size_t> times = FrameTimes(layout.frames);
  std::vector<RecordedStep> steps;
  std::string first_missing;
  for (const size_t i : frames) {
    RecordedStep step{layout.frames[i], static_cast<double>(times[i]) / fps, {}};
    for (size_t c = 0; c < layout.cameras.size(); ++c) {
      const auto then = shots.find(times[i] + static_cast<size_t>(later[c]));  // wraps below 0
      if (then != shots.end() && then->second.contains(c)) {
        step.shots.push_back(then->second.at(c));
      } else if (first_missing.empty()) {
        first_missing = fmt::format("{} of camera {}", layout.frames[i], layout.cameras[c]);
      }
    }
    if (step.shots.size() == layout.cameras.size()) steps.push_back(std::move(step));
  }
  if (steps.empty()) {
    throw Error(fmt::format(
        "{}: expected time steps with an image of each of the {} cameras, found none; images of "
        "one time step have equal names or numbers, or rows of one sync_index in timestamps.csv",
        folder.string(), layout.cameras.size()));
  }
  if (steps.size() < frames.size()) {
    progress.Note(
        fmt::format("{} of {} time steps left out: not all cameras have an image, first {}",
                    frames.size() - steps.size(), frames.size(), first_missing));
  }
  return steps;
}

template <typename Step>
std::vector<Step> Chosen(std::vector<Step> steps, const StepChoice& choice) {
  const int count = static_cast<int>(steps.size());
  const int last = choice.to.value_or(count - 1);
  if (choice.every < 1 || choice.from < 0 || choice.from > last || last >= count) {
    throw UsageError(fmt::format(
        "`from` {}, `to` {}, `every` {}: expected 0 <= from <= to <= {}, the last time step, and "
        "every >= 1",
        choice.from, last, choice.every, count - 1));
  }
  std::vector<Step> chosen;
  for (int i = choice.from; i <= last; i += choice.every) {
    chosen.push_back(std::move(steps[static_cast<size_t>(i)]));
  }
  return chosen;
}

// Hands out shots of one camera under their keys. Frames of a video in rising order.
void HandOut(const std::map<size_t, const RigShot*>& wanted,
             const std::function<void(size_t key, const ImageRgb8& image)>& take,
             const Progress& progress) {
  std::map<int, size_t> of_video;  // frame number -> key
  fs::path file;
  for (const auto& [key, shot] : wanted) {
    if (shot->number >= 0) {
      of_video[shot->number] = key;
      file = shot->file;
      continue;
    }
    progress.ThrowIfInterrupted();
    take(key, io::ReadImage(shot->file));
  }
  if (of_video.empty()) return;
  capture::VideoReader video(file);
  while (!of_video.empty() && video.Next()) {
    progress.ThrowIfInterrupted();
    const auto found = of_video.find(video.number());
    if (found == of_video.end()) continue;
    take(found->second, video.Picture());
    of_video.erase(found);
  }
  if (of_video.empty()) return;
  throw Error(fmt::format("{}: frame {}: cannot be decoded a second time; is the file changing?",
                          file.string(), of_video.begin()->first));
}

}  // namespace

Recording::Recording(const fs::path& folder, const StepChoice& choice, Progress& progress)
    : folder_(folder), choice_(choice), layout_(RigLayoutOf(folder, progress)) {
  for (const auto& left_out : layout_.left_out) {
    progress.Note(left_out.name + ": " + left_out.reason);
  }
  const auto slowest = ResampleToOneRate(folder, layout_, progress);
  steps_per_second_ = StepsPerSecond(layout_, choice, slowest);
  const std::vector<int> as_numbered(layout_.cameras.size());
  std::vector<size_t> frames(layout_.frames.size());
  std::iota(frames.begin(), frames.end(), size_t{0});
  if (!choice.free_clocks) {
    steps_ = Chosen(WholeSteps(folder_, layout_, frames, as_numbered, steps_per_second_, progress),
                    choice);
    return;
  }
  const ShotsByTime shots = ShotsOf(layout_);
  const std::vector<size_t> times = FrameTimes(layout_.frames);
  std::erase_if(frames, [&](size_t i) { return !shots.at(times[i]).contains(0); });
  chosen_frames_ = Chosen(std::move(frames), choice);
  Shift(as_numbered, progress);
}

void Recording::Shift(const std::vector<int>& later, Progress& progress) {
  steps_ = WholeSteps(folder_, layout_, chosen_frames_, later, steps_per_second_, progress);
}

std::vector<fs::path> Recording::Files() const {
  std::set<fs::path> files;
  for (const RecordedStep& step : steps_) {
    for (const size_t shot : step.shots) files.insert(layout_.shots[shot].file);
  }
  if (choice_.free_clocks) {
    for (const RigShot& shot : layout_.shots) files.insert(shot.file);
  }
  if (const fs::path table = folder_ / "timestamps.csv"; fs::exists(table)) files.insert(table);
  return {files.begin(), files.end()};
}

void Recording::ForEachFrame(size_t camera, size_t most,
                             const std::function<void(size_t, const ImageRgb8&)>& take,
                             const Progress& progress) const {
  const ShotsByTime shots = ShotsOf(layout_);
  size_t from = 0;
  if (const size_t last = shots.rbegin()->first; last >= most) {
    const std::string& first = layout_.shots[steps_.front().shots.front()].frame;
    const auto at = std::find(layout_.frames.begin(), layout_.frames.end(), first);
    from = FrameTimes(layout_.frames)[static_cast<size_t>(at - layout_.frames.begin())];
    from = std::min(from, last + 1 - most);
  }
  std::map<size_t, const RigShot*> wanted;
  for (auto then = shots.lower_bound(from); then != shots.end(); ++then) {
    if (then->first - from >= most) break;
    const auto shot = then->second.find(camera);
    if (shot != then->second.end()) wanted[then->first - from] = &layout_.shots[shot->second];
  }
  HandOut(wanted, take, progress);
}

void Recording::ForEach(size_t camera, const std::function<bool(size_t)>& wanted,
                        const std::function<void(size_t, const ImageRgb8&)>& take,
                        const Progress& progress) const {
  std::map<size_t, const RigShot*> shots;
  for (size_t step = 0; step < steps_.size(); ++step) {
    if (wanted(step)) shots[step] = &layout_.shots[steps_[step].shots[camera]];
  }
  HandOut(shots, take, progress);
}

}  // namespace dtr::pipeline
