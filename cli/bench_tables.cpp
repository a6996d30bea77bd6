#include "cli/bench_tables.h"

#include <fmt/format.h>

#include <optional>
#include <string>

#include "dtr/render/option_names.h"

namespace dtr::cli {
namespace {

/// The founding report, section 2.8: GeForce 6600 GT, 128 MB. `most` is the larger number of views
/// of a line ("3 to 5").
struct FoundingRow {
  int views_in_set, most;
  double fps_at_resolution_1, fps_at_resolution_2;
};
constexpr FoundingRow kFounding[] = {{18, 3, 21, 75},   {18, 5, 13, 46}, {18, 6, 10.5, 38},
                                     {18, 8, 6, 21.3},  {18, 9, 5, 20},  {18, 12, 3.2, 14},
                                     {18, 14, 2.7, 11}, {9, 3, 78, 210}, {9, 5, 46.5, 130},
                                     {9, 6, 40, 109},   {9, 8, 14, 40},  {9, 9, 13, 32}};

std::string FoundingFps(int views_in_set, const eval::BenchRow& row) {
  for (const FoundingRow& known : kFounding) {
    if (known.views_in_set != views_in_set || known.most != row.views_used) continue;
    if (row.resolution == 1) return fmt::format("{:g}", known.fps_at_resolution_1);
    if (row.resolution == 2) return fmt::format("{:g}", known.fps_at_resolution_2);
  }
  return "-";
}

std::string Decibel(const std::optional<double>& value) {
  return value ? fmt::format("{:.2f}", *value) : std::string("-");
}

std::string Machine(const eval::BenchMachine& machine) {
  return fmt::format("{}; {}, {} cores; dtr {}; ms by {}", machine.renderer, machine.cpu,
                     machine.cores, machine.version, machine.clock);
}

std::string Row(const eval::BenchRow& row) {
  return fmt::format("{:>8.1f} {:>6.1f} {:>8.1f} {:>7.1f} {:>6}", row.frame.median_ms,
                     row.frame.spread_ms, row.cpu.median_ms, row.fps(), Decibel(row.psnr_db));
}

void SayWhatWasMeasured(const eval::BenchReport& report, const eval::BenchMachine& machine,
                        Console& console) {
  console.Say(Machine(machine));
  std::string names;
  for (const std::string& name : report.cameras) names += (names.empty() ? "" : ", ") + name;
  console.Say(
      fmt::format("{} source views, {}x{}, seen from {} {}; medians of {} frames, spread is "
                  "the interquartile range",
                  report.views_in_set, report.width_px, report.height_px,
                  report.left_out ? "left-out" : "held-out", names, report.repeats));
  console.Say("");
}

/// "*" where no other weight of this method and number of views gives a better whole frame.
const char* BestMark(const eval::BenchReport& report, const eval::BenchRow& row) {
  for (const eval::BenchRow& other : report.rows) {
    if (other.method == row.method && other.views_used == row.views_used &&
        other.psnr_db > row.psnr_db) {
      return " ";
    }
  }
  return "*";
}

std::string Axis(const eval::GrowthSeries& series) {
  if (series.axis == "views_used") return "views used";
  if (series.axis == "pixels") return "output, megapixels";
  return "views in the set, four used";
}

}  // namespace

void SayReportTable(const eval::BenchReport& report, const eval::BenchMachine& machine,
                    Console& console) {
  SayWhatWasMeasured(report, machine, console);
  console.Say(fmt::format("{:>3} {:>5}  {:^39}  {:^39}  {:>6} {:>6} {:>5}  {:>5} {:>6}", "", "",
                          "two-pass", "deferred", "", "", "", "", ""));
  const std::string head =
      fmt::format("{:>8} {:>6} {:>8} {:>7} {:>6}", "ms", "spread", "CPU ms", "fps", "dB");
  console.Say(fmt::format("{:>3} {:>5}  {}  {}  {:>6} {:>6} {:>5}  {:>9}", "R", "views", head, head,
                          "x CPU", "x ms", "loss", "2006 fps"));
  for (size_t i = 0; i + 1 < report.rows.size(); i += 2) {
    const eval::BenchRow &two_pass = report.rows[i], &deferred = report.rows[i + 1];
    const auto loss = eval::LossDb(two_pass.psnr_db, deferred.psnr_db);
    console.Say(fmt::format("{:>3} {:>5}  {}  {}  {:>6.1f} {:>6.1f} {:>5}  {:>9}",
                            two_pass.resolution, two_pass.views_used, Row(two_pass), Row(deferred),
                            two_pass.cpu.median_ms / deferred.cpu.median_ms,
                            two_pass.frame.median_ms / deferred.frame.median_ms, Decibel(loss),
                            FoundingFps(report.views_in_set, two_pass)));
  }
  if (!report.comparison) return;
  const eval::BenchComparison& at = *report.comparison;
  console.Say("");
  console.Say(fmt::format(
      "deferred is {:.1f} times as fast at {} views and resolution {}, losing {} dB",
      at.ratio_two_pass_over_deferred, at.views_used, at.resolution, Decibel(at.loss_db)));
  for (const eval::BenchRow& row : report.rows) {
    if (row.views_used != at.views_used || row.resolution != at.resolution) continue;
    console.Say(fmt::format(
        "a whole frame by {}: {:.1f} ms, {:.1f} CPU ms (drawn {:.1f}, read back {:.1f}, holes "
        "filled and edges smoothed {:.1f} CPU ms)",
        NameOf(row.method), row.whole_ms(), row.whole_cpu_ms(), row.cpu.median_ms,
        row.read_back_cpu.median_ms, row.fill_cpu.median_ms));
  }
}

void SayWeightTable(const eval::BenchReport& report, const eval::BenchMachine& machine,
                    Console& console) {
  SayWhatWasMeasured(report, machine, console);
  console.Say(fmt::format("{:>5} {:<13}  {:^31}  {:^31}", "", "", "two-pass", "deferred"));
  const std::string head = fmt::format("{:>8} {:>8} {:>6} {:>6}", "CPU ms", "dB", "seen", "share");
  console.Say(fmt::format("{:>5} {:<13}  {}  {}", "views", "weight", head, head));
  const auto figures = [&](const eval::BenchRow& row) {
    return fmt::format("{:>8.1f} {:>7}{} {:>6} {:>5.1f}%", row.cpu.median_ms, Decibel(row.psnr_db),
                       BestMark(report, row), Decibel(row.psnr_covered_db), 100 * row.coverage);
  };
  for (size_t i = 0; i + 1 < report.rows.size(); i += 2) {
    const eval::BenchRow &two_pass = report.rows[i], &deferred = report.rows[i + 1];
    console.Say(fmt::format("{:>5} {:<13}  {}  {}", two_pass.views_used, NameOf(two_pass.blend),
                            figures(two_pass), figures(deferred)));
  }
  console.Say("");
  console.Say(
      "dB: whole frame, holes filled and edges smoothed, * the best of its method and number of "
      "views; seen: dB on "
      "pixels that some view saw, and their share; CPU ms: drawing alone");
}

void SayGrowthTable(const std::vector<eval::GrowthSeries>& series, RenderMethod method,
                    const eval::BenchMachine& machine, Console& console) {
  console.Say(Machine(machine));
  console.Say(fmt::format("method {}", NameOf(method)));
  for (const eval::GrowthSeries& one : series) {
    console.Say("");
    console.Say(fmt::format("{:>28} {:>9} {:>7} {:>9} {:>7}", Axis(one), "ms", "spread", "CPU ms",
                            "spread"));
    for (const eval::GrowthRow& row : one.rows) {
      console.Say(fmt::format("{:>28.4g} {:>9.2f} {:>7.2f} {:>9.2f} {:>7.2f}", row.value,
                              row.frame.median_ms, row.frame.spread_ms, row.cpu.median_ms,
                              row.cpu.spread_ms));
    }
    console.Say(one.axis == "views_in_set"
                    ? fmt::format("largest factor between two rows: {:.2f}", one.worst_growth)
                    : fmt::format("largest growth between two rows: {:.2f} times the growth of the "
                                  "cause (1: linear)",
                                  one.worst_growth));
  }
}

}  // namespace dtr::cli
