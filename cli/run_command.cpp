#include "cli/run_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "cli/arguments.h"
#include "cli/command.h"
#include "cli/option_text.h"
#include "cli/suggestions.h"
#include "dtr/base/error.h"

namespace dtr::cli {
namespace {

// Commands below one, without its groups of options, which have no name.
std::vector<CLI::App*> CommandsBelow(CLI::App& app) {
  return app.get_subcommands([](const CLI::App* one) { return !one->get_name().empty(); });
}

// The command that the first words name, and how many they are.
struct Found {
  CLI::App* command = nullptr;
  size_t words = 0;
};

Found CommandOf(CLI::App& app, const std::vector<std::string>& words) {
  Found found{&app, 0};
  for (;;) {
    const auto below = CommandsBelow(*found.command);
    if (below.empty()) return found;
    const auto is_called = [&](const CLI::App* one) {
      return found.words < words.size() && one->get_name() == words[found.words];
    };
    const auto next = std::find_if(below.begin(), below.end(), is_called);
    if (next == below.end()) {
      std::vector<std::string> names;
      for (const CLI::App* one : below) names.push_back(one->get_name());
      const auto last = words.begin() + std::min(found.words + 1, words.size());
      throw UsageError(fmt::format("{}; there are {}",
                                   NoCommandCalled({words.begin(), last}, names),
                                   fmt::join(names, ", ")));
    }
    found.command = *next;
    ++found.words;
  }
}

const CLI::Option* OptionCalled(const CLI::App& command, const std::string& name) {
  const auto of = [&](const CLI::App& app) -> const CLI::Option* {
    for (const CLI::Option* option : app.get_options()) {  // earlier names too, which are hidden
      const auto& names = option->get_lnames();
      if (std::find(names.begin(), names.end(), name) != names.end()) return option;
    }
    return nullptr;
  };
  if (const CLI::Option* option = of(command)) return option;
  for (const CLI::App* group : AlternativesOf(command)) {
    if (const CLI::Option* option = of(*group)) return option;
  }
  return nullptr;
}

[[noreturn]] void RejectOption(const CLI::App& command, const std::string& name) {
  std::vector<std::string> names;
  for (const CLI::Option* option : OptionsOf(command)) {
    if (option->get_lnames().empty()) continue;
    std::string known = option->get_lnames().front();
    if (known.starts_with("help") || known == "json" || known.starts_with("no-")) continue;
    std::replace(known.begin(), known.end(), '-', '_');
    names.push_back(known);
  }
  throw UsageError(fmt::format("{}: no option is called '{}'{}; there are {}", command.get_name(),
                               name, DidYouMean(name, names), fmt::join(names, ", ")));
}

// Words of a command line that set the option.
void AppendOption(const CLI::App& command, const NamedOption& given,
                  std::vector<std::string>& arguments) {
  std::string name = given.name;
  std::replace(name.begin(), name.end(), '_', '-');
  const CLI::Option* const option = OptionCalled(command, name);
  if (given.kind == NamedOption::Kind::kOff) {
    if (OptionCalled(command, "no-" + name) != nullptr) {
      arguments.push_back("--no-" + name);
    } else if (option != nullptr && option->get_items_expected_max() == 0) {
      arguments.push_back("--" + name + "=false");
    } else {
      RejectOption(command, given.name);
    }
    return;
  }
  // --no-refine's opposite is what happens without it.
  const bool is_default = option == nullptr && given.kind == NamedOption::Kind::kOn &&
                          OptionCalled(command, "no-" + name) != nullptr;
  if (is_default) return;
  const bool is_callable = option != nullptr && name != "json" && !name.starts_with("help");
  if (!is_callable) RejectOption(command, given.name);
  const bool is_flag = option->get_items_expected_max() == 0;
  if (is_flag != (given.kind == NamedOption::Kind::kOn)) {
    throw UsageError(fmt::format("{}: `{}`: expected {}", command.get_name(), given.name,
                                 is_flag ? "true or false" : "a value, found true"));
  }
  if (is_flag) {
    arguments.push_back("--" + name);
  } else if (option->get_items_expected_max() > 1) {
    for (const std::string& value : given.values) arguments.push_back("--" + name + "=" + value);
  } else {
    arguments.push_back(fmt::format("--{}={}", name, fmt::join(given.values, ",")));
  }
}

}  // namespace

void AddCallableCommands(CLI::App& app) {
  AddBuildCommand(app);
  AddCaptureCommand(app);
  AddCalibrateCommand(app);
  AddValidateCommand(app);
  AddStereoCommand(app);
  AddInfoCommand(app);
  AddRenderCommand(app);
  AddInspectCommand(app);
  AddAdviseCommand(app);
  AddEvaluateCommand(app);
  if constexpr (DTR_WITH_PRUNE) AddPruneCommand(app);
  if constexpr (DTR_WITH_IMPORT) AddImportCommand(app);
  if constexpr (DTR_WITH_EXPORT) AddExportCommand(app);
  AddJoinCommand(app);
  AddDatasetCommand(app);
}

CommandResult RunCommand(const std::vector<std::string>& words,
                         const std::vector<NamedOption>& options, Progress& caller) {
  CommandResult result;
  CalledApp app(caller, result.json);
  app.require_subcommand(1);
  AddCallableCommands(app);
  const Found found = CommandOf(app, words);
  std::vector<std::string> arguments(words.begin(),
                                     words.begin() + static_cast<std::ptrdiff_t>(found.words));
  for (const NamedOption& option : options) AppendOption(*found.command, option, arguments);
  if (words.size() > found.words) arguments.emplace_back("--");
  arguments.insert(arguments.end(), words.begin() + static_cast<std::ptrdiff_t>(found.words),
                   words.end());
  RequirePlainArguments(arguments);
  std::reverse(arguments.begin(), arguments.end());  // as CLI11 wants them
  try {
    app.parse(std::move(arguments));
  } catch (const CLI::RuntimeError& ended) {
    result.passed = false;
  } catch (const CLI::ParseError& error) {
    throw UsageError(fmt::format("{}: {}", found.command->get_name(), error.what()));
  }
  return result;
}

}  // namespace dtr::cli
