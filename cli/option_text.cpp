#include "cli/option_text.h"

#include <sstream>

namespace dtr::cli {

std::vector<std::string> NamesOf(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

std::string TypeOf(const CLI::Option& option) {
  std::string type = option.get_type_name();
  for (const char* check : {":INT", ":UINT", ":FLOAT", ":POSITIVE", ":NONNEGATIVE", ":NUMBER", ":{",
                            ":DIR", ":FILE", ":PATH", ":TEXT", ":value in"}) {
    type = type.substr(0, type.find(check));
  }
  return type;
}

std::vector<std::string> ChoicesOf(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const auto from = type.find('{'), to = type.find('}', from);
  std::vector<std::string> choices;
  if (from == std::string::npos || to == std::string::npos) return choices;
  std::istringstream list(type.substr(from + 1, to - from - 1));
  for (std::string word; std::getline(list, word, ',');) {
    choices.push_back(word.substr(0, word.find("->")));  // of a word for a value
  }
  return choices;
}

std::string RangeOf(const CLI::Option& option) {
  constexpr double kMaxShown = 1e6;  // wider ranges bound nothing that is of use
  const std::string type = option.get_type_name(), opens = " in [";
  const auto from = type.find(opens), to = type.find(']', from);
  if (from == std::string::npos || to == std::string::npos) return "";
  if (type.find(":POSITIVE") != std::string::npos) return "";  // 0 is not in the range, either
  std::string range = type.substr(from + opens.size(), to - from - opens.size());
  const auto dash = range.find(" - ");
  if (dash == std::string::npos || std::stod(range.substr(dash + 3)) >= kMaxShown) return "";
  return range.replace(dash, 3, " to ");
}

std::vector<const CLI::Option*> OwnOptionsOf(const CLI::App& command) {
  return command.get_options([](const CLI::Option* option) {
    return !option->get_group().empty() && option->nonpositional();
  });
}

std::vector<const CLI::App*> AlternativesOf(const CLI::App& command) {
  return command.get_subcommands([](const CLI::App* below) { return below->get_name().empty(); });
}

std::vector<const CLI::Option*> OptionsOf(const CLI::App& command) {
  std::vector<const CLI::Option*> options = OwnOptionsOf(command);
  for (const CLI::App* group : AlternativesOf(command)) {
    for (const CLI::Option* option : OwnOptionsOf(*group)) {
      const bool is_help = option == group->get_help_ptr() || option == group->get_help_all_ptr();
      if (!is_help) options.push_back(option);
    }
  }
  return options;
}

}  // namespace dtr::cli
