// pipeline/core/sfm_settings.h -- what may be chosen of structure from motion.
#pragma once
#include <string>

#include "calib/sfm/run/sfm.h"

namespace dtr::pipeline {

/// Which photos share intrinsics (camera_groups.h).
enum class CameraPer { kAuto, kFolder, kPhoto, kSet };
/// "auto", "folder", "photo", "set".
const char* NameOf(CameraPer per);

/// How structure from motion goes about it. Each choice decides the result; docs/accuracy/SPEED.md
/// has what they cost and what they are worth.
struct SfmChoice {
  sfm::SfmEngine engine = sfm::SfmOptions().engine;
  int feature_size_px = 0;  ///< long side of the photos for features; 0: from the memory
  int features = 0;         ///< max per photo; 0: what a preset says, else the engine's max
  sfm::Matching matching = sfm::Matching::kAuto;
  std::string lens_model = sfm::SfmOptions().lens_model;
  CameraPer camera_per = CameraPer::kAuto;

  bool operator==(const SfmChoice&) const = default;
};

}  // namespace dtr::pipeline
