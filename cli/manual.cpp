#include "cli/manual.h"

#include <fmt/format.h>

#include <vector>

namespace dtr::cli {
namespace {

// Visible sub-commands in the order they were added.
std::vector<const CLI::App*> Commands(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* command) {
    return !command->get_group().empty() && !command->get_name().empty();
  });
}

// CLI11 keeps a group of options of which one must be given as a command without a name.
std::vector<const CLI::App*> Groups(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* command) { return command->get_name().empty(); });
}

// Visible options in the order they were added; positionals apart from those with a dash.
std::vector<const CLI::Option*> Options(const CLI::App& app, bool positional) {
  return app.get_options([positional](const CLI::Option* option) {
    return !option->get_group().empty() && option->get_positional() == positional;
  });
}

// Of such a group, but for the help that CLI11 gives it, too.
std::vector<const CLI::Option*> OptionsOfGroup(const CLI::App& group) {
  std::vector<const CLI::Option*> options = Options(group, false);
  std::erase(options, group.get_help_ptr());
  return options;
}

// "-o,--output" as CLI11 joins the names of an option.
std::vector<std::string> Names(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

// The closed list in a type name such as "TEXT:{mesh,splat}"; empty without one.
std::string Choices(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const auto from = type.find('{');
  const auto to = type.find('}', from);
  if (from == std::string::npos || to == std::string::npos) return "";
  std::string list = type.substr(from + 1, to - from - 1);
  for (char& letter : list) {
    if (letter == ',') letter = ' ';
  }
  return list;
}

// Plain text as roff: no escapes, no line that starts as a request, hyphens that can be copied.
std::string Roff(const std::string& text) {
  std::string out;
  bool line_starts = true;
  for (const char letter : text) {
    if (line_starts && (letter == '.' || letter == '\'')) out += "\\&";
    if (letter == '\\') {
      out += "\\e";
    } else if (letter == '-') {
      out += "\\-";
    } else {
      out += letter;
    }
    line_starts = letter == '\n';
  }
  return out;
}

// The type as it was declared: CLI11 puts behind it what a value is checked for ("N:INT in [0 -
// 9]"), and ours may have a colon of their own ("every:N|NAME,...").
std::string TypeOf(const CLI::Option& option) {
  std::string type = option.get_type_name();
  for (const char* check : {":INT", ":UINT", ":FLOAT", ":POSITIVE", ":NONNEGATIVE", ":NUMBER", ":{",
                            ":DIR", ":FILE", ":PATH", ":TEXT"}) {
    type = type.substr(0, type.find(check));
  }
  return type;
}

std::string OptionEntry(const CLI::Option& option) {
  std::string names = option.get_positional() ? option.get_name(true)
                                              : fmt::format("{}", fmt::join(Names(option), ", "));
  std::string entry = ".TP\n.B " + Roff(names);
  // A flag takes no value; its type says nothing.
  if (!option.get_positional() && option.get_items_expected_max() > 0) {
    entry += " " + Roff(TypeOf(option));
  }
  if (option.get_required()) entry += " (required)";
  entry += "\n" + Roff(option.get_description()) + "\n";
  return entry;
}

void AppendCommand(const CLI::App& command, const std::string& called, std::string& page) {
  page += fmt::format(".SS \"{}\"\n{}\n", Roff(called), Roff(command.get_description()));
  for (const bool positional : {true, false}) {
    for (const CLI::Option* option : Options(command, positional)) page += OptionEntry(*option);
  }
  for (const CLI::App* group : Groups(command)) {
    for (const CLI::Option* option : OptionsOfGroup(*group)) page += OptionEntry(*option);
  }
  if (!command.get_footer().empty()) {
    page += ".PP\n.nf\n" + Roff(command.get_footer()) + "\n.fi\n";
  }
  for (const CLI::App* below : Commands(command)) {
    AppendCommand(*below, called + " " + below->get_name(), page);
  }
}

// One line of the script's tables: what may follow `called`.
void AppendWords(const CLI::App& app, const std::string& called, std::string& words,
                 std::string& choices) {
  std::vector<std::string> list;
  for (const CLI::App* command : Commands(app)) list.push_back(command->get_name());
  std::vector<const CLI::Option*> options = Options(app, false);
  for (const CLI::App* group : Groups(app)) {
    const auto more = OptionsOfGroup(*group);
    options.insert(options.end(), more.begin(), more.end());
  }
  for (const CLI::Option* option : options) {
    for (const std::string& name : Names(*option)) {
      list.push_back(name);
      const std::string values = Choices(*option);
      if (!values.empty()) choices += fmt::format("    ['{} {}']='{}'\n", called, name, values);
    }
  }
  words += fmt::format("    ['{}']='{}'\n", called, fmt::join(list, " "));
  for (const CLI::App* command : Commands(app)) {
    AppendWords(*command, called + " " + command->get_name(), words, choices);
  }
}

}  // namespace

std::string ManualPage(const CLI::App& app, const std::string& version) {
  std::string page = fmt::format(
      ".TH DTR 1 \"\" \"dtr {0}\" \"User Commands\"\n"
      ".SH NAME\ndtr \\- depth + texture representation: photos in, novel views out\n"
      ".SH SYNOPSIS\n.B dtr\n.I COMMAND\n[\\fIOPTIONS\\fR]\n"
      ".SH DESCRIPTION\n"
      "Calibrates the cameras of a photo collection and validates them, computes a depth map for "
      "every photo, keeps the scene as triplets of depth, image and calibration (a D+TR set), and "
      "renders new views of it. Needs neither CUDA nor a GPU.\n"
      ".SH COMMANDS\n",
      Roff(version));
  for (const CLI::App* command : Commands(app)) {
    AppendCommand(*command, "dtr " + command->get_name(), page);
  }
  page +=
      ".SH EXIT STATUS\n"
      ".TP\n.B 0\nDone.\n"
      ".TP\n.B 1\nFailed, or a check did not hold.\n"
      ".TP\n.B 2\nWrong usage.\n";
  return page;
}

std::string BashCompletion(const CLI::App& app) {
  std::string words, choices;
  AppendWords(app, "dtr", words, choices);
  return fmt::format(
      R"(# bash completion for dtr: source it, or keep it as .../bash-completion/completions/dtr
_dtr() {{
  local -A words=(
{}  )
  local -A choices=(
{}  )
  local current=${{COMP_WORDS[COMP_CWORD]}} called=dtr i
  COMPREPLY=()
  # The longest chain of commands typed so far.
  for ((i = 1; i < COMP_CWORD; i++)); do
    [[ -n ${{words["$called ${{COMP_WORDS[i]}}"]+x}} ]] && called="$called ${{COMP_WORDS[i]}}"
  done
  local values=${{choices["$called ${{COMP_WORDS[COMP_CWORD-1]}}"]-}}
  if [[ -n $values ]]; then
    COMPREPLY=($(compgen -W "$values" -- "$current"))
  elif [[ $current == -* || ${{words[$called]}} != -* ]]; then
    COMPREPLY=($(compgen -W "${{words[$called]}}" -- "$current"))
  fi
  # No word fits: bash offers file names.
}}
complete -o default -o bashdefault -F _dtr dtr
)",
      words, choices);
}

}  // namespace dtr::cli
