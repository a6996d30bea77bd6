#include "cli/manual.h"

#include <fmt/format.h>

#include <vector>

#include "cli/option_text.h"

namespace dtr::cli {
namespace {

// Visible sub-commands in the order they were added.
std::vector<const CLI::App*> Commands(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* command) {
    return !command->get_group().empty() && !command->get_name().empty();
  });
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

std::string OptionEntry(const CLI::Option& option) {
  std::string names = option.nonpositional() ? fmt::format("{}", fmt::join(NamesOf(option), ", "))
                                             : option.get_name(true);
  std::string entry = ".TP\n.B " + Roff(names);
  // A flag takes no value; its type says nothing.
  if (option.nonpositional() && option.get_items_expected_max() > 0) {
    entry += " " + Roff(TypeOf(option));
  }
  if (option.get_required()) entry += " (required)";
  entry += "\n" + Roff(option.get_description()) + "\n";
  return entry;
}

void AppendCommand(const CLI::App& command, const std::string& called, std::string& page) {
  page += fmt::format(".SS \"{}\"\n{}\n", Roff(called), Roff(command.get_description()));
  const auto positionals = command.get_options([](const CLI::Option* option) {
    return !option->get_group().empty() && !option->nonpositional();
  });
  for (const CLI::Option* option : positionals) page += OptionEntry(*option);
  for (const CLI::Option* option : OptionsOf(command)) page += OptionEntry(*option);
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
  for (const CLI::Option* option : OptionsOf(app)) {
    const std::vector<std::string> values = ChoicesOf(*option);
    for (const std::string& name : NamesOf(*option)) {
      list.push_back(name);
      if (values.empty()) continue;
      choices += fmt::format("    ['{} {}']='{}'\n", called, name, fmt::join(values, " "));
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
