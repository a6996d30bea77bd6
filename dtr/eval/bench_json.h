// dtr/eval/bench_json.h -- what `dtr bench` measured as JSON text. Names are an interface.
#pragma once
#include <string>
#include <vector>

#include "dtr/eval/bench.h"
#include "dtr/eval/growth.h"

namespace dtr::eval {

/// What figures of time are worth nothing without.
struct BenchMachine {
  std::string cpu;
  int cores = 0;
  std::string renderer;  ///< as the driver or the renderer calls itself
  std::string version;   ///< of this program
  std::string clock;     ///< what `ms` was measured by: "gpu timer" or "wall"
};

/// `table`: "report" or "weights" (which has no comparison).
/// {table,views_in_set,width_px,height_px,repeats,left_out,cameras,
///  rows:[{method,blend,views_in_set,views_used,resolution,ms,spread_ms,fps,cpu_ms,cpu_spread_ms,
///         read_back_ms,read_back_cpu_ms,fill_ms,fill_cpu_ms,whole_ms,whole_cpu_ms,psnr_db,
///         psnr_covered_db,identical:[...],coverage}],
///  ends:[{resolution,views_used,views_asked,reason}] (why there are no more rows: "memory" or
///  "valid views"),
///  ratio_two_pass_over_deferred,loss_db,compared_at:{views_used,resolution},
///  machine:{cpu,cores,renderer,version,clock}}.
/// Spreads are interquartile ranges. What is not defined (no row pair, no pixel to compare) is
/// null, and so is an infinite PSNR (all pixels equal), which "identical" names.
std::string ToJson(const std::string& table, const BenchReport& report,
                   const BenchMachine& machine);

/// {table:"growth",method,series:[{axis,worst_growth,rows:[{value,ms,spread_ms,cpu_ms,
///  cpu_spread_ms}]}],machine:{...}}.
std::string ToJson(const std::vector<GrowthSeries>& series, RenderMethod method,
                   const BenchMachine& machine);

}  // namespace dtr::eval
