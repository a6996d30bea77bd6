#include "cli/command.h"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/number_checks.h"
#include "cli/option_names.h"
#include "cli/output_file.h"
#include "cli/standard_output.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/parallel_for.h"
#include "dtr/base/trace.h"
#include "pipeline/core/depth_settings.h"

namespace dtr::cli {
namespace {

// NaN passes every comparison by which CLI11 holds numbers to a range.
void RejectWhatIsNoNumber(CLI::App& command) {
  const auto finite = [](const std::string& text) -> std::string {
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    const bool whole = !text.empty() && *end == '\0';
    return whole && std::isfinite(value) ? "" : "expected a finite number, found " + text;
  };
  const auto whole = [finite](const std::string& text) -> std::string {
    if (std::string why = finite(text); !why.empty()) return why;
    char* end = nullptr;
    (void)std::strtoll(text.c_str(), &end, 10);
    return *end == '\0' ? "" : "expected a whole number, found " + text;
  };
  for (CLI::Option* option : command.get_options()) {
    const std::string type = option->get_type_name();
    if (type.find(":INT in [") != std::string::npos) {
      option->transform(CLI::Validator(whole, ""));
      continue;
    }
    if (type.find("POSITIVE") != std::string::npos ||
        type.find("NONNEGATIVE") != std::string::npos || type.find(" in [") != std::string::npos) {
      option->transform(CLI::Validator(finite, ""));  // before the range, which would print it
    }
  }
}

/// Null in the program itself.
const CalledApp* CallerOf(const CLI::App& app) {
  const CLI::App* root = &app;
  while (root->get_parent() != nullptr) root = root->get_parent();
  return dynamic_cast<const CalledApp*>(root);
}

/// The exit code of `act`, whose trace is written even if it throws.
template <typename Act>
int Traced(const std::filesystem::path& file, const Act& act) {
  trace::Begin();
  try {
    const int code = act();
    WriteFileAtomically(file, trace::End());
    return code;
  } catch (...) {
    if (trace::IsOn()) WriteFileAtomically(file, trace::End());
    throw;
  }
}

}  // namespace

void Context::EmitJson(const std::string& json) const {
  if (common.json_text != nullptr) {
    *common.json_text = json;
    return;
  }
  if (common.json_target.empty()) return;
  const std::string json_text = WithOptionNames(json);  // of the messages in it
  if (common.json_target == "-") {
    WriteOut(json_text + "\n");
  } else {
    WriteFileAtomically(common.json_target, json_text + "\n");
  }
}

void Context::EmitJson(const nlohmann::ordered_json& json, int indent) const {
  EmitJson(json.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
}

void AddMemoryOption(CLI::App& command, double& memory_gb, const std::string& description) {
  memory_gb = pipeline::kDefaultMemoryGb;
  command.add_option("--memory", memory_gb, description)
      ->check(kPositive)
      ->check(CLI::Range(0.0, kMaxGigabytes))
      ->type_name("GB");
}

void AddCommand(CLI::App& app, const std::string& name, const std::string& description,
                const std::string& example, const std::function<Action(CLI::App&)>& prepare) {
  CLI::App* command = app.add_subcommand(name, description);
  command->footer("Example:\n  " + example);
  auto common = std::make_shared<CommonOptions>();
  command
      ->add_option("--json", common->json_target,
                   "Write the result as JSON to FILE, or - for standard output")
      ->type_name("FILE|-");
  command->add_option("--threads", common->threads, "Threads to use; 0 = all cores")
      ->check(CLI::Range(0, 1024))
      ->type_name("N");
  command->add_option("--seed", common->seed, "Seed of everything random")->type_name("N");
  auto trace_file = std::make_shared<std::string>();
  command
      ->add_option("--trace", *trace_file,
                   "Write what each thread did when as Trace Events, for ui.perfetto.dev and "
                   "scripts/scaling")
      ->type_name("FILE");
  const Action action = prepare(*command);
  if (command->get_option_no_throw("--force") == nullptr) {
    command->add_flag("--force", common->force, "Replace output files that exist");
  }
  RejectWhatIsNoNumber(*command);
  // The exit code leaves through CLI::RuntimeError, CLI11's way of ending with a code of one's own.
  command->callback([command, common, action, trace_file] {
    RequireOutputs(*command, command->count("--force") > 0);
    const CalledApp* const called = CallerOf(*command);
    if (called != nullptr) common->json_text = &called->json();
    Console console =
        called != nullptr ? Console(called->caller()) : Console(common->json_target == "-");
    const ThreadLimit limit(common->threads);
    const auto act = [&] { return action(Context{*common, console}); };
    const int code = trace_file->empty() ? act() : Traced(*trace_file, act);
    if (code != kDone) throw CLI::RuntimeError(code);
  });
}

}  // namespace dtr::cli
