#include <filesystem>

#include "cli/command.h"
#include "dtr/io/set_io.h"

namespace dtr::cli {

void AddInfoCommand(CLI::App& app) {
  struct Options {
    std::filesystem::path set;
    bool verify = false, held_out_names = false;
  };
  AddCommand(
      app, "info", "Show what a set contains", "dtr info scene.dtr --verify",
      [](CLI::App& command) -> Action {
        auto options = std::make_shared<Options>();
        command.add_option("SET", options->set, "The set")->required();
        command.add_flag("--verify", options->verify, "Check every file against its hash");
        command.add_flag("--held-out-names", options->held_out_names,
                         "Print only the names of the held-out photos, one a line");
        return [options](const Context& context) -> int {
          const DtrSet set = io::ReadSet(options->set);
          if (options->held_out_names) {
            for (const Frame& frame : set.frames) {
              for (const View& view : frame.views) {
                if (view.role == ViewRole::kHeldOut) context.console.Say(view.name);
              }
            }
            return kDone;
          }
          std::vector<std::string> problems;
          if (options->verify) problems = io::VerifySet(options->set);
          context.console.Say(io::DescribeSet(set));
          for (const std::string& problem : problems) context.console.Say(problem);
          if (options->verify && problems.empty()) {
            context.console.Say("verified: every file has the content the set was written with");
          }
          context.EmitJson(io::InfoJson(set));
          return problems.empty() ? kDone : kFailed;
        };
      });
}

}  // namespace dtr::cli
