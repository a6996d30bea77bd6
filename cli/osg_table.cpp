#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "cli/osg_bench.h"

namespace dtr::cli {

void SayOsgTable(const OsgBench& bench, const eval::BenchMachine& machine, Console& console) {
  console.Say(fmt::format("{}; {}, {} cores; dtr {}", machine.renderer, machine.cpu, machine.cores,
                          machine.version));
  console.Say(fmt::format("{}x{}, medians of {} frames of a fly-through; ratio by {} time",
                          bench.width_px, bench.height_px, bench.frames, machine.clock));
  console.Say("");
  console.Say(fmt::format("{:<22} {:>3} {:>5} {:>10} {:>9} {:>8} {:>10} {:>9} {:>6}", "Application",
                          "R", "views", "s a frame", "ms", "CPU ms", "alone ms", "CPU ms",
                          "ratio"));
  for (const OsgRow& row : bench.rows) {
    std::string line = fmt::format("{:<22} {:>3} {:>5} {:>10.4f} {:>9.1f} {:>8.1f}",
                                   row.read_back ? "D+TR on OSG, read back" : "D+TR on OSG",
                                   row.options.resolution, row.views_used, row.osg.median_ms / 1000,
                                   row.osg.median_ms, row.osg_cpu.median_ms);
    if (!row.read_back) {
      line += fmt::format(" {:>10.1f} {:>9.1f} {:>6.3f}", row.gl.median_ms, row.gl_cpu.median_ms,
                          bench.RatioOsgOverGl(row));
    }
    console.Say(line);
  }
}

std::string OsgJson(const OsgBench& bench, const eval::BenchMachine& machine) {
  using nlohmann::ordered_json;
  ordered_json rows = ordered_json::array();
  double largest = 0;
  for (const OsgRow& row : bench.rows) {
    ordered_json json{
        {"path", row.read_back ? "read-back" : "gpu"},
        {"method", row.options.method == RenderMethod::kTwoPass ? "two-pass" : "deferred"},
        {"views_used", row.views_used},
        {"resolution", row.options.resolution},
        {"seconds_per_frame", row.osg.median_ms / 1000},
        {"ms", row.osg.median_ms},
        {"spread_ms", row.osg.spread_ms},
        {"cpu_ms", row.osg_cpu.median_ms},
        {"gl_ms", nullptr},
        {"gl_cpu_ms", nullptr},
        {"ratio_osg_over_gl", nullptr}};
    if (!row.read_back) {
      json["gl_ms"] = row.gl.median_ms;
      json["gl_cpu_ms"] = row.gl_cpu.median_ms;
      json["ratio_osg_over_gl"] = bench.RatioOsgOverGl(row);
      largest = std::max(largest, bench.RatioOsgOverGl(row));
    }
    rows.push_back(json);
  }
  return ordered_json{{"table", "osg"},
                      {"width_px", bench.width_px},
                      {"height_px", bench.height_px},
                      {"frames", bench.frames},
                      {"rows", rows},
                      {"largest_ratio_osg_over_gl", largest},
                      {"machine",
                       {{"cpu", machine.cpu},
                        {"cores", machine.cores},
                        {"renderer", machine.renderer},
                        {"version", machine.version},
                        {"clock", machine.clock}}}}
      .dump(1);
}

}  // namespace dtr::cli
