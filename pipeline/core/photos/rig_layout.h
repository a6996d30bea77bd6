// pipeline/core/photos/rig_layout.h -- which files and frames the cameras of a rig took when.
#pragma once
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "calib/boards/observations.h"
#include "dtr/base/progress.h"

namespace dtr::pipeline {

/// One photo, or one frame of a video.
struct RigShot {
  std::filesystem::path file;  ///< of a photo; of a video where number >= 0
  int number = -1;             ///< frame of a video
  std::string name;            ///< to list it by
  std::string frame;           ///< time step
  size_t camera = 0;
};

struct RigLayout {
  std::vector<std::string> cameras;      ///< in byte order of names
  std::vector<RigShot> shots;            ///< by camera; a camera's videos in order of their frames
  std::vector<std::string> frames;       ///< time steps in order (FrameTimes)
  std::vector<calib::LeftOut> left_out;  ///< what the folder holds and nothing is made of
};

/// The layouts of ReadRigPhotos, told apart by what the folder holds. Videos are decoded once, to
/// count their frames. Throws UsageError when the folder holds none of them or fewer than two
/// cameras, Error where a camera has two images of one time step or a video cannot be read.
RigLayout RigLayoutOf(const std::filesystem::path& folder, Progress& progress);

}  // namespace dtr::pipeline
