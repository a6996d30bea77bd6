// cli/selftest/table.h -- runs stability cases and writes what they found.
#pragma once
#include <string>
#include <vector>

#include "cli/selftest/cases.h"
#include "dtr/base/progress.h"

namespace dtr::selftest {

/// A case that was run, or why it was not.
struct Row {
  std::string stage, name;
  bool quick = false;
  Outcome outcome;
  std::string error;    ///< what the case threw, which fails it; empty where it came to its end
  std::string skipped;  ///< why it could not be run here: neither passed nor failed

  /// It was run, every measure holds, everything was finite, nothing was thrown.
  bool passed() const;
  bool failed() const { return skipped.empty() && !passed(); }
};

/// Runs the cases one after the other, only the quick ones if `quick_only`. Ends early, with the
/// rows so far, where `progress` asks for it.
std::vector<Row> RunCases(const std::vector<Case>& cases, bool quick_only, Progress& progress);

/// "58 of 68 cases hold", and how many failed or were skipped, with the reasons.
std::string Summary(const std::vector<Row>& rows);

/// One line a measure, for a terminal: stage, case, what, value, bound, validation result.
std::vector<std::string> TextLines(const Row& row);

/// JSON object: passed (nothing failed),
/// rows[].{stage,case,quick,passed,not_finite,rejection,error,
/// skipped,measures[].{what,value,relation,bound,passed,reason}}. Values that are no numbers are
/// null, and so is `passed` of a row that was skipped.
std::string ToJson(const std::vector<Row>& rows);

/// Page of a row per case: how many values it has, and the one nearest its bound. The same bytes
/// for the same rows.
std::string ToMarkdown(const std::vector<Row>& rows);

}  // namespace dtr::selftest
