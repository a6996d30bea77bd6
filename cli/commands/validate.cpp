#include <fmt/format.h>

#include <filesystem>

#include "cli/command.h"
#include "cli/pipeline/validate_set.h"
#include "dtr/io/set_io.h"

namespace dtr::cli {
namespace {

struct Options {
  std::filesystem::path set;
  calib::ValidateLimits limits;
};

void SayReport(const calib::ValidationReport& report, Console& console) {
  console.Say(fmt::format("{:<24} {:>7} {:>8} {:>8} {:>8} {:>8}", "camera (held-out, px)", "count",
                          "RMS", "median", "95 %", "worst"));
  for (const auto& camera : report.cameras) {
    const auto& held_out = camera.held_out;
    console.Say(fmt::format("{:<24} {:>7} {:>8.3f} {:>8.3f} {:>8.3f} {:>8.3f}", camera.name,
                            held_out.count, held_out.rms_px, held_out.median_px, held_out.p95_px,
                            held_out.worst_px));
  }
  for (const Check& test : report.tests) {
    console.Say(fmt::format("{} {}: {:.4g} (limit {:.4g}): {}", test.passed ? "passed" : "FAILED",
                            test.name, test.value, test.limit, test.reason));
  }
  for (const std::string& name : report.untested) {
    console.Say("not tested, too few observations: " + name);
  }
}

int RunValidate(const Options& options, const Context& context) {
  const DtrSet set = io::ReadSet(options.set);
  const SparseScene sparse = io::LoadSparse(options.set, set);
  const auto report = pipeline::ValidateSet(set, sparse, options.limits, context.common.threads);
  SayReport(report, context.console);
  context.EmitJson(calib::ToJson(report));
  return report.passed() ? kDone : kFailed;
}

}  // namespace

void AddValidateCommand(CLI::App& app) {
  AddCommand(app, "validate", "Reprojection tests of a set's calibration; exit 1 when one fails",
             "dtr validate scene.dtr --max-rms 1.0", [](CLI::App& command) -> Action {
               auto options = std::make_shared<Options>();
               command.add_option("SET", options->set, "The set")->required();
               command
                   .add_option("--max-rms", options->limits.max_rms_px,
                               fmt::format("Limit of the held-out RMS of all cameras [{}]",
                                           options->limits.max_rms_px))
                   ->check(CLI::PositiveNumber)
                   ->type_name("PX");
               return [options](const Context& context) { return RunValidate(*options, context); };
             });
}

}  // namespace dtr::cli
