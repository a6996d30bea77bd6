// calib/validation/camera_hypotheses.h -- internal to calib/validation: cameras as they would be if
// a usual mistake had been made with their file.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "calib/validation/conventions.h"

namespace dtr::calib {

struct CameraHypothesis {
  std::string name, advice;  ///< as Convention has them
  bool is_fine = false;      ///< changes pixels a little: principal point, distortion
  std::vector<GivenCamera> cameras;
};

/// All that apply to these cameras; without those that change none of them.
std::vector<CameraHypothesis> HypothesesFor(std::span<const GivenCamera> cameras);

/// The cameras with radial distortion k1 in place of theirs.
std::vector<GivenCamera> WithRadial(std::span<const GivenCamera> cameras, double k1);

}  // namespace dtr::calib
