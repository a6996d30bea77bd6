#include "cli/selftest/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>

#include "dtr/base/error.h"

namespace dtr::selftest {
namespace {

using Json = nlohmann::ordered_json;

const char* Sign(Relation relation) {
  if (relation == Relation::kAtMost) return "<=";
  return relation == Relation::kAtLeast ? ">=" : "=";
}

std::string HoldsOrFails(bool holds) { return holds ? "holds" : "FAILS"; }

/// Three digits: more differ from one mathematical library to the next.
std::string Number(double value) { return fmt::format("{:.3g}", value); }

std::string BoundOf(const Measure& m) {
  return fmt::format("{} {:.6g}", Sign(m.relation), m.bound);
}

/// What else fails a row, in words; empty where nothing does.
std::string OtherFaults(const Row& row) {
  if (!row.error.empty()) return "ended with: " + row.error;
  if (row.outcome.not_finite > 0) {
    return fmt::format("{} numbers are NaN or infinite", row.outcome.not_finite);
  }
  return "";
}

Json ToJson(const Measure& m) {
  Json json = {{"what", m.what},   {"value", nullptr},   {"relation", Sign(m.relation)},
               {"bound", m.bound}, {"passed", Holds(m)}, {"reason", m.reason}};
  if (std::isfinite(m.value)) json["value"] = m.value;
  return json;
}

/// A cell of a Markdown table.
std::string Cell(std::string text) {
  std::replace(text.begin(), text.end(), '`', '\'');  // within a code span
  for (size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) {
    text.insert(at, "\\");
  }
  return text;
}

/// Distance of a value from its bound, as a share of the bound; negative where it fails. Values
/// that have to be exact come last while they hold.
double Slack(const Measure& m) {
  if (m.relation == Relation::kEquals) {
    return Holds(m) ? std::numeric_limits<double>::infinity() : -1;
  }
  const double distance = m.relation == Relation::kAtMost ? m.bound - m.value : m.value - m.bound;
  return std::isnan(distance) ? -1 : distance / std::max(std::abs(m.bound), 1e-300);
}

std::string MarkdownRow(const Row& row) {
  const std::string name = Cell(row.name) + (row.quick ? " *" : "");
  const std::vector<Measure>& all = row.outcome.measures;
  if (!row.skipped.empty()) return fmt::format("| {} | SKIPPED | {} |\n", name, Cell(row.skipped));
  std::string nearest = OtherFaults(row);
  if (nearest.empty() && !all.empty()) {
    const Measure& m = *std::ranges::min_element(all, {}, Slack);
    nearest = fmt::format("{}: {} ({})", m.what, Number(m.value), BoundOf(m));
  }
  return fmt::format("| {} | {}{} | {} |\n", name, all.size(), row.passed() ? "" : " FAILS",
                     Cell(nearest));
}

constexpr const char* kIntroduction =
    "# Stability on stiff and extreme cases\n\n"
    "Written by `dtr selftest --stability -o PAGE.md`; do not edit. Of each case: how many values\n"
    "are checked, and the one nearest its bound; `--json -` lists all with the reasons of their\n"
    "bounds. A case holds where every value does and no number is NaN or infinite; the command\n"
    "exits with 1 where one fails. `dtr selftest` runs the short form (cases marked *), as does\n"
    "`./check`. No value depends on the number of threads. What a program or machine without\n"
    "OpenGL cannot run is SKIPPED.\n";

}  // namespace

bool Holds(const Measure& m) {
  if (m.relation == Relation::kAtMost) return m.value <= m.bound;
  if (m.relation == Relation::kAtLeast) return m.value >= m.bound;
  return m.value == m.bound;
}

void ExpectRejection(Outcome& outcome, const std::string& what, const std::function<void()>& work) {
  bool refused = false;
  try {
    work();
  } catch (const Error& error) {
    refused = true;
    outcome.rejection = error.what();
  }
  outcome.Add(Exactly(what + " is rejected", refused, 1, "nothing is solved that cannot be"));
}

bool Row::passed() const {
  return skipped.empty() && OtherFaults(*this).empty() && !outcome.measures.empty() &&
         std::ranges::all_of(outcome.measures, Holds);
}

std::vector<Row> RunCases(const std::vector<Case>& cases, bool quick_only, Progress& progress) {
  std::vector<const Case*> chosen;
  for (const Case& each : cases) {
    if (each.quick || !quick_only) chosen.push_back(&each);
  }
  progress.Stage("stability", static_cast<int>(chosen.size()));
  std::vector<Row> rows;
  for (const Case* each : chosen) {
    if (progress.StopRequested()) break;
    Row row{each->stage, each->name, each->quick, {}, {}, each->skipped};
    try {
      if (row.skipped.empty()) row.outcome = each->run();
    } catch (const std::exception& error) {  // a case that throws must not end the others
      row.error = error.what();
    }
    rows.push_back(std::move(row));
    progress.Update(static_cast<int>(rows.size()));
  }
  return rows;
}

std::vector<Case> AllCases(std::span<const NamedRenderer> renderers) {
  std::vector<Case> all;
  for (std::vector<Case>& stage : std::vector{BundleCases(), StereoCases(), DepthCodingCases(),
                                              BlendingCases(), RenderingCases(renderers)}) {
    std::ranges::move(stage, std::back_inserter(all));
  }
  return all;
}

std::string Summary(const std::vector<Row>& rows) {
  std::string text =
      fmt::format("{} of {} cases hold", std::ranges::count_if(rows, &Row::passed), rows.size());
  std::vector<std::pair<std::string, int>> skipped;  // by what is missing, in the table's order
  for (const Row& row : rows) {
    if (row.skipped.empty()) continue;
    const std::string why = row.stage + ": " + row.skipped;
    if (skipped.empty() || skipped.back().first != why) skipped.emplace_back(why, 0);
    ++skipped.back().second;
  }
  for (const auto& [why, count] : skipped) {
    text += fmt::format("; {} SKIPPED: {}", count, why);
  }
  return text;
}

std::vector<std::string> TextLines(const Row& row) {
  std::vector<std::string> lines;
  if (!row.skipped.empty()) {
    return {fmt::format("SKIPPED {}: {}: {}", row.stage, row.name, row.skipped)};
  }
  for (const Measure& m : row.outcome.measures) {
    lines.push_back(fmt::format("{:<5} {}: {}: {}: {} ({})", HoldsOrFails(Holds(m)), row.stage,
                                row.name, m.what, Number(m.value), BoundOf(m)));
  }
  if (!row.outcome.rejection.empty())
    lines.push_back("      rejected with: " + row.outcome.rejection);
  const std::string faults = OtherFaults(row);
  if (!faults.empty())
    lines.push_back(fmt::format("FAILS {}: {}: {}", row.stage, row.name, faults));
  return lines;
}

std::string ToJson(const std::vector<Row>& rows) {
  Json root = {{"passed", std::ranges::none_of(rows, &Row::failed)}, {"rows", Json::array()}};
  for (const Row& row : rows) {
    Json json = {{"stage", row.stage},
                 {"case", row.name},
                 {"quick", row.quick},
                 {"passed", row.skipped.empty() ? Json(row.passed()) : Json(nullptr)},
                 {"not_finite", row.outcome.not_finite},
                 {"rejection", row.outcome.rejection},
                 {"error", row.error},
                 {"skipped", row.skipped},
                 {"measures", Json::array()}};
    for (const Measure& m : row.outcome.measures) json["measures"].push_back(ToJson(m));
    root["rows"].push_back(std::move(json));
  }
  return root.dump(2) + "\n";
}

std::string ToMarkdown(const std::vector<Row>& rows) {
  std::string text = kIntroduction;
  text += "\n" + Summary(rows) + ".\n";
  std::string stage;
  for (const Row& row : rows) {
    if (row.stage != stage) {
      text += fmt::format(
          "\n## {}\n\n| case | values | the one nearest its bound |\n|---|---|---|\n", row.stage);
    }
    stage = row.stage;
    text += MarkdownRow(row);
  }
  return text;
}

}  // namespace dtr::selftest
