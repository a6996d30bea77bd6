#include "pipeline/prune/prune.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "dtr/base/error.h"
#include "dtr/base/hash.h"
#include "dtr/base/json_number.h"
#include "dtr/io/pruned_json.h"
#include "dtr/io/run_record_json.h"
#include "dtr/io/set_io.h"
#include "dtr/prune/probes.h"
#include "dtr/render/stored_options_json.h"
#include "dtr/render/time_steps.h"
#include "pipeline/core/reports/text.h"
#include "pipeline/core/run/run_log.h"
#include "pipeline/prune/detail/prune_journal.h"
#include "pipeline/prune/detail/view_coder.h"

namespace dtr::pipeline {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kTimedCameras = 3, kTimedRepeats = 3;

/// Room for what set.json says of the pruning; it is written when all is decided.
constexpr std::uint64_t kMaxBytesOfReport = 16384;

/// What is in no view's files.
std::uint64_t OtherBytesOf(const DtrSet& set, const fs::path& folder) {
  return fs::file_size(folder / "set.json") + (set.sparse_file ? set.sparse_file->bytes : 0);
}

std::uint64_t BytesOfViews(const DtrSet& set) {
  std::uint64_t bytes = 0;
  for (const View& view : set.frames.front().views) {
    if (view.role != ViewRole::kSource) continue;
    for (const auto* file : {&view.image_file, &view.mask_file, &view.depth_file,
                             &view.completed_file, &view.sigma_file, &view.mesh_file}) {
      if (*file) bytes += (*file)->bytes;
    }
  }
  return bytes;
}

std::uint64_t BytesOf(const DtrSet& set, const fs::path& folder) {
  return OtherBytesOf(set, folder) + BytesOfViews(set);
}

DtrSet LoadForPruning(const PruneSetOptions& options, Progress& progress) {
  io::LoadOptions load;
  load.held_out = load.completed = true;
  load.collapse_duplicates = false;  // sparse.bin counts the views as they are
  load.warn = [&](const std::string& line) { progress.Note(line); };
  DtrSet set = io::LoadSet(options.set, load);
  RequireOneFrame(set);
  for (const View& view : set.frames.front().views) {
    if (view.role == ViewRole::kHeldOut || view.depth_file) continue;
    throw Error(fmt::format("{}: view '{}': expected depth, found none; run dtr stereo first",
                            options.set.string(), view.name));
  }
  return set;
}

/// What measurements depend on; what is allowed and what is enough may be others when it goes on.
std::string Fingerprint(const PruneSetOptions& options, const DtrSet& set) {
  auto held_out = Json::array();
  for (const View& view : set.frames.front().views) {
    if (view.role == ViewRole::kHeldOut) held_out.push_back(view.image_file->sha256);
  }
  const prune::PruneOptions& prune = options.prune;
  return Json{{"tool_version", DTR_VERSION},
              {"measured", "what some view sees; what is removed counts whole"},
              {"set_sha256", Sha256OfFile(options.set / "set.json")},
              {"held_out", held_out},
              {"probes", prune.probes},
              {"checks", prune.checks},
              {"probe_crop", prune.probe_crop},
              {"renderer", options.renderer},
              {"render", dtr::JsonOf(prune.render)},
              {"seed", prune.seed}}
      .dump();
}

Json RemovalsJson(const std::vector<prune::Removal>& removals) {
  Json list = Json::array();
  for (const prune::Removal& removal : removals) {
    list.push_back({{"kind", removal.kind},
                    {"what", removal.what},
                    {"loss_db", removal.loss_db},
                    {"bytes_share", removal.bytes_share},
                    {"frame_share", removal.frame_share}});
  }
  return list;
}

/// What goes into set.json: no time, nothing of the machine.
Json PrunedJson(const PruneSetOptions& options, const PruneSetReport& report) {
  const prune::PruneReport& pruned = report.pruned;
  return {{"max_loss_db", options.prune.max_loss_db},
          {"loss_db", pruned.loss_db()},
          {"probe_loss_db", pruned.checked_probe_loss_db},
          {"probe_error_db", pruned.probe_error_db},
          {"witness_loss_db", pruned.witness_loss_db},
          {"witness_error_db", pruned.witness_error_db},
          {"decided_loss_db", pruned.decided_loss_db},
          {"psnr_before_db", pruned.error_db},
          {"probes", options.prune.probes},
          {"checks", options.prune.checks},
          {"seed", options.prune.seed},
          {"render", dtr::JsonOf(pruned.setting.render)},
          {"removed", RemovalsJson(pruned.removed)},
          {"put_back", RemovalsJson(pruned.put_back)}};
}

/// sparse.bin of the views that are left, on their grids.
SparseScene SparseOf(const SparseScene& sparse, const DtrSet& before,
                     const std::vector<std::string>& without, int shrink) {
  const std::vector<View>& views = before.frames.front().views;
  std::vector<bool> keep;
  std::vector<int> new_index;
  int left = 0;
  for (const View& view : views) {
    keep.push_back(std::find(without.begin(), without.end(), view.id) == without.end());
    new_index.push_back(left);
    left += keep.back();
  }
  SparseScene rest = RestrictToViews(sparse, keep);
  for (SparseObservation& observation : rest.observations) {
    const auto old = static_cast<size_t>(observation.view);
    if (views[old].role == ViewRole::kSource) observation.pixel /= shrink;
    observation.view = new_index[old];
  }
  return rest;
}

DtrSet WritePruned(const PruneSetOptions& options, const DtrSet& set, const ViewCoder& coder,
                   const prune::Setting& setting, io::SetWriter& writer, Progress& progress) {
  DtrSet pruned = set;
  std::vector<View>& views = pruned.frames.front().views;
  const auto is_left_out = [&](const View& view) {
    return std::find(setting.without.begin(), setting.without.end(), view.id) !=
           setting.without.end();
  };
  std::erase_if(views, is_left_out);
  progress.Stage("writing", static_cast<int>(views.size()));
  for (size_t i = 0; i < views.size(); ++i) {
    progress.ThrowIfInterrupted();
    if (views[i].role == ViewRole::kSource) {
      views[i] = coder.Write(views[i], setting.coding, writer);
    } else {
      writer.CopyFiles(options.set, views[i]);
    }
    progress.Update(static_cast<int>(i) + 1);
  }
  if (set.sparse_file) {
    writer.WriteSparse(pruned, SparseOf(io::LoadSparse(options.set, set), set, setting.without,
                                        setting.coding.shrink));
  }
  return pruned;
}

eval::Times FrameOf(const DtrSet& set, const std::vector<NovelCamera>& cameras,
                    const RenderOptions& render, eval::TimedRenderer& renderer) {
  const RenderScene scene = MakeRenderScene(set);
  std::vector<double> ms;
  for (const NovelCamera& novel : cameras) {
    for (int i = 0; i <= kTimedRepeats; ++i) {
      const eval::FrameTime time = renderer.Draw(scene, novel.camera, novel.cam_from_world, render);
      if (i > 0) ms.push_back(time.gpu_ms.value_or(time.cpu_ms));  // the first fills caches
    }
  }
  return eval::TimesOf(ms);
}

/// Measured once: a run that goes on has the same goal.
eval::Times FrameBefore(const PruneSetOptions& options, const DtrSet& set,
                        const std::vector<NovelCamera>& cameras, PruneJournal& journal) {
  const std::string name = "frame before";
  auto times = journal.Find(name, 2);
  if (!times) {
    RenderOptions render = options.prune.render;
    const eval::Times measured = FrameOf(set, cameras, render, *options.make_timed_renderer());
    times = {measured.median_ms, measured.spread_ms};
    journal.Add(name, *times);
  }
  eval::Times frame;
  frame.median_ms = (*times)[0];
  frame.spread_ms = (*times)[1];
  return frame;
}

void ExpectGoalsReached(const PruneSetOptions& options, const DtrSet& pruned,
                        const PruneSetReport& report) {
  const auto reject = [&](const std::string& expected, const std::string& found) {
    throw Error(
        fmt::format("{}: expected {} within a loss of {:g} dB, found {}; allow more by "
                    "`max_loss_db`",
                    options.output.string(), expected, options.prune.max_loss_db, found));
  };
  const std::uint64_t bytes =
      OtherBytesOf(pruned, options.set) + kMaxBytesOfReport + BytesOfViews(pruned);
  if (options.max_bytes && bytes > *options.max_bytes) {
    reject(fmt::format("at most {} bytes", *options.max_bytes), fmt::format("{}", bytes));
  }
  if (options.frame_ms && report.frame_after.median_ms > *options.frame_ms) {
    reject(fmt::format("frames of at most {:g} ms", *options.frame_ms),
           fmt::format("{:.1f} ms", report.frame_after.median_ms));
  }
}

}  // namespace

