// What a sweep found, for people at the console and for programs; sweep_page.cpp has the page.
#include "cli/sweep_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>

#include "dtr/base/files.h"
#include "dtr/base/json_number.h"
#include "dtr/eval/metrics.h"

namespace dtr::cli {
namespace {

using Json = nlohmann::ordered_json;

Json OrNull(const std::optional<size_t>& value) { return value ? Json(*value) : Json(nullptr); }

std::string NameOf(const SweptStage& swept, size_t point) {
  return eval::Describe(swept.stage, swept.points[point].setting);
}

/// {least, median, most} of the calibration loop; null where nothing was timed.
Json MachineJson(const SweptStage& swept) {
  std::vector<double> times_ms;
  for (const eval::SweepPoint& point : swept.points) {
    if (point.measured.machine_ms > 0) times_ms.push_back(point.measured.machine_ms);
  }
  if (times_ms.empty()) return nullptr;
  const eval::Times times = eval::TimesOf(times_ms);
  return {{"least", times.min_ms}, {"median", times.median_ms}, {"most", times.max_ms}};
}

bool OnFront(const SweptStage& swept, size_t point) {
  return std::find(swept.front.begin(), swept.front.end(), point) != swept.front.end();
}

Json PointJson(const SweptStage& swept, size_t i) {
  const eval::SweepPoint& point = swept.points[i];
  Json options = Json::object();
  for (size_t axis = 0; axis < point.setting.size(); ++axis) {
    options[swept.stage.axes[axis].name] =
        swept.stage.axes[axis].values[static_cast<size_t>(point.setting[axis])];
  }
  Json figures = Json::object();
  for (const auto& [name, value] : point.measured.figures) figures[name] = NumberOrNull(value);
  const eval::CostRange range = eval::RangeOf(point, swept.points);
  return {{"setting", NameOf(swept, i)},
          {"options", options},
          {"command", swept.commands[i]},
          {"cost", point.measured.cost},
          {"cost_least", range.least},
          {"cost_most", range.most},
          {"error", point.measured.error},
          {"psnr_db", NumberOrNull(point.measured.psnr_db)},
          {"identical", eval::IdenticalFigures({{"psnr_db", point.measured.psnr_db}})},
          {"machine_ms", point.measured.machine_ms},
          {"on_front", OnFront(swept, i)},
          {"figures", figures}};
}

Json DefaultJson(const std::optional<eval::DefaultAssessment>& usual) {
  if (!usual) return nullptr;
  return {{"at", usual->at},
          {"on_front", usual->on_front},
          {"beaten_by", OrNull(usual->beaten_by)},
          {"within_spread", usual->within_spread}};
}

Json StageJson(const SweptStage& swept) {
  Json points = Json::array();
  for (size_t i = 0; i < swept.points.size(); ++i) points.push_back(PointJson(swept, i));
  return {{"stage", swept.stage.name},
          {"cost", swept.stage.cost_name},
          {"error", swept.stage.error_name},
          {"conditions", swept.conditions},
          {"points", points},
          {"front", swept.front},
          {"knee", OrNull(swept.knee)},
          {"max_loss_db", swept.max_loss_db},
          {"cheapest_within_loss", OrNull(swept.cheapest)},
          {"budget", NumberOrNull(swept.budget)},
          {"best_within_budget", OrNull(swept.within_budget)},
          {"default", DefaultJson(swept.usual)},
          {"machine_ms", MachineJson(swept)}};
}

std::string Figure(const std::optional<double>& value) {
  return value ? fmt::format("{:.2f}", *value) : "-";
}

void SayStage(const StageFacts& stage, Console& console) {
  console.Say(fmt::format("\n{}: {} against {}; {}", stage.name, stage.error_name, stage.cost_name,
                          stage.conditions));
  console.Say(
      fmt::format("   {:>12} {:>24} {:>10} {:>7}  setting", "cost", "range", "error", "dB"));
  std::vector<size_t> order(stage.points.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::stable_sort(order, {}, [&](size_t i) { return stage.points[i].cost; });
  for (const size_t i : order) {
    const PointFacts& point = stage.points[i];
    const std::string lost = WithoutCamera(point);
    console.Say(fmt::format("{} {} {:>11.5g} {:>11.5g} -{:>11.5g} {:>10.4g} {:>7}  {}{}",
                            point.on_front ? '*' : ' ', stage.knee == i ? 'k' : ' ', point.cost,
                            point.cost_least, point.cost_most, point.error, Figure(point.psnr_db),
                            point.setting, lost.empty() ? "" : " (" + lost + ")"));
  }
  console.Say("*: on the Pareto front; k: its knee");
  if (stage.usual) console.Say(DefaultSentence(stage));
  if (stage.cheapest) {
    const PointFacts& cheapest = stage.points[*stage.cheapest];
    console.Say(fmt::format("the cheapest within {:g} dB of the best: {}\n  {}", stage.max_loss_db,
                            cheapest.setting, cheapest.command));
  }
  if (stage.budget && stage.within_budget) {
    const PointFacts& best = stage.points[*stage.within_budget];
    console.Say(
        fmt::format("the best within {:g}: {}\n  {}", *stage.budget, best.setting, best.command));
  } else if (stage.budget) {
    console.Say(fmt::format("nothing measured is within {:g}", *stage.budget));
  }
  if (stage.machine) {
    console.Say(fmt::format(
        "the machine: a fixed piece of work took {:.3g} to {:.3g} ms between points, median {:.3g}",
        stage.machine->min_ms, stage.machine->max_ms, stage.machine->median_ms));
  }
}

/// A field of a CSV line (RFC 4180).
std::string CsvField(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

}  // namespace

void SweptStage::FindDefaults() {
  front = eval::ParetoFront(points);
  knee.reset();
  if (const auto at = eval::KneeOf(points, front)) knee = front[*at];
  cheapest = eval::CheapestWithin(points, max_loss_db);
  within_budget.reset();
  if (budget) within_budget = eval::BestWithin(points, *budget);
  usual = eval::AssessDefault(points, front);
}

void SaySweep(const SweepFacts& facts, Console& console) {
  console.Say(fmt::format("{}; {}, {} cores; dtr {}", facts.machine.renderer, facts.machine.cpu,
                          facts.machine.cores, facts.machine.version));
  for (const StageFacts& stage : facts.stages) SayStage(stage, console);
}

std::filesystem::path SweepFolderOf(const std::filesystem::path& set) {
  const std::filesystem::path folder = WithoutTrailingSlash(set);
  return folder.parent_path() / (folder.stem().string() + "-bench");
}

Json SweepJson(const SweepRun& run) {
  Json stages = Json::array();
  for (const SweptStage& swept : run.stages) stages.push_back(StageJson(swept));
  return {{"set", run.set},
          {"machine",
           {{"cpu", run.machine.cpu},
            {"cores", run.machine.cores},
            {"renderer", run.machine.renderer},
            {"version", run.machine.version},
            {"clock", run.machine.clock}}},
          {"stages", stages}};
}

std::string SweepCsv(const SweepRun& run) {
  std::string csv =
      "stage,setting,cost,cost_least,cost_most,error,psnr_db,on_front,machine_ms,command\n";
  for (const SweptStage& swept : run.stages) {
    for (size_t i = 0; i < swept.points.size(); ++i) {
      const eval::SweepMeasurement& measured = swept.points[i].measured;
      const eval::CostRange range = eval::RangeOf(swept.points[i], swept.points);
      csv +=
          fmt::format("{},{},{},{},{},{},{},{},{},{}\n", swept.stage.name,
                      CsvField(NameOf(swept, i)), measured.cost, range.least, range.most,
                      measured.error, measured.psnr_db ? fmt::format("{}", *measured.psnr_db) : "",
                      OnFront(swept, i) ? 1 : 0, measured.machine_ms, CsvField(swept.commands[i]));
    }
  }
  return csv;
}

}  // namespace dtr::cli
