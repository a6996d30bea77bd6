// cli/sweep_output.h -- what a sweep found: table, JSON, CSV, page.
#pragma once
#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/console.h"
#include "cli/sweep_facts.h"
#include "dtr/eval/bench_json.h"
#include "dtr/eval/sweep.h"
#include "dtr/report/html.h"

namespace dtr::cli {

/// A stage that was swept, and what is to be said of it.
struct SweptStage {
  eval::SweepStage stage;
  std::vector<eval::SweepPoint> points;
  std::vector<std::string> commands;  ///< that measure each point alone
  std::string conditions;             ///< "3 held-out photos, 960x640, medians of 5 frames"
  double max_loss_db = 0;
  std::optional<double> budget;  ///< of cost, where one was given for this stage

  std::vector<size_t> front;
  std::optional<size_t> knee;  ///< index into points, as those below
  std::optional<size_t> cheapest, within_budget;
  std::optional<eval::DefaultAssessment> usual;
  /// Fills in the last five from the points.
  void FindDefaults();
};

/// All of a run of `dtr bench`.
struct SweepRun {
  std::string set;
  eval::BenchMachine machine;
  std::vector<SweptStage> stages;
};

void SaySweep(const SweepFacts& facts, Console& console);
/// {set, machine:{cpu,cores,renderer,version,clock}, stages:[{stage,cost,error,conditions,
///  points:[{setting,options:{AXIS:VALUE},command,cost,cost_least,cost_most,error,psnr_db,
///  machine_ms,on_front,figures:{...}}], front:[index], knee, max_loss_db, cheapest_within_loss,
///  budget, best_within_budget, default:{at,on_front,beaten_by,within_spread},
///  machine_ms:{least,median,most}}]}. What is not there is null.
nlohmann::ordered_json SweepJson(const SweepRun& run);
/// A line per point: stage,setting,cost,cost_least,cost_most,error,psnr_db,on_front,machine_ms,
/// command.
std::string SweepCsv(const SweepRun& run);
/// An offline page: a plot of each stage, error over cost on logarithmic axes, and its table.
std::string SweepPage(const SweepFacts& facts);
/// The same sections on another page, after what measured them.
void AddSweep(report::HtmlReport& page, const SweepFacts& facts);
/// The plots of a run as SVG, by name: one per stage, and `build` where depth was swept on a set
/// that records what its calibration took: the error over the time of a whole build.
std::map<std::string, std::string> SweepPlots(const SweepFacts& facts);

/// Where `dtr bench` writes if not told, and its file with the sweep: NAME-bench beside the set.
std::filesystem::path SweepFolderOf(const std::filesystem::path& set);
inline constexpr char kSweepFile[] = "bench.json";
inline constexpr char kWorkFile[] = "work.json";  ///< measurements, from which a sweep goes on

}  // namespace dtr::cli
