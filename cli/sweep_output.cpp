// What a sweep found, for people at the console and for programs; sweep_page.cpp has the page.
#include "cli/sweep_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>

namespace dtr::cli {
namespace {

using Json = nlohmann::ordered_json;

template <typename T>
Json OrNull(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

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
  return {{"least", times.least_ms}, {"median", times.median_ms}, {"most", times.most_ms}};
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
  const eval::CostRange range = eval::RangeOf(point, swept.points);
  return {{"setting", NameOf(swept, i)},
          {"options", options},
          {"command", swept.commands[i]},
          {"cost", point.measured.cost},
          {"cost_least", range.least},
          {"cost_most", range.most},
          {"error", point.measured.error},
          {"psnr_db", OrNull(point.measured.psnr_db)},
          {"machine_ms", point.measured.machine_ms},
          {"on_front", OnFront(swept, i)},
          {"figures", point.measured.figures}};
}

Json DefaultJson(const std::optional<eval::DefaultVerdict>& usual) {
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
          {"budget", OrNull(swept.budget)},
          {"best_within_budget", OrNull(swept.within_budget)},
          {"default", DefaultJson(swept.usual)},
          {"machine_ms", MachineJson(swept)}};
}

std::string Figure(const std::optional<double>& value) {
  return value ? fmt::format("{:.2f}", *value) : "-";
}

void SayStage(const SweptStage& swept, Console& console) {
  console.Say(fmt::format("\n{}: {} against {}; {}", swept.stage.name, swept.stage.error_name,
                          swept.stage.cost_name, swept.conditions));
  console.Say(
      fmt::format("   {:>12} {:>24} {:>10} {:>7}  setting", "cost", "range", "error", "dB"));
  std::vector<size_t> order(swept.points.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return swept.points[a].measured.cost < swept.points[b].measured.cost;
  });
  for (const size_t i : order) {
    const eval::SweepPoint& point = swept.points[i];
    const eval::CostRange range = eval::RangeOf(point, swept.points);
    const std::string lost = WithoutCamera(point);
    console.Say(fmt::format("{} {} {:>11.5g} {:>11.5g} -{:>11.5g} {:>10.4g} {:>7}  {}{}",
                            OnFront(swept, i) ? '*' : ' ', swept.knee == i ? 'k' : ' ',
                            point.measured.cost, range.least, range.most, point.measured.error,
                            Figure(point.measured.psnr_db), NameOf(swept, i),
                            lost.empty() ? "" : " (" + lost + ")"));
  }
  console.Say("*: on the Pareto front; k: its knee");
  if (swept.usual) console.Say(DefaultSentence(swept));
  if (swept.cheapest) {
    console.Say(fmt::format("the cheapest within {:g} dB of the best: {}\n  {}", swept.max_loss_db,
                            NameOf(swept, *swept.cheapest), swept.commands[*swept.cheapest]));
  }
  if (swept.budget) {
    console.Say(swept.within_budget
                    ? fmt::format("the best within {:g}: {}\n  {}", *swept.budget,
                                  NameOf(swept, *swept.within_budget),
                                  swept.commands[*swept.within_budget])
                    : fmt::format("nothing measured is within {:g}", *swept.budget));
  }
  if (const Json machine = MachineJson(swept); !machine.is_null()) {
    console.Say(fmt::format(
        "the machine: a fixed piece of work took {:.3g} to {:.3g} ms between points, median {:.3g}",
        machine["least"].get<double>(), machine["most"].get<double>(),
        machine["median"].get<double>()));
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

void SweptStage::Judge() {
  front = eval::ParetoFront(points);
  knee.reset();
  if (const auto at = eval::KneeOf(points, front)) knee = front[*at];
  cheapest = eval::CheapestWithin(points, max_loss_db);
  within_budget.reset();
  if (budget) within_budget = eval::BestWithin(points, *budget);
  usual = eval::JudgeDefault(points, front);
}

std::string WithoutCamera(const eval::SweepPoint& point) {
  const auto count = point.measured.figures.find("not_registered");
  if (count == point.measured.figures.end() || count->second == 0) return "";
  return fmt::format("{:g} photo{} without a camera", count->second, count->second == 1 ? "" : "s");
}

std::string DefaultSentence(const SweptStage& swept) {
  if (!swept.usual) return "the default was not measured";
  if (swept.usual->on_front) return "the default is on the Pareto front";
  const eval::SweepMeasurement& usual = swept.points[swept.usual->at].measured;
  const eval::SweepMeasurement& better = swept.points[*swept.usual->beaten_by].measured;
  std::string gain;
  if (usual.psnr_db && better.psnr_db) {
    gain = fmt::format(", {:+.3f} dB", *better.psnr_db - *usual.psnr_db);
  } else {
    gain = fmt::format(", {:.2f} of its error", better.error / usual.error);
  }
  return fmt::format("the default is not on the Pareto front: {} takes {:.2f} of its cost{}{}",
                     NameOf(swept, *swept.usual->beaten_by), better.cost / usual.cost, gain,
                     swept.usual->within_spread ? " (the ranges of the two costs overlap)" : "");
}

void SaySweep(const SweepRun& run, Console& console) {
  console.Say(fmt::format("{}; {}, {} cores; dtr {}", run.machine.renderer, run.machine.cpu,
                          run.machine.cores, run.machine.version));
  for (const SweptStage& swept : run.stages) SayStage(swept, console);
}

std::string SweepJson(const SweepRun& run) {
  Json stages = Json::array();
  for (const SweptStage& swept : run.stages) stages.push_back(StageJson(swept));
  const Json json{{"set", run.set},
                  {"machine",
                   {{"cpu", run.machine.cpu},
                    {"cores", run.machine.cores},
                    {"renderer", run.machine.renderer},
                    {"version", run.machine.version},
                    {"clock", run.machine.clock}}},
                  {"stages", stages}};
  return json.dump(1);
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
