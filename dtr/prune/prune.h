// dtr/prune/prune.h -- what can be left out of a set without its images getting worse by more
// than a given loss.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dtr/base/progress.h"
#include "dtr/prune/coding.h"
#include "dtr/prune/image_loss.h"
#include "dtr/prune/measurer.h"
#include "dtr/prune/setting.h"

namespace dtr::prune {

struct PruneOptions {
  double max_loss_db = 0.1;
  int probes = 12;       ///< source views whose photos decide, each left out in turn
  int checks = 8;        ///< novel cameras that decide, and as many others that check
  int probe_crop = 2;    ///< of deciding images a window of 1/this per axis counts
  RenderOptions render;  ///< what the set is drawn with before
  std::uint64_t seed = 0;
  /// Enough is left out when the set takes at most so many bytes and its frames this share of
  /// their work; none: what fits the loss goes.
  std::optional<double> enough_bytes, enough_frame_share;
  double other_bytes = 0;      ///< of the set's files that no step changes
  Journal* journal = nullptr;  ///< what an interrupted run measured; may be null
};

/// One thing left out, in the order of the decisions.
struct Removal {
  std::string kind;    ///< "sigma", "view", "tiles", "views-used", "resolution", "images", "depth",
                       ///< "size", "mesh"
  std::string what;    ///< a view's name, or what became of the rest: "JPEG quality 90"
  double loss_db = 0;  ///< what this one added, at the deciding places
  double bytes_share = 0;  ///< of the bytes of before that it saved
  double frame_share = 0;  ///< of the work of a frame of before (FrameOf) that it saved
};

struct PruneReport {
  Setting setting;
  std::vector<Removal> removed;
  std::vector<Removal> put_back;  ///< decided, but the check did not bear it out
  double decided_loss_db = 0;     ///< of `removed`, at the deciding places
  /// Whole images, at cameras that decided nothing, and the standard error of that mean.
  double checked_probe_loss_db = 0, probe_error_db = 0;
  /// Mean over photos of source views that did not decide (of all, where all decide).
  double witness_loss_db = 0, witness_error_db = 0;
  /// Mean over held-out photos, which decide nothing, of what some view sees, and of whole frames;
  /// none: there are none.
  std::optional<double> photo_loss_db, photo_frame_loss_db;
  double error_db = 0;  ///< PSNR against photos before, to which a loss is relative
  /// The larger of the two checked losses, neither of which exceeds max_loss_db: with twice its
  /// standard error the first, with once its own the second.
  double loss_db() const { return std::max(checked_probe_loss_db, witness_loss_db); }
};

/// Greedy: of all that could be left out next (a view; tiles that others cover; a step of image
/// quality, depth error, size, mesh tolerance or number of views used) what saves most bytes and
/// work per dB that it is measured to cost, until nothing fits the loss. What it costs is the
/// larger loss of two: at source views left out in turn, and between input cameras. `set`: loaded
/// with images and depth, and held-out photos where it has some: the result is only measured on
/// them. The outcome is then looked at again, at full size, from other cameras and against the
/// photos, and the last decisions are taken back until the loss holds; then it goes on without
/// these, a few times. Depends on the set, the options and the renderer alone, not on threads or
/// times, nor on how often it was interrupted.
PruneReport Prune(const DtrSet& set, const PruneOptions& options, const CodeFunction& code,
                  const RendererMaker& make_renderer, Progress& progress);

}  // namespace dtr::prune
