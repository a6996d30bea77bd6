// cli/run_command.h -- commands of `dtr` for other programs: its options and results, no terminal.
#pragma once
#include <string>
#include <vector>

#include "dtr/base/progress.h"

namespace dtr::cli {

/// An option by its name of the command line, with dashes or underscores: {"max_size", {"640"}}.
struct NamedOption {
  enum class Kind {
    kValues,  ///< one value or more
    kOn,      ///< a flag that is set
    kOff,     ///< a flag that is set to no: --no-NAME where there is one
  };
  std::string name;
  Kind kind = Kind::kValues;
  std::vector<std::string> values;
};

struct CommandResult {
  bool passed = true;  ///< false: done, and a check of the command did not hold (`dtr validate`)
  std::string json;    ///< what --json writes; messages in it name options in back quotes
};

/// Runs a command that needs no window: {"build", "photos/"} or {"calibrate", "rig", "photos/"}
/// with its options. The first words name the command, the others are its arguments, whatever they
/// begin with. `caller` receives progress, notes and the lines for people; it must be callable from
/// any thread. Several may run at once. Throws UsageError where the program would end with code 2,
/// Error where with 1, Interrupted where `caller` asked to stop.
CommandResult RunCommand(const std::vector<std::string>& words,
                         const std::vector<NamedOption>& options, Progress& caller);

}  // namespace dtr::cli
