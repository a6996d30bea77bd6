// cli/selftest/table.h -- runs stability cases and writes what they found.
#pragma once
#include <string>
#include <vector>

#include "cli/selftest/cases.h"
#include "dtr/base/progress.h"

namespace dtr::selftest {

/// A case that was run.
struct Row {
  std::string stage, name;
  bool quick = false;
  Outcome outcome;
  std::string error;  ///< what the case threw, which fails it; empty where it came to its end

  /// Every measure holds, everything was finite, nothing was thrown.
  bool passed() const;
};

/// Runs the cases one after the other, only the quick ones if `quick_only`. Ends early, with the
/// rows so far, where `progress` asks for it.
std::vector<Row> RunCases(const std::vector<Case>& cases, const Conditions& conditions,
                          bool quick_only, Progress& progress);

bool AllPassed(const std::vector<Row>& rows);

/// One line a measure, for a terminal: stage, case, what, value, bound, verdict.
std::vector<std::string> TextLines(const Row& row);

/// JSON object: passed, rows[].{stage,case,quick,passed,not_finite,refusal,error,
/// measures[].{what,value,relation,bound,passed,reason}}. Values that are no numbers are null.
std::string ToJson(const std::vector<Row>& rows);

/// The table as docs/STABILITY.md holds it; the same bytes for the same rows.
std::string ToMarkdown(const std::vector<Row>& rows);

}  // namespace dtr::selftest
