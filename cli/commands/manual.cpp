#include "cli/manual.h"
#include "cli/command.h"
#include "cli/standard_output.h"

namespace dtr::cli {

void AddManualCommands(CLI::App& app, const std::string& version) {
  // Its words are read as COMMAND --help (suggestions.h): here it is for the list of commands.
  app.add_subcommand("help", "Print the help of a command: dtr help calibrate board");
  app.add_subcommand("manual", "Print the man page: dtr manual | man -l -")
      ->callback([&app, version] { WriteOut(ManualPage(app, version)); });
  app.add_subcommand("completion", "Print a completion script for bash: source <(dtr completion)")
      ->callback([&app] { WriteOut(BashCompletion(app)); });
}

}  // namespace dtr::cli
