#include "pipeline/build/stereo.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "dtr/base/error.h"
#include "dtr/base/hash.h"
#include "dtr/eval/json.h"
#include "dtr/io/pruned.h"
#include "dtr/io/set_io.h"
#include "dtr/render/time_steps.h"
#include "pipeline/core/depth/depth_engine.h"
#include "pipeline/core/depth/depth_stage.h"
#include "pipeline/core/depth/quality_json.h"
#include "pipeline/core/photos/input_hash.h"
#include "pipeline/core/reports/prior_json.h"
#include "pipeline/core/reports/set_page.h"
#include "pipeline/core/reports/text.h"
#include "pipeline/core/run/finishing.h"
#include "pipeline/core/run/output_folder.h"
#include "pipeline/core/run/recorded_notes.h"
#include "pipeline/core/run/run_log.h"
#include "pipeline/validate/validate.h"

namespace dtr::pipeline {
namespace {

// The set without pixels and without any depth.
DtrSet ReadForDepth(const std::filesystem::path& folder) {
  DtrSet set = io::ReadSet(folder);
  RequireOneFrame(set);
  if (!set.sparse_file) {
    throw Error(
        folder.string() +
        ": expected sparse points to find depth ranges from, found none; build the set from "
        "its photos with dtr build");
  }
  for (View& view : set.frames.front().views) {
    DropDepth(view);
    if (view.depth_coding == DepthCoding::kZstdInverseDepth) {
      view.depth_coding = View{}.depth_coding;  // its steps were for the old range
      view.depth_steps = 0;
    }
  }
  return set;
}

// set.json does not tell what held-out files contain.
nlohmann::json HeldOutHashes(const DtrSet& set) {
  auto hashes = nlohmann::json::array();
  for (const View& view : set.frames.front().views) {
    if (view.role == ViewRole::kHeldOut) hashes.push_back(view.image_file->sha256);
  }
  return hashes;
}

// The images of the old set in the new one.
void CopyImages(const std::filesystem::path& from, DtrSet& set, io::SetWriter& writer,
                Progress& progress) {
  io::LoadOptions load;
  load.depth = false;
  for (View& view : set.frames.front().views) {
    progress.ThrowIfInterrupted();
    io::LoadPixels(from, view, load);
    StoreImage(view, set.unit, writer);
  }
}

}  // namespace

std::string ToJson(const RecomputeReport& report) {
  nlohmann::ordered_json json = {{"set", report.written.string()},
                                 {"depth_maps", report.depth_maps},
                                 {"depth_completeness", report.depth_completeness}};
  if (report.prior) json["depth_prior"] = JsonOf(*report.prior);
  return Text(json);
}

RecomputeReport RecomputeDepth(const RecomputeOptions& options, Progress& listener) {
  const stereo::QualitySettings quality = QualityOf(options.depth);
  RequireEngine(options.depth);
  const bool in_place = options.output.empty();
  RunLog log;
  RecordedNotes progress(listener);
  log.Begin("depth");
  RecomputeReport report;
  report.written = in_place ? options.set : options.output;
  DtrSet set = ReadForDepth(options.set);
  const SparseScene sparse = io::LoadSparse(options.set, set);

  const nlohmann::json fingerprint = {{"tool_version", DTR_VERSION},
                                      {"settings", SettingsJson(options.depth.engine, quality)},
                                      {"time_budget_s", options.depth.time_budget_s.value_or(0)},
                                      {"depth_error_px", options.depth.depth_error_px.value_or(0)},
                                      {"completion", options.depth.completion},
                                      {"seed", options.seed},
                                      {"workspace_sha256", InputHash(options.depth.workspace)},
                                      {"prior", PriorJson(options.depth.prior)},
                                      {"prior_sha256", InputHash(options.depth.prior.folder)},
                                      {"set_sha256", Sha256OfFile(options.set / "set.json")},
                                      {"held_out", HeldOutHashes(set)}};
  io::SetWriter writer(report.written, fingerprint.dump(), in_place || options.force);
  // What an earlier run delivered before it was cut off is in the way of nobody.
  if (!options.normals.empty() && !options.force && !writer.resumed()) {
    RequireFree(options.normals, NormalFileNames(set));
  }
  CopyImages(options.set, set, writer, progress);
  const DepthStageResult stage = DepthStage(set, sparse, options.depth, quality,
                                            {options.seed, options.normals}, writer, progress);
  report.prior = stage.prior;
  // What was left out of the former depth says nothing of this.
  if (!io::PrunedJson(set).empty()) {
    progress.Note("the record of what was pruned goes with the depth that was pruned");
    io::SetPrunedJson(set, "");
  }
  const double memory_gb = options.depth.memory_gb.value_or(kDefaultMemoryGb);
  FinishScene(set, {}, writer, memory_gb, progress);
  if (options.depth.depth_error_px) {
    RecodeDepth(set, *options.depth.depth_error_px, writer, memory_gb, progress);
  }
  if (options.depth.completion) {
    CompleteDepth(set, sparse, writer, memory_gb, progress);
  }
  const DepthCount count = WriteMeshes(set, writer, memory_gb, progress);
  writer.WriteSparse(set, sparse);
  nlohmann::ordered_json provenance = nlohmann::ordered_json::parse(set.provenance_json);
  provenance["depth_engine"] = options.depth.engine;
  auto& recorded = provenance["options"];
  if (!recorded.is_object()) recorded = nlohmann::ordered_json::object();  // an imported set
  for (const char* old : {"neighbours", "pass_neighbours", "iterations", "passes",
                          "round_neighbours", "rounds"}) {  // the last two: sets of 0.1
    recorded.erase(old);
  }
  recorded.update(SettingsJson(options.depth.engine, stage.quality));
  recorded.erase("depth_prior");
  provenance.erase("depth_prior");
  if (options.depth.prior.given()) recorded["depth_prior"] = PriorJson(options.depth.prior);
  if (stage.prior) provenance["depth_prior"] = JsonOf(*stage.prior);
  recorded["seed"] = options.seed;
  recorded["completion"] = options.depth.completion;
  recorded.erase("depth_error_px");
  if (options.depth.depth_error_px) recorded["depth_error_px"] = *options.depth.depth_error_px;
  set.provenance_json = provenance.dump();
  report.depth_maps = count.maps;
  report.depth_completeness = count.Completeness();
  SetLimits limits;
  limits.memory_gb = std::min(limits.memory_gb, options.depth.memory_gb.value_or(kDefaultMemoryGb));
  const auto validation = ValidateSet(writer.folder(), set, sparse, limits, progress);
  set.validation_json =
      eval::ValidationJson(validation.tests);  // other depth, other validation result
  WriteSetPage(writer, set,
               {.name = report.written.stem().string(),
                .engine = options.depth.engine,
                .checks = validation.tests,
                .skipped = {},
                .prior = report.prior,
                .memory_gb = memory_gb},
               progress);
  log.End();
  io::WriteRunRecord(writer.folder(), log.Record(progress.lines()));
  writer.Finish(set);
  return report;
}

}  // namespace dtr::pipeline
