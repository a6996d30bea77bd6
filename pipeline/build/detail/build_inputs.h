// pipeline/build/detail/build_inputs.h -- what a build begins with, looked at before any work, and
// by what a later run knows it again.
#pragma once
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "capture/capture.h"
#include "dtr/base/progress.h"
#include "dtr/io/set_io.h"
#include "pipeline/build/build.h"
#include "pipeline/core/set_rig.h"
#include "stereo/engine.h"

namespace dtr::pipeline {

struct BuildInputs {
  /// Empty so far where `is_derived`.
  capture::Capture photos;
  std::vector<bool> held_out;  ///< for each photo
  std::optional<SetRig> rig;   ///< of the options, or what panoramas are
  bool from_video = false;
  bool is_derived = false;  ///< photos are made, in the work folder: frames, views of panoramas
};

/// Photos, where they need not be made, and all that options say of them tested against them.
/// `rig`: of the options. Throws as IngestPhotos and for options that photos do not go with.
BuildInputs LookAtInputs(const BuildOptions& options, std::optional<SetRig> rig, double memory_gb,
                         Progress& progress);

/// Equal values mean the same build.
nlohmann::ordered_json FingerprintOf(const BuildOptions& options,
                                     const stereo::QualitySettings& quality,
                                     const BuildInputs& inputs, double memory_gb);

/// Makes the photos of `inputs`, or finds those of an earlier run, and tests them as LookAtInputs
/// does. What cannot be had of them takes the work of a build that has not gone further away.
/// `is_shared`: another process has made them; throws Error where none has.
void DerivePhotos(const BuildOptions& options, bool is_shared, io::SetWriter& writer,
                  BuildInputs& inputs, Progress& progress);

/// Photos by name, size and content: equal values mean the same input. Hashes of held-out photos
/// are for the fingerprint alone: nothing of their pixels may enter the set outside held_out/.
nlohmann::ordered_json PhotosJson(const capture::Capture& capture,
                                  const std::vector<bool>& with_hash);

/// What was skipped, what was remarked and what screening found.
void ReportPhotos(const capture::Capture& photos, BuildReport& report, Progress& progress);

}  // namespace dtr::pipeline
