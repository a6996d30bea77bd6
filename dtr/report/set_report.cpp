#include "dtr/report/set_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "dtr/report/contact_sheet.h"
#include "dtr/report/false_color.h"

namespace dtr::report {
namespace {

Cell Thumbnail(const ImageRgb8& image, int side_px, std::string description) {
  return Picture{Shrink(image, side_px), std::move(description)};
}

std::string DepthShare(const DepthImage& depth) {
  if (depth.empty()) return "-";
  const auto& z = depth.grid().data();
  const auto kept =
      std::count_if(z.begin(), z.end(), [](float v) { return !DepthImage::IsHole(v); });
  return fmt::format("{:.1f} %", 100.0 * static_cast<double>(kept) / static_cast<double>(z.size()));
}

std::vector<Cell> ViewRow(const View& view, bool with_sigma, int side_px) {
  std::vector<Cell> row;
  row.emplace_back(Thumbnail(view.image, side_px, "photo " + view.name));
  row.emplace_back(Thumbnail(view.depth.empty() ? ImageRgb8() : ColorizeDepth(view.depth), side_px,
                             "depth of " + view.name));
  if (with_sigma) {
    row.emplace_back(
        Thumbnail(view.inverse_depth_sigma ? ColorizeSigma(*view.inverse_depth_sigma) : ImageRgb8(),
                  side_px, "uncertainty of " + view.name));
  }
  row.emplace_back(view.name);
  row.emplace_back(std::string(view.role == ViewRole::kSource ? "source" : "held out"));
  row.emplace_back(fmt::format("{} x {}", view.camera.width_px(), view.camera.height_px()));
  row.emplace_back(fmt::format("{:.1f} px", view.camera.fx_px()));
  row.emplace_back(DepthShare(view.depth));
  row.emplace_back(view.far_z > 0 ? fmt::format("{:.4g} to {:.4g}", view.near_z, view.far_z)
                                  : std::string("-"));
  return row;
}

void AddViews(HtmlReport& page, const std::vector<View>& views, const SetReportInfo& info) {
  const bool with_sigma = std::any_of(views.begin(), views.end(), [&](const View& v) {
    return (info.load && v.sigma_file) ||
           (v.inverse_depth_sigma.has_value() && !v.inverse_depth_sigma->empty());
  });
  std::vector<std::string> header{"Photo", "Depth"};
  if (with_sigma) header.emplace_back("Uncertainty");
  for (const char* name : {"Name", "Role", "Pixels", "Focal length", "With depth", "Depth range"}) {
    header.emplace_back(name);
  }
  std::vector<std::vector<Cell>> rows(views.size());
  const auto row = [&](size_t i) {
    rows[i] = ViewRow(info.load ? info.load(views[i]) : views[i], with_sigma, info.thumbnail_px);
  };
  if (info.for_rows) {
    info.for_rows(rows.size(), row);
  } else {
    for (size_t i = 0; i < rows.size(); ++i) row(i);
  }
  page.Section("Views");
  page.Paragraph(std::string("Depth: closer is brighter, green is a hole.") +
                 (with_sigma ? " Uncertainty of inverse depth: dark is certain." : ""));
  page.Table(header, rows);
}

}  // namespace

std::string ValidationResult(const std::vector<Check>& checks) {
  if (AllPassed(checks)) return fmt::format("validation {}", ResultWord(true));
  const auto failed =
      std::count_if(checks.begin(), checks.end(), [](const Check& check) { return !check.passed; });
  return fmt::format("validation {}: {} of {} tests are beyond their limits", ResultWord(false),
                     failed, checks.size());
}

void AddChecks(HtmlReport& page, const std::vector<Check>& checks) {
  std::vector<std::vector<Cell>> rows;
  const auto number = [](double v) { return std::isfinite(v) ? fmt::format("{:.4g}", v) : "-"; };
  for (const Check& check : checks) {
    rows.push_back({check.name, number(check.value),
                    fmt::format("{} {}", LimitWords(check), number(check.limit)),
                    std::string(ResultWord(check.passed)), check.reason});
  }
  page.Table({"Test", "Value", "Limit", "Result", "Reason"}, rows);
}

void AddSetSections(HtmlReport& page, const DtrSet& set, const SetReportInfo& info) {
  if (!info.checks.empty()) {
    page.Result(AllPassed(info.checks), ValidationResult(info.checks));
  }
  std::vector<std::vector<Cell>> facts;
  for (const auto& [name, value] : info.facts) facts.push_back({name, value});
  facts.push_back({std::string("Unit"), std::string(NameOf(set.unit))});
  facts.push_back(
      {std::string("Scene centre"), fmt::format("({:.4g}, {:.4g}, {:.4g})", set.scene_center.x(),
                                                set.scene_center.y(), set.scene_center.z())});
  page.Section("The set");
  page.Table({"", ""}, facts);
  if (!info.checks.empty()) {
    page.Section("Validation of the calibration");
    AddChecks(page, info.checks);
  }
  for (const Frame& frame : set.frames) AddViews(page, frame.views, info);
  if (!info.skipped.empty()) {
    std::vector<std::vector<Cell>> rows;
    for (const SkippedItem& item : info.skipped) rows.push_back({item.name, item.reason});
    page.Section("Skipped photos");
    page.Table({"Name", "Reason"}, rows);
  }
  if (!info.stages.empty()) {
    std::vector<std::vector<Cell>> rows;
    double total = 0;
    for (const StageTime& stage : info.stages) {
      rows.push_back({stage.name, fmt::format("{:.1f} s", stage.seconds)});
      total += stage.seconds;
    }
    rows.push_back({std::string("all"), fmt::format("{:.1f} s", total)});
    page.Section("Time");
    page.Table({"Stage", "Wall clock"}, rows);
  }
}

std::string SetReport(const DtrSet& set, const SetReportInfo& info) {
  HtmlReport page(info.title);
  AddSetSections(page, set, info);
  return page.Finish();
}

}  // namespace dtr::report
