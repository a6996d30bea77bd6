// pipeline/bench/detail/set_quality.h -- what a finished set is worth in images, for sweeps.
#pragma once
#include <filesystem>

#include "dtr/base/progress.h"
#include "dtr/base/temporary_folder.h"
#include "dtr/eval/held_out.h"
#include "dtr/eval/sweep.h"

namespace dtr::pipeline {

/// A new folder below `folder` (made when absent) for sets that are measured and removed again:
/// whatever else lies there, sets of people included, is left alone. Throws Error.
class ScratchFolder : public TemporaryFolder {
 public:
  explicit ScratchFolder(const std::filesystem::path& folder);
};

/// A set with its images, depth and held-out photos.
DtrSet LoadToEvaluate(const std::filesystem::path& folder, bool sigma, Progress& progress);

/// Fills in PSNR, error (RMS levels) and figures from renderings of the held-out photos, or of
/// every source view left out in turn where there are none. Throws Error when nothing can be
/// compared.
void EvaluateImages(const DtrSet& set, const RenderOptions& render,
                    const eval::RenderFunction& renderer, eval::SweepMeasurement& measured);

}  // namespace dtr::pipeline
