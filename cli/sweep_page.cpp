// The page of a sweep, and its part of the page of a set.
#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "cli/sweep_output.h"
#include "dtr/report/plot.h"

namespace dtr::cli {
namespace {

std::string MarksOf(const StageFacts& stage, size_t i) {
  std::string marks;
  const auto add = [&](bool is, const char* mark) {
    if (is) marks += (marks.empty() ? "" : ", ") + std::string(mark);
  };
  add(stage.usual && stage.usual->at == i, "default");
  add(stage.knee == i, "knee");
  add(stage.cheapest == i, "cheapest within the loss");
  add(stage.within_budget == i, "best within the budget");
  return marks;
}

std::string CostText(const PointFacts& point) {
  return point.cost_least < point.cost_most ? fmt::format("{:.4g} ({:.4g} to {:.4g})", point.cost,
                                                          point.cost_least, point.cost_most)
                                            : fmt::format("{:.6g}", point.cost);
}

std::string Tip(const StageFacts& stage, const PointFacts& point) {
  std::string tip = point.setting + "\n" + stage.cost_name + ": " + CostText(point) + "\n" +
                    stage.error_name + ": " + fmt::format("{:.4g}", point.error);
  if (point.psnr_db) tip += fmt::format(" ({:.2f} dB)", *point.psnr_db);
  return tip + "\n" + point.command;
}

report::Plot PlotOf(const StageFacts& stage) {
  report::Plot plot;
  plot.x_label = stage.cost_name;
  plot.y_label = stage.error_name;
  plot.front = stage.front;
  for (size_t i = 0; i < stage.points.size(); ++i) {
    const PointFacts& point = stage.points[i];
    auto group = std::ranges::find(plot.groups, point.group);
    if (group == plot.groups.end()) group = plot.groups.insert(group, point.group);
    const std::string marks = MarksOf(stage, i);
    plot.points.push_back({.x = point.cost,
                           .y = point.error,
                           .x_low = point.cost_least,
                           .x_high = point.cost_most,
                           .group = static_cast<size_t>(group - plot.groups.begin()),
                           .tip = Tip(stage, point),
                           .label = marks,
                           .ringed = !marks.empty()});
  }
  return plot;
}

/// Whether the whole build took longer than its stage that was swept, as it must.
bool KnowsBuilds(const StageFacts& stage) {
  return std::ranges::all_of(stage.points, [](const PointFacts& point) {
    return point.build_cpu_s && *point.build_cpu_s >= point.cost;
  });
}

/// The same points over the time of everything from photos to the set.
report::Plot BuildPlotOf(const StageFacts& stage) {
  report::Plot plot = PlotOf(stage);
  plot.x_label = "CPU s of the whole build";
  for (size_t i = 0; i < plot.points.size(); ++i) {
    report::PlotPoint& point = plot.points[i];
    const double others = *stage.points[i].build_cpu_s - stage.points[i].cost;
    point.x += others;
    point.x_low += others;
    point.x_high += others;
  }
  return plot;
}

void AddTable(report::HtmlReport& page, const StageFacts& stage) {
  std::vector<std::string> header{"setting", stage.cost_name, stage.error_name, "PSNR dB",
                                  "front",   "remarks",       "command"};
  std::vector<std::vector<report::Cell>> rows;
  std::vector<size_t> order(stage.points.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::stable_sort(order, {}, [&](size_t i) { return stage.points[i].cost; });
  for (const size_t i : order) {
    const PointFacts& point = stage.points[i];
    const std::string marks = MarksOf(stage, i), lost = WithoutCamera(point);
    rows.push_back({point.setting, CostText(point), fmt::format("{:.4g}", point.error),
                    point.psnr_db ? fmt::format("{:.2f}", *point.psnr_db) : "-",
                    std::string(point.on_front ? "yes" : ""),
                    marks + (marks.empty() || lost.empty() ? "" : ", ") + lost, point.command});
  }
  page.Table(header, rows);
}

std::string Findings(const StageFacts& stage) {
  std::string found;
  if (stage.knee) found += "Knee of the front: " + stage.points[*stage.knee].setting + ". ";
  if (stage.cheapest) {
    found += fmt::format("Cheapest within {:g} dB of the best: {}. ", stage.max_loss_db,
                         stage.points[*stage.cheapest].setting);
  }
  if (!stage.budget) return found;
  return found + (stage.within_budget
                      ? fmt::format("Best within {:g}: {}.", *stage.budget,
                                    stage.points[*stage.within_budget].setting)
                      : fmt::format("Nothing measured is within {:g}.", *stage.budget));
}

void AddStage(report::HtmlReport& page, const StageFacts& stage) {
  page.Section(stage.name + ": " + stage.error_name + " against " + stage.cost_name);
  if (stage.usual) page.Result(stage.usual->on_front, DefaultSentence(stage));
  page.Paragraph(stage.conditions);
  page.Plot(
      "Both axes are logarithmic; bars are the range in which another run may lie. Rest the "
      "pointer on a point for its command.",
      report::ScatterSvg(PlotOf(stage)));
  if (KnowsBuilds(stage)) {
    page.Plot(
        "The same over the processor time of the whole build: what the set records of "
        "calibration and the other stages, and depth.",
        report::ScatterSvg(BuildPlotOf(stage)));
  }
  if (const std::string found = Findings(stage); !found.empty()) page.Paragraph(found);
  AddTable(page, stage);
}

}  // namespace

std::map<std::string, std::string> SweepPlots(const SweepFacts& facts) {
  std::map<std::string, std::string> plots;
  for (const StageFacts& stage : facts.stages) {
    plots[stage.name] = report::ScatterSvg(PlotOf(stage));
    if (KnowsBuilds(stage)) plots["build"] = report::ScatterSvg(BuildPlotOf(stage));
  }
  return plots;
}

void AddSweep(report::HtmlReport& page, const SweepFacts& facts) {
  page.Paragraph(fmt::format("{}; {}, {} cores; dtr {}.", facts.machine.renderer, facts.machine.cpu,
                             facts.machine.cores, facts.machine.version));
  for (const StageFacts& stage : facts.stages) AddStage(page, stage);
}

std::string SweepPage(const SweepFacts& facts) {
  report::HtmlReport page("Error against cost: " + facts.set);
  AddSweep(page, facts);
  return page.Finish();
}

}  // namespace dtr::cli
