#include "pipeline/detail/dynamic/recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "capture/video/frames.h"
#include "dtr/base/error.h"
#include "dtr/io/image_io.h"
#include "pipeline/detail/boards/rig_names.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr double kPhotosPerSecond = 24;  // as dtr join has it

// Per time step, which shot each camera has of it.
std::map<std::string, std::map<size_t, size_t>> ShotsByStep(const RigLayout& layout) {
  std::map<std::string, std::map<size_t, size_t>> by_step;
  for (size_t i = 0; i < layout.shots.size(); ++i) {
    by_step[layout.shots[i].frame][layout.shots[i].camera] = i;
  }
  return by_step;
}

double StepsPerSecond(const RigLayout& layout, const StepChoice& choice) {
  if (choice.fps) return *choice.fps;
  const RigShot& first = layout.shots.front();
  if (first.number < 0) return kPhotosPerSecond;
  const double rate = capture::VideoReader(first.file).frames_per_second();
  return rate > 0 ? rate : kPhotosPerSecond;
}

// Frames of equal number are of one time only where all videos run at one rate.
void RequireOneRate(const fs::path& folder, const RigLayout& layout) {
  constexpr double kSameRate = 1e-3;  // relative: 29.97 and 30 differ by as much
  if (layout.shots.front().number < 0 || fs::exists(folder / "timestamps.csv")) return;
  std::map<fs::path, double> rates;
  for (const RigShot& shot : layout.shots) rates.emplace(shot.file, 0);
  for (auto& [file, rate] : rates) rate = capture::VideoReader(file).frames_per_second();
  const auto& [first_file, first_rate] = *rates.begin();
  for (const auto& [file, rate] : rates) {
    if (std::abs(rate - first_rate) < kSameRate * first_rate) continue;
    throw Error(fmt::format(
        "{}: {:.3f} frames per second, {}: {:.3f}; expected videos of one rate, as frames are not "
        "resampled, or timestamps.csv, which states the frames of each time step",
        first_file.string(), first_rate, file.string(), rate));
  }
}

// The time steps that all cameras have.
std::vector<RecordedStep> WholeSteps(const fs::path& folder, const RigLayout& layout, double fps,
                                     Progress& progress) {
  const auto by_step = ShotsByStep(layout);
  const std::vector<size_t> times = FrameTimes(layout.frames);
  std::vector<RecordedStep> steps;
  std::string first_missing;
  size_t left_out = 0;
  for (size_t i = 0; i < layout.frames.size(); ++i) {
    const std::map<size_t, size_t>& shots = by_step.at(layout.frames[i]);
    if (shots.size() < layout.cameras.size()) {
      for (size_t c = 0; c < layout.cameras.size() && first_missing.empty(); ++c) {
        if (!shots.contains(c)) {
          first_missing = fmt::format("{} of camera {}", layout.frames[i], layout.cameras[c]);
        }
      }
      ++left_out;
      continue;
    }
    RecordedStep step{layout.frames[i], static_cast<double>(times[i]) / fps, {}};
    for (const auto& [camera, shot] : shots) step.shots.push_back(shot);
    steps.push_back(std::move(step));
  }
  if (steps.empty()) {
    throw Error(fmt::format(
        "{}: expected time steps with an image of each of the {} cameras, found none; images of "
        "one time step have equal names or numbers, or rows of one sync_index in timestamps.csv",
        folder.string(), layout.cameras.size()));
  }
  if (left_out > 0) {
    progress.Note(
        fmt::format("{} of {} time steps left out: not all cameras have an image, first {}",
                    left_out, layout.frames.size(), first_missing));
  }
  return steps;
}

std::vector<RecordedStep> Chosen(std::vector<RecordedStep> steps, const StepChoice& choice) {
  const int count = static_cast<int>(steps.size());
  const int last = choice.to.value_or(count - 1);
  if (choice.every < 1 || choice.from < 0 || choice.from > last || last >= count) {
    throw UsageError(fmt::format(
        "`from` {}, `to` {}, `every` {}: expected 0 <= from <= to <= {}, the last time step, and "
        "every >= 1",
        choice.from, last, choice.every, count - 1));
  }
  std::vector<RecordedStep> chosen;
  for (int i = choice.from; i <= last; i += choice.every) {
    chosen.push_back(std::move(steps[static_cast<size_t>(i)]));
  }
  return chosen;
}

}  // namespace

Recording::Recording(const fs::path& folder, const StepChoice& choice, Progress& progress)
    : folder_(folder), layout_(RigLayoutOf(folder, progress)) {
  for (const auto& left_out : layout_.left_out) {
    progress.Note(left_out.name + ": " + left_out.reason);
  }
  RequireOneRate(folder, layout_);
  steps_ = Chosen(WholeSteps(folder, layout_, StepsPerSecond(layout_, choice), progress), choice);
}

std::vector<fs::path> Recording::Files() const {
  std::set<fs::path> files;
  for (const RecordedStep& step : steps_) {
    for (const size_t shot : step.shots) files.insert(layout_.shots[shot].file);
  }
  if (const fs::path table = folder_ / "timestamps.csv"; fs::exists(table)) files.insert(table);
  return {files.begin(), files.end()};
}

void Recording::ForEach(size_t camera, const std::function<bool(size_t)>& wanted,
                        const std::function<void(size_t, const ImageRgb8&)>& take,
                        const Progress& progress) const {
  std::map<int, size_t> of_video;  // frame number -> time step
  for (size_t step = 0; step < steps_.size(); ++step) {
    if (!wanted(step)) continue;
    const RigShot& shot = layout_.shots[steps_[step].shots[camera]];
    if (shot.number >= 0) {
      of_video[shot.number] = step;
      continue;
    }
    progress.ThrowIfInterrupted();
    take(step, io::ReadImage(shot.file));
  }
  if (of_video.empty()) return;
  const RigShot& shot = layout_.shots[steps_.front().shots[camera]];
  capture::VideoReader video(shot.file);
  while (!of_video.empty() && video.Next()) {
    progress.ThrowIfInterrupted();
    const auto found = of_video.find(video.number());
    if (found == of_video.end()) continue;
    take(found->second, video.Picture());
    of_video.erase(found);
  }
  if (of_video.empty()) return;
  throw Error(fmt::format("{}: frame {}: cannot be decoded a second time; is the file changing?",
                          shot.file.string(), of_video.begin()->first));
}

}  // namespace dtr::pipeline
