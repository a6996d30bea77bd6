// pipeline/dynamic/detail/recording.h -- what fixed cameras recorded, time step by time step.
#pragma once
#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/types/grid.h"
#include "pipeline/core/photos/rig_layout.h"

namespace dtr::pipeline {

/// Which time steps of a recording are used.
struct StepChoice {
  int every = 1;              ///< of those from `from` on, every N-th
  int from = 0;               ///< numbers of time steps that all cameras have, from 0
  std::optional<int> to;      ///< the last one; empty: all
  std::optional<double> fps;  ///< time steps per second; empty: as the videos say, of photos 24
  /// Cameras began when they liked (Shift): the numbers above count frames of the first camera.
  bool free_clocks = false;
};

/// One image of every camera.
struct RecordedStep {
  std::string name;           ///< as file names or the table of timestamps have it
  double time_s = 0;          ///< from the first time step of the recording on
  std::vector<size_t> shots;  ///< per camera, index into the layout's shots
};

/// A folder of one video or one folder of photos per camera, or of photos named by their cameras
/// (RigLayoutOf). Of videos of different rates, frames are those nearest to the slowest one's, with
/// a note. Time steps that a camera has no image of are left out, with a note.
class Recording {
 public:
  /// Throws as RigLayoutOf; UsageError for a choice that leaves nothing, Error where no time step
  /// has an image of every camera.
  Recording(const std::filesystem::path& folder, const StepChoice& choice, Progress& progress);

  /// Of free clocks: takes the chosen time steps again, each camera's image `later` frames after
  /// the one of equal number; one number per camera. Notes and errors as above.
  void Shift(const std::vector<int>& later, Progress& progress);

  const std::vector<std::string>& cameras() const { return layout_.cameras; }
  const std::vector<RecordedStep>& steps() const { return steps_; }
  /// Everything that is read, for a fingerprint: files, each once. With free clocks all.
  std::vector<std::filesystem::path> Files() const;

  /// Hands out a camera's images of at most `most` consecutive frames, time steps or not, in rising
  /// order: all, or where there are more those from the first time step on (the last ones where
  /// fewer follow). `frame` counts from the first of any camera, with gaps where one is missing.
  /// Throws as ForEach.
  void ForEachFrame(size_t camera, size_t most,
                    const std::function<void(size_t frame, const ImageRgb8& image)>& take,
                    const Progress& progress) const;

  /// Hands out the images of one camera at the time steps that are wanted, in rising order. Videos
  /// are decoded up to the last of them, one image in memory. Throws Error where one cannot be
  /// read, Interrupted between images.
  void ForEach(size_t camera, const std::function<bool(size_t step)>& wanted,
               const std::function<void(size_t step, const ImageRgb8& image)>& take,
               const Progress& progress) const;

 private:
  std::filesystem::path folder_;
  StepChoice choice_;
  RigLayout layout_;
  double steps_per_second_ = 0;
  std::vector<size_t> chosen_frames_;  ///< of layout_.frames, with free clocks
  std::vector<RecordedStep> steps_;
};

}  // namespace dtr::pipeline
