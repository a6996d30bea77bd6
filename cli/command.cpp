#include "cli/command.h"

#include <filesystem>

#include "cli/output_file.h"
#include "cli/standard_output.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"

namespace dtr::cli {

void Context::EmitJson(const std::string& json_text) const {
  if (common.json_target.empty()) return;
  if (common.json_target == "-") {
    WriteOut(json_text + "\n");
  } else {
    WriteFileAtomically(common.json_target, json_text + "\n");
  }
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
  const Action action = prepare(*command);
  // The exit code leaves through CLI::RuntimeError, CLI11's way of ending with a code of one's own.
  command->callback([common, action] {
    if (!common->json_target.empty() && common->json_target != "-") {
      RequireFolderOf(common->json_target, "--json");
      if (std::filesystem::is_directory(common->json_target)) {
        throw UsageError("--json " + common->json_target +
                         ": expected a file name, found a folder");
      }
    }
    Console console(common->json_target == "-");
    const int code = action(Context{*common, console});
    if (code != kDone) throw CLI::RuntimeError(code);
  });
}

}  // namespace dtr::cli
