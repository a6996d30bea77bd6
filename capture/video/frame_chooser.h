// capture/video/frame_chooser.h -- which frames of a video are worth keeping.
#pragma once
#include <functional>
#include <optional>
#include <vector>

#include "capture/video/frame_motion.h"
#include "dtr/types/grid.h"

namespace dtr::capture {

/// A frame that was kept, and why.
struct ChosenFrame {
  int number = 0;        ///< in the video, from 0
  double time_s = 0;     ///< when the video shows it
  double moved = 0;      ///< since the frame kept before it, of the long side; 0 where that is lost
  double sharpness = 0;  ///< Sharpness(); of several cameras the geometric mean

  bool operator==(const ChosenFrame&) const = default;
};

/// What one time step looks like: one small grey image for each camera, and how sharp the images
/// are at full size, asked for only where it matters.
struct TimeStep {
  int number = 0;
  double time_s = 0;
  std::vector<Grid<std::uint8_t>> greys;
  std::function<double()> sharpness;
};

/// Keeps frames `motion` (of the image's long side) apart: once the image has moved by three
/// quarters of it, the sharpest frame is taken of those until five quarters. A camera that stands
/// still gives one frame, whatever its speed frames are spread evenly over the way, and frames that
/// a shaken hand blurred are passed over where a sharp one is near. Where the image is lost (a
/// cut, a fast turn) it begins again.
///
/// Several cameras of a rig keep the same time steps, by the mean of their motions. Holds at most
/// 64 small images per camera, whatever the video's length. Deterministic.
class FrameChooser {
 public:
  /// Throws std::invalid_argument unless 0 < motion <= 1.
  explicit FrameChooser(double motion);

  /// The next time step of the video.
  void Add(TimeStep time_step);
  /// No more will come. Call it once.
  std::vector<ChosenFrame> Finish();

 private:
  struct Waiting {
    TimeStep time_step;
    double moved = 0, sharpness = 0;
    bool candidate = false;
  };

  void Consider(Waiting waiting);
  void BeginAt(Waiting waiting);
  void Follow(const TimeStep& time_step);
  void Open(Waiting waiting, double moved, bool candidate);
  std::vector<Waiting> Close();

  double motion_;
  std::vector<FrameMotion> followed_;  // from the anchor on, one for each camera
  bool anchor_is_kept_ = false;        // else the anchor is only where following began
  std::vector<Waiting> window_;        // since the first candidate, in order
  std::vector<ChosenFrame> chosen_;
};

/// The sharpest of each of `most` runs of (nearly) equal length; all where there are no more.
std::vector<ChosenFrame> Thinned(const std::vector<ChosenFrame>& frames, int most);

}  // namespace dtr::capture
