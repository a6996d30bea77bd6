// pipeline/dynamic/detail/background_views.h -- what stands still before the cameras of a dynamic
// set, as a scene of its own.
#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/io/set_io.h"
#include "dtr/types/dtr_set.h"
#include "pipeline/core/depth/plane_files.h"
#include "stereo/background.h"
#include "stereo/time_step.h"

namespace dtr::pipeline {

/// The backgrounds of the source cameras (stereo/background.h) as views of a still set. Their files
/// lie among those of the time steps until the writer's Finish removes them.
struct BackgroundViews {
  DtrSet set;  ///< one frame: of every source camera its background, ids background_*
  std::vector<double> noise;  ///< per view, 8-bit levels
};

/// From the images of at most 15 time steps of `dynamic` that `writer` has, one camera in memory at
/// a time. Those of an interrupted run are found again.
BackgroundViews MakeBackgroundViews(const DtrSet& dynamic, io::SetWriter& writer,
                                    Progress& progress);

/// Where a view of a time step, loaded with image and mask, shows something else than its
/// background (a view of `set`, loaded with its image): 255, else 0.
Mask OpenPixels(const View& background, const View& now, const io::SetWriter& writer);

/// Fewer time steps say nothing of what stands still.
inline constexpr size_t kLeastTimeSteps = 3;

/// Hands the stereo engine what other time steps say of the source views of one of them. Used while
/// `before` and the background's depth and planes exist.
class TimeStepReader {
 public:
  /// `views`: the source views of the time step, whose images `writer` has; `before`: planes of the
  /// last `pass` of the time step before, null for the first. Time steps that are read stay in
  /// memory where all together take at most `cache_bytes`.
  TimeStepReader(const BackgroundViews& backgrounds, std::vector<View> views,
                 const io::SetWriter& writer, stereo::PlaneMapStore& background_planes,
                 stereo::PlaneMapStore* before, int pass, std::uint64_t cache_bytes);

  /// One for each source view; they borrow this.
  std::vector<stereo::TimeStepSource> Sources();
  /// Share of the pixels of all views that were open, of those read so far.
  double OpenShare() const;

 private:
  std::shared_ptr<const stereo::TimeStep> Load(size_t view);
  std::shared_ptr<const stereo::TimeStep> Read(size_t view);

  const BackgroundViews& backgrounds_;
  std::vector<View> views_;
  const io::SetWriter& writer_;
  stereo::PlaneMapStore& background_planes_;
  stereo::PlaneMapStore* before_;
  int pass_;
  bool caches_ = false;
  std::mutex mutex_;
  std::map<size_t, std::shared_ptr<const stereo::TimeStep>> cached_;
  std::map<size_t, std::pair<std::int64_t, std::int64_t>> open_;  // of each view: open, all
};

/// Bytes of the time steps of these views.
std::uint64_t TimeStepBytesOf(const std::vector<View>& views);

}  // namespace dtr::pipeline
