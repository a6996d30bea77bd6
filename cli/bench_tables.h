// cli/bench_tables.h -- what `dtr bench` measured as tables for people.
#pragma once
#include <vector>

#include "cli/console.h"
#include "dtr/eval/bench_json.h"

namespace dtr::cli {

/// One line per number of views and resolution, the methods side by side, and the frames a second
/// that the founding report gives for such a set.
void SayReportTable(const eval::BenchReport& report, const eval::BenchMachine& machine,
                    Console& console);

/// One line per number of views and weight, the methods side by side; the best quality of each
/// method and number of views is marked.
void SayWeightTable(const eval::BenchReport& report, const eval::BenchMachine& machine,
                    Console& console);

void SayGrowthTable(const std::vector<eval::GrowthSeries>& series, RenderMethod method,
                    const eval::BenchMachine& machine, Console& console);

}  // namespace dtr::cli
