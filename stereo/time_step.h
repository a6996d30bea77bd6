// stereo/time_step.h -- what other time steps say of a view of a camera that does not move.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>

#include "dtr/types/grid.h"
#include "stereo/engine.h"
#include "stereo/plane_map.h"

namespace dtr::stereo {

/// A view's pixels are settled (they show what stands still, by the photos; their depth is known)
/// or open: these alone are worked on. All grids have the view's size.
struct TimeStep {
  Mask open;              ///< 255: open, 0: settled
  PlaneMap background;    ///< of what stands still: kept by settled pixels, suggested to open ones
  PlaneMap before;        ///< of the time step before, that open ones begin with; empty: none
  DepthEstimate settled;  ///< final, of settled pixels
};

/// Where a view's TimeStep is read from, so that no more than one is in memory. Called from the
/// threads that call the engine.
struct TimeStepSource {
  std::function<std::shared_ptr<const TimeStep>()> load;
};

/// Bytes of a TimeStep.
inline std::uint64_t TimeStepBytes(const PinholeCamera& camera) {
  return (1 + 12 + 12 + 8) * static_cast<std::uint64_t>(camera.width_px()) *
         static_cast<std::uint64_t>(camera.height_px());
}

/// Puts planes that settled pixels keep into `map`, whatever that has there.
void KeepSettledPlanes(const TimeStep& time_step, PlaneMap* map);

/// The same of depths.
void KeepSettledDepth(const TimeStep& time_step, DepthEstimate* estimate);

}  // namespace dtr::stereo