PruneSetReport PruneSet(const PruneSetOptions& options, Progress& progress) {
  RunLog log;
  log.Begin("deciding");
  const DtrSet set = LoadForPruning(options, progress);
  io::SetWriter writer(options.output, Fingerprint(options, set), options.force);
  prune::PruneOptions prune = options.prune;
  prune.other_bytes = static_cast<double>(OtherBytesOf(set, options.set) + kMaxBytesOfReport);
  PruneJournal journal(writer.work_folder() / "measured.jsonl");
  prune.journal = &journal;
  const auto cameras = prune::DrawProbes(set, kTimedCameras, prune.seed);
  PruneSetReport report;
  report.frame_before = FrameBefore(options, set, cameras, journal);
  if (options.max_bytes) prune.enough_bytes = static_cast<double>(*options.max_bytes);
  if (options.frame_ms)
    prune.enough_frame_share = *options.frame_ms / report.frame_before.median_ms;
  const ViewCoder coder(set, options.set, writer.work_folder() / "trial", prune.render);
  report.pruned = prune::Prune(
      set, prune, [&](const prune::Coding& coding) { return coder.Try(coding); },
      options.make_renderer, progress);
  const prune::Setting& setting = report.pruned.setting;

  log.Begin("writing");
  DtrSet pruned = WritePruned(options, set, coder, setting, writer, progress);
  io::SetPruned(pruned, PrunedJson(options, report));
  log.Begin("timing");
  {
    DtrSet loaded = pruned;
    io::LoadOptions load;
    load.completed = true;
    for (View& view : loaded.frames.front().views) {
      if (view.role == ViewRole::kSource) io::LoadPixels(writer.folder(), view, load);
    }
    const auto renderer = options.make_timed_renderer();
    report.frame_after = FrameOf(loaded, cameras, setting.render, *renderer);
  }
  ExpectGoalsReached(options, pruned, report);
  log.End();
  io::WriteRunRecord(writer.folder(), log.Record(),
                     {{"frame_before_ms", report.frame_before.median_ms},
                      {"frame_after_ms", report.frame_after.median_ms}});
  writer.Finish(pruned);
  report.bytes_before = BytesOf(set, options.set);
  report.bytes_after = BytesOf(pruned, options.output);
  return report;
}

std::string ToJson(const PruneSetOptions& options, const PruneSetReport& report) {
  Json json = {{"set", options.output.string()}};
  json.update(PrunedJson(options, report));
  json["photo_loss_db"] = NumberOrNull(report.pruned.photo_loss_db);
  json["photo_frame_loss_db"] = NumberOrNull(report.pruned.photo_frame_loss_db);
  json["bytes_before"] = report.bytes_before;
  json["bytes_after"] = report.bytes_after;
  json["bytes_ratio"] =
      static_cast<double>(report.bytes_before) / static_cast<double>(report.bytes_after);
  json["frame_before_ms"] = report.frame_before.median_ms;
  json["frame_after_ms"] = report.frame_after.median_ms;
  json["frame_ratio"] = report.frame_before.median_ms / report.frame_after.median_ms;
  return Text(json);
}

}  // namespace dtr::pipeline
