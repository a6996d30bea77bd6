// What a run leaves for the next one, and for reports. Ours, but on disks that others write to.
#include <nlohmann/json.hpp>

#include "cli/sweep_facts.h"
#include "cli/sweep_store.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/io/run_record.h"
#include "pipeline/core/depth/quality_json.h"
#include "pipeline/core/depth_settings.h"
#include "pipeline/core/photos/rig_timestamps.h"
#include "pipeline/prune/detail/prune_journal.h"
#include "tests/calib/sfm/run/some_graph.h"
#include "tests/fuzz/readers.h"

namespace dtr::fuzz {
namespace {

namespace fs = std::filesystem;
constexpr std::uintmax_t kSeedLimitBytes = 1 << 20;

Reader OpenRunRecord(const fs::path& folder) {
  const fs::path file = folder / "report" / "run.json";
  fs::create_directories(file.parent_path());
  return {file,
          {R"({"stages": [{"name": "depth", "wall_s": 2.5, "cpu_s": 4.75, "peak_rss_kib": 90000},
                          {"name": "report"}, 7], "host": {"cores": 2}})"},
          [=] { io::ReadRunStages(folder); }};
}

Reader OpenPruneJournal(const fs::path& folder) {
  const fs::path file = folder / "measured.jsonl";
  pipeline::PruneJournal journal(file);
  journal.Add("frame before", {4.25, 0.5});
  journal.Add("bytes 1 0 1", {1e6});
  return {file, {ReadFile(file, kSeedLimitBytes)}, [=] {
            const pipeline::PruneJournal read(file);
            // A last line without an end is passed over: files of nothing else would crowd out the
            // rest.
            const bool frame = read.Find("frame before", 2).has_value();
            const bool bytes = read.Find("bytes 1 0 1", 1).has_value();
            if (!frame && !bytes) throw Error("nothing to go on from");
          }};
}

Reader OpenSweep(const fs::path& folder) {
  const fs::path file = folder / "work.json";
  const eval::SweepStage stage;
  eval::SweepMeasurement measured;
  measured.cost = 3;
  measured.cost_least = 2;
  measured.cost_most = 4;
  measured.error = 0.25;
  measured.psnr_db = 30;
  measured.figures["views"] = 7;
  cli::SweepFile sweep(file);
  sweep.Of(stage, "conditions")->Keep({}, measured);
  return {file, {ReadFile(file, kSeedLimitBytes)}, [=] {
            // What was taken can be kept beside something new.
            cli::SweepFile read(file);
            read.Of(stage, "others")->Keep({}, measured);
          }};
}

Reader OpenTimestamps(const fs::path& folder) {
  const fs::path file = folder / "timestamps.csv";
  return {file,
          {"sync_index,cam_id,frame_index\n0,0,0\n0,1,2\n1,0,1\n1,1,3\n",
           "frame_index,cam_id,seconds,sync_index\r\n12,0,0.25,0\r\n13,0,0.5,1\r\n",
           "\xEF\xBB\xBF\"sync_index\";\"cam_id\";\"frame_time\"\n0;0;1.5\n0;1;\n1;1.0;2.5\n"},
          [=] { pipeline::ReadRigTimestamps(file); }};
}

// What `dtr bench` wrote, read back by `dtr inspect`.
Reader OpenBench(const fs::path& folder) {
  const fs::path file = folder / "bench.json";
  return {
      file,
      {R"({"set": "a.dtr", "machine": {"cpu": "c", "cores": 2, "renderer": "r", "version": "1", "clock": "wall"},
 "stages": [{"stage": "stereo", "cost": "CPU s", "error": "RMS", "conditions": "one run", "points": [
  {"setting": "default", "options": {"engine": "sgbm"}, "command": "dtr bench", "cost": 9, "cost_least": 8,
   "cost_most": 10.5, "error": 2, "psnr_db": 20.5, "machine_ms": 2.5, "on_front": false, "figures": {"build_cpu_s": 34}},
  {"setting": "other", "options": {"engine": "none"}, "command": "dtr bench", "cost": 7, "cost_least": 6,
   "cost_most": 8, "error": 1, "psnr_db": null, "machine_ms": 2.5, "on_front": true, "figures": {"not_registered": 1}}],
  "front": [1], "knee": 1, "max_loss_db": 0.1, "cheapest_within_loss": 1, "budget": null, "best_within_budget": null,
  "default": {"at": 0, "on_front": false, "beaten_by": 1, "within_spread": true},
  "machine_ms": {"least": 2, "median": 2.5, "most": 3}}]})"},
      [=] {
        const auto facts = cli::ReadSweep(ReadFile(file, kSeedLimitBytes), file.string());
        for (const cli::StageFacts& stage : facts.stages) {
          cli::DefaultSentence(stage);
          for (const cli::PointFacts& point : stage.points) cli::WithoutCamera(point);
        }
      }};
}

Reader OpenEffort(const fs::path& folder) {
  const fs::path file = folder / "effort.json";
  return {file, {pipeline::SettingsJson("patchmatch", {}).dump()}, [=] {
            pipeline::QualityFromJson(ReadFile(file, kSeedLimitBytes), file.string());
          }};
}

Reader OpenSfmFeatures(const fs::path& folder) {
  const fs::path file = folder / "features.bin";
  sfm::testing::WriteSomeFeatures(file);
  return {file, {ReadFile(file, kSeedLimitBytes)}, [=] {
            const sfm::FeatureFile read(file);
            read.Of(0);
            read.Of(1);
          }};
}

Reader OpenSfmMatches(const fs::path& folder) {
  const fs::path file = folder / "matches.bin", features = folder / "features.bin";
  sfm::testing::WriteSomeFeatures(features);
  sfm::WriteMatches(file, sfm::testing::SomeGraph());
  return {file, {ReadFile(file, kSeedLimitBytes)}, [=] {
            sfm::ReadMatches(file, sfm::FeatureFile(features),
                             std::vector<std::string>{"a.jpg", "b.jpg"});
          }};
}

constexpr ReaderKind kReaders[] = {
    {"bench", OpenBench},
    {"effort", OpenEffort},
    {"run-record", OpenRunRecord},
    {"prune-journal", OpenPruneJournal},
    {"sweep", OpenSweep},
    {"rig-timestamps", OpenTimestamps},
    {"sfm-features", OpenSfmFeatures},
    {"sfm-matches", OpenSfmMatches},
};

}  // namespace

std::span<const ReaderKind> WorkReaders() { return kReaders; }

}  // namespace dtr::fuzz
