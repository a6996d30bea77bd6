#include "pipeline/dynamic/detail/scene_clocks.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "dtr/base/error.h"

namespace dtr::pipeline {
namespace {

constexpr size_t kMostFrames = 1200;
constexpr int kCells = 64;  // along the image's long side

// Of the green channel: absolute differences, and the level below which they are noise.
struct Differences {
  Grid<std::uint8_t> values;
  int noise = 0;
};

Differences DifferencesOf(const ImageRgb8& before, const ImageRgb8& now) {
  Differences differences{Grid<std::uint8_t>(now.width(), now.height()), 0};
  std::array<size_t, 256> histogram{};
  for (int y = 0; y < now.height(); ++y) {
    for (int x = 0; x < now.width(); ++x) {
      const int difference = std::abs(now(x, y, 1) - before(x, y, 1));
      differences.values(x, y) = static_cast<std::uint8_t>(difference);
      ++histogram[static_cast<size_t>(difference)];
    }
  }
  // More than half of the image stands still: the median is noise.
  size_t half = differences.values.data().size() / 2;
  int median = 0;
  while (median < 255 && half >= histogram[static_cast<size_t>(median)]) {
    half -= histogram[static_cast<size_t>(median++)];
  }
  constexpr double kSigmas = 4, kMedianOfNormal = 0.6745;
  differences.noise = static_cast<int>(kSigmas * std::max(0.5, median / kMedianOfNormal));
  return differences;
}

// Sum over each cell of what is above noise. A contrast above 40 levels counts as 40: a motion is
// no larger for being that of something brighter.
Grid<float> MotionCells(const ImageRgb8& before, const ImageRgb8& now) {
  constexpr int kMostLevels = 40;
  const Differences differences = DifferencesOf(before, now);
  const int width = now.width(), height = now.height(), side = std::max(width, height);
  const int columns = std::min(width, std::max(1, (kCells * width + side / 2) / side));
  const int rows = std::min(height, std::max(1, (kCells * height + side / 2) / side));
  Grid<float> cells(columns, rows);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int value = differences.values(x, y);
      if (value <= differences.noise) continue;
      cells(x * columns / width, y * rows / height) +=
          static_cast<float>(std::min(value, kMostLevels));
    }
  }
  return cells;
}

calib::MotionSeen MotionOf(const Recording& recording, size_t camera, const calib::LensCamera& lens,
                           const Pose& cam_from_world, Progress& progress) {
  calib::MotionSeen seen{recording.cameras()[camera], lens, cam_from_world, {}};
  ImageRgb8 before;
  size_t number = 0;  // of `before`
  recording.ForEachFrame(
      camera, kMostFrames,
      [&](size_t frame, const ImageRgb8& image) {
        if (image.width() != lens.width_px || image.height() != lens.height_px) {
          throw Error(
              fmt::format("camera {}: expected {} x {} px as it was calibrated with, found "
                          "{} x {}",
                          seen.name, lens.width_px, lens.height_px, image.width(), image.height()));
        }
        seen.cells.resize(frame + 1);
        if (!before.empty() && number + 1 == frame) {
          seen.cells[frame] = MotionCells(before, image);
        }
        before = image;
        number = frame;
      },
      progress);
  return seen;
}

}  // namespace

std::vector<calib::MotionClock> FindClocks(const Recording& recording,
                                           const std::vector<calib::LensCamera>& lenses,
                                           const std::vector<Pose>& cam_from_world,
                                           Progress& progress) {
  progress.Stage("clocks", static_cast<int>(lenses.size()));
  std::vector<calib::MotionSeen> cameras;
  for (size_t c = 0; c < lenses.size(); ++c) {
    cameras.push_back(MotionOf(recording, c, lenses[c], cam_from_world[c], progress));
    progress.Update(static_cast<int>(c) + 1);
  }
  return calib::FindMotionClocks(cameras);
}

void ShiftByClocks(const std::vector<calib::MotionClock>& clocks, Recording& recording,
                   Progress& progress) {
  std::vector<int> later;
  std::string note;
  for (size_t c = 0; c < clocks.size(); ++c) {
    later.push_back(static_cast<int>(std::lround(clocks[c].later)));
    if (c == 0) continue;
    note +=
        fmt::format("{}{} {:+.2f}", c == 1 ? "" : ", ", recording.cameras()[c], clocks[c].later);
  }
  progress.Note(fmt::format("clocks: frames later than those of {}: {}; the nearest are taken",
                            recording.cameras().front(), note));
  recording.Shift(later, progress);
}

}  // namespace dtr::pipeline
