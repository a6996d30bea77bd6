// pipeline/prune/prune.h -- a set without what it does not need: what `dtr prune` does.
#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/eval/timed_renderer.h"
#include "dtr/prune/prune.h"

namespace dtr::pipeline {

struct PruneSetOptions {
  std::filesystem::path set, output;
  prune::PruneOptions prune;
  /// Goals: leaving out ends when they are reached, and it is an Error where they are not.
  std::optional<std::uint64_t> max_bytes;
  std::optional<double> frame_ms;  ///< as frame_after is measured
  bool force = false;
  prune::RendererMaker make_renderer;
  std::string renderer;  ///< its name
  std::function<std::unique_ptr<eval::TimedRenderer>()> make_timed_renderer;
};

struct PruneSetReport {
  prune::PruneReport pruned;
  std::uint64_t bytes_before = 0, bytes_after = 0;  ///< of all files but held_out/ and report/
  eval::Times frame_before, frame_after;  ///< CPU time without a GPU's clock, else its own
};

/// JSON object: set, the fields of `pruned` of its set.json (docs/FORMAT.md, 2.1), photo_loss_db,
/// photo_frame_loss_db, bytes_before, bytes_after, bytes_ratio, frame_before_ms, frame_after_ms,
/// frame_ratio.
std::string ToJson(const PruneSetOptions& options, const PruneSetReport& report);

/// Writes `output`; `set` is only read. Nothing of `output` exists until it is whole. Throws
/// UsageError where `output` is there already (and `force` is off), Error for sets of several
/// time steps and of views without depth, and where the loss does not allow to reach a goal.
PruneSetReport PruneSet(const PruneSetOptions& options, Progress& progress);

}  // namespace dtr::pipeline
