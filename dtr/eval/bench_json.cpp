#include "dtr/eval/bench_json.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "dtr/base/json_number.h"
#include "dtr/eval/metrics.h"
#include "dtr/render/option_names.h"

namespace dtr::eval {
namespace {

using Json = nlohmann::ordered_json;

Json Value(const BenchMachine& machine) {
  return {{"cpu", machine.cpu},
          {"cores", machine.cores},
          {"renderer", machine.renderer},
          {"version", machine.version},
          {"clock", machine.clock}};
}

Json Value(const BenchRow& row, int views_in_set) {
  return {{"method", NameOf(row.method)},
          {"blend", NameOf(row.blend)},
          {"views_in_set", views_in_set},
          {"views_used", row.views_used},
          {"resolution", row.resolution},
          {"ms", row.frame.median_ms},
          {"spread_ms", row.frame.spread_ms},
          {"fps", row.fps()},
          {"cpu_ms", row.cpu.median_ms},
          {"cpu_spread_ms", row.cpu.spread_ms},
          {"read_back_ms", row.read_back.median_ms},
          {"read_back_cpu_ms", row.read_back_cpu.median_ms},
          {"fill_ms", row.fill.median_ms},
          {"fill_cpu_ms", row.fill_cpu.median_ms},
          {"whole_ms", row.whole_ms()},
          {"whole_cpu_ms", row.whole_cpu_ms()},
          {"psnr_db", NumberOrNull(row.psnr_db)},
          {"psnr_covered_db", NumberOrNull(row.psnr_covered_db)},
          {"identical",
           IdenticalFigures({{"psnr_db", row.psnr_db}, {"psnr_covered_db", row.psnr_covered_db}})},
          {"coverage", row.coverage}};
}

}  // namespace

std::string ToJson(const std::string& table, const BenchReport& report,
                   const BenchMachine& machine) {
  Json rows = Json::array();
  for (const BenchRow& row : report.rows) rows.push_back(Value(row, report.views_in_set));
  Json json{{"table", table},
            {"views_in_set", report.views_in_set},
            {"width_px", report.width_px},
            {"height_px", report.height_px},
            {"repeats", report.repeats},
            {"left_out", report.left_out},
            {"cameras", report.cameras},
            {"rows", rows}};
  json["ends"] = Json::array();
  for (const BenchEnd& end : report.ends) {
    json["ends"].push_back({{"resolution", end.resolution},
                            {"views_used", end.views_used},
                            {"views_asked", end.views_asked},
                            {"reason", end.for_memory ? "memory" : "valid views"}});
  }
  json["ratio_two_pass_over_deferred"] = nullptr;
  json["loss_db"] = nullptr;
  json["compared_at"] = nullptr;
  if (report.comparison) {
    const BenchComparison& at = *report.comparison;
    json["ratio_two_pass_over_deferred"] = at.ratio_two_pass_over_deferred;
    json["loss_db"] = NumberOrNull(at.loss_db);
    json["compared_at"] = {{"views_used", at.views_used}, {"resolution", at.resolution}};
  }
  json["machine"] = Value(machine);
  return json.dump(1);
}

std::string ToJson(const std::vector<GrowthSeries>& series, RenderMethod method,
                   const BenchMachine& machine) {
  Json list = Json::array();
  for (const GrowthSeries& one : series) {
    Json rows = Json::array();
    for (const GrowthRow& row : one.rows) {
      rows.push_back({{"value", row.value},
                      {"ms", row.frame.median_ms},
                      {"spread_ms", row.frame.spread_ms},
                      {"cpu_ms", row.cpu.median_ms},
                      {"cpu_spread_ms", row.cpu.spread_ms}});
    }
    list.push_back({{"axis", one.axis}, {"worst_growth", one.worst_growth}, {"rows", rows}});
  }
  return Json{{"table", "growth"},
              {"method", NameOf(method)},
              {"series", list},
              {"machine", Value(machine)}}
      .dump(1);
}

}  // namespace dtr::eval
