// The page of a sweep.
#include <fmt/format.h>

#include <algorithm>

#include "cli/sweep_output.h"
#include "dtr/report/html.h"
#include "dtr/report/plot.h"

namespace dtr::cli {
namespace {

std::string MarksOf(const SweptStage& swept, size_t i) {
  std::string marks;
  const auto add = [&](bool is, const char* mark) {
    if (is) marks += (marks.empty() ? "" : ", ") + std::string(mark);
  };
  add(swept.usual && swept.usual->at == i, "default");
  add(swept.knee == i, "knee");
  add(swept.cheapest == i, "cheapest within the loss");
  add(swept.within_budget == i, "best within the budget");
  return marks;
}

std::string CostText(const SweptStage& swept, const eval::SweepPoint& point) {
  const eval::CostRange range = eval::RangeOf(point, swept.points);
  return range.least < range.most ? fmt::format("{:.4g} ({:.4g} to {:.4g})", point.measured.cost,
                                                range.least, range.most)
                                  : fmt::format("{:.6g}", point.measured.cost);
}

std::string Tip(const SweptStage& swept, size_t i) {
  const eval::SweepPoint& point = swept.points[i];
  std::string tip = eval::Describe(swept.stage, point.setting) + "\n" + swept.stage.cost_name +
                    ": " + CostText(swept, point) + "\n" + swept.stage.error_name + ": " +
                    fmt::format("{:.4g}", point.measured.error);
  if (point.measured.psnr_db) tip += fmt::format(" ({:.2f} dB)", *point.measured.psnr_db);
  return tip + "\n" + swept.commands[i];
}

report::Plot PlotOf(const SweptStage& swept) {
  report::Plot plot;
  plot.x_label = swept.stage.cost_name;
  plot.y_label = swept.stage.error_name;
  plot.groups = swept.stage.axes.front().values;
  plot.front = swept.front;
  for (size_t i = 0; i < swept.points.size(); ++i) {
    const eval::SweepPoint& point = swept.points[i];
    const eval::CostRange range = eval::RangeOf(point, swept.points);
    const std::string marks = MarksOf(swept, i);
    plot.points.push_back({.x = point.measured.cost,
                           .y = point.measured.error,
                           .x_low = range.least,
                           .x_high = range.most,
                           .group = static_cast<size_t>(point.setting.front()),
                           .tip = Tip(swept, i),
                           .label = marks,
                           .ringed = !marks.empty()});
  }
  return plot;
}

constexpr const char* kBuildCost = "build_cpu_s";

bool KnowsBuilds(const SweptStage& swept) {
  return std::all_of(swept.points.begin(), swept.points.end(), [](const eval::SweepPoint& point) {
    return point.measured.figures.contains(kBuildCost);
  });
}

/// The same points over the time of everything from photos to the set.
report::Plot BuildPlotOf(const SweptStage& swept) {
  report::Plot plot = PlotOf(swept);
  plot.x_label = "CPU s of the whole build";
  for (size_t i = 0; i < plot.points.size(); ++i) {
    report::PlotPoint& point = plot.points[i];
    const eval::SweepMeasurement& measured = swept.points[i].measured;
    const double others = measured.figures.at(kBuildCost) - measured.cost;
    point.x += others;
    point.x_low += others;
    point.x_high += others;
  }
  return plot;
}

void AddTable(report::HtmlReport& page, const SweptStage& swept) {
  std::vector<std::string> header{
      "setting", swept.stage.cost_name, swept.stage.error_name, "PSNR dB", "front", "remarks",
      "command"};
  std::vector<std::vector<report::Cell>> rows;
  std::vector<size_t> order(swept.points.size());
  for (size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return swept.points[a].measured.cost < swept.points[b].measured.cost;
  });
  for (const size_t i : order) {
    const eval::SweepPoint& point = swept.points[i];
    const bool front = std::find(swept.front.begin(), swept.front.end(), i) != swept.front.end();
    const std::string marks = MarksOf(swept, i), lost = WithoutCamera(point);
    rows.push_back({eval::Describe(swept.stage, point.setting), CostText(swept, point),
                    fmt::format("{:.4g}", point.measured.error),
                    point.measured.psnr_db ? fmt::format("{:.2f}", *point.measured.psnr_db) : "-",
                    std::string(front ? "yes" : ""),
                    marks + (marks.empty() || lost.empty() ? "" : ", ") + lost, swept.commands[i]});
  }
  page.Table(header, rows);
}

void AddStage(report::HtmlReport& page, const SweptStage& swept) {
  page.Section(swept.stage.name + ": " + swept.stage.error_name + " against " +
               swept.stage.cost_name);
  if (swept.usual) page.Verdict(swept.usual->on_front, DefaultSentence(swept));
  page.Paragraph(swept.conditions);
  page.Plot(
      "Both axes are logarithmic; bars are the range in which another run may lie. Rest the "
      "pointer on a point for its command.",
      report::ScatterSvg(PlotOf(swept)));
  if (KnowsBuilds(swept)) {
    page.Plot(
        "The same over the processor time of the whole build: what the set records of "
        "calibration and the other stages, and depth.",
        report::ScatterSvg(BuildPlotOf(swept)));
  }
  std::string found;
  if (swept.knee) {
    found +=
        "Knee of the front: " + eval::Describe(swept.stage, swept.points[*swept.knee].setting) +
        ". ";
  }
  if (swept.cheapest) {
    found += fmt::format("Cheapest within {:g} dB of the best: {}. ", swept.max_loss_db,
                         eval::Describe(swept.stage, swept.points[*swept.cheapest].setting));
  }
  if (swept.budget) {
    found +=
        swept.within_budget
            ? fmt::format("Best within {:g}: {}.", *swept.budget,
                          eval::Describe(swept.stage, swept.points[*swept.within_budget].setting))
            : fmt::format("Nothing measured is within {:g}.", *swept.budget);
  }
  if (!found.empty()) page.Paragraph(found);
  AddTable(page, swept);
}

}  // namespace

std::map<std::string, std::string> SweepPlots(const SweepRun& run) {
  std::map<std::string, std::string> plots;
  for (const SweptStage& swept : run.stages) {
    plots[swept.stage.name] = report::ScatterSvg(PlotOf(swept));
    if (KnowsBuilds(swept)) plots["build"] = report::ScatterSvg(BuildPlotOf(swept));
  }
  return plots;
}

std::string SweepPage(const SweepRun& run) {
  report::HtmlReport page("Error against cost: " + run.set);
  page.Paragraph(fmt::format("{}; {}, {} cores; dtr {}.", run.machine.renderer, run.machine.cpu,
                             run.machine.cores, run.machine.version));
  for (const SweptStage& swept : run.stages) AddStage(page, swept);
  return page.Finish();
}

}  // namespace dtr::cli
