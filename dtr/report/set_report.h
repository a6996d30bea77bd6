// dtr/report/set_report.h -- what a set is and how it came about, as a page.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "dtr/report/html.h"
#include "dtr/types/check.h"
#include "dtr/types/dtr_set.h"

namespace dtr::report {

/// A photo that was left out, and why.
struct SkippedItem {
  std::string name;
  std::string reason;
};

/// A stage of the build and its wall-clock time.
struct StageTime {
  std::string name;
  double seconds = 0;
};

/// What a page can say beyond the set itself; what is empty is left out.
struct SetReportInfo {
  std::string title = "D+TR set";
  std::vector<std::pair<std::string, std::string>> facts;  ///< name, value
  std::vector<Check> checks;
  std::vector<SkippedItem> skipped;
  std::vector<StageTime> stages;
  int thumbnail_px = 240;  ///< long side
  /// A view with its pixels, for sets that do not fit into memory; null: what the views have.
  std::function<View(const View&)> load;
  /// Calls `row` for every number below `count`, from any thread; null: one after the other.
  std::function<void(size_t count, const std::function<void(size_t)>& row)> for_rows;
};

/// Adds: facts, validation result and checks, the table of views (thumbnails of image, depth and
/// sigma where loaded; name, role, size, focal length, share of pixels with depth, depth range),
/// skipped photos, stage times.
void AddSetSections(HtmlReport& page, const DtrSet& set, const SetReportInfo& info);

/// A whole page of these sections. Deterministic but for the times given.
std::string SetReport(const DtrSet& set, const SetReportInfo& info);

/// The result in one line: "validation passed".
std::string ValidationResult(const std::vector<Check>& checks);
/// Name, value, limit, outcome and reason of each check.
void AddChecks(HtmlReport& page, const std::vector<Check>& checks);

}  // namespace dtr::report
