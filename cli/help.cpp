#include "cli/help.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <sstream>
#include <string_view>
#include <vector>

#include "cli/option_text.h"

namespace dtr::cli {
namespace {

constexpr size_t kColumns = 100, kNameColumns = 28;
constexpr long kScreenLines = 40;
constexpr size_t kMaxOthers = 2;    // options that an option needs or excludes
constexpr size_t kMaxChoices = 40;  // characters of choices that stand in place of a value

/// Options that few runs need.
struct Group {
  std::string_view heading, commands, options;  // words; no commands: of all
};
constexpr Group kGroups[] = {
    {"Dynamic sets", "build", "--from --to --fps --temporal --clocks --video"},
    {"Photos and video frames", "build",
     "--every --motion --max-frames --synchronised --panoramas --holdout-strict "
     "--keep-duplicates"},
    {"Structure from motion", "build photos",
     "--format --sfm --feature-size --features --matching --lens-model --no-refine --refine "
     "--gps-sigma"},
    {"Depth", "build stereo",
     "--time-budget --workspace --prior-unit --prior-kind --depth-error --completion "
     "--neighbours --pass-neighbours --iterations --passes --normals"},
    {"Shared and interrupted builds", "build", "--force-stage --stage --part"},
    {"Tables and single settings", "bench",
     "--repeats --cameras --like --point --max-size --feature-size --budget-ms --max-loss-db"},
    {"Recording and automation", "view",
     "--laps --largest-divisor --frames --screenshot --no-panel --state-file --cameras"},
    {"Rendering", "",
     "--measured-only --shader-dir --gpu-memory --primitive --blend --resolution --point-size "
     "--exponent --falloff --blend-k --max-angle --delta --depth-break --mesh-tolerance "
     "--absolute-delta --absolute-depth-break --blend-linear --blend-srgb --fill-holes "
     "--smooth-edges"},
    {"Every command", "", "--help --help-all --json --threads --seed --trace"},
};

bool HasWord(std::string_view words, const std::string& word) {
  std::istringstream stream{std::string(words)};
  for (std::string one; stream >> one;) {
    if (one == word) return true;
  }
  return false;
}

/// Headings of the list of commands, in their order.
struct CommandGroup {
  const char* heading;
  std::string_view commands;
};
constexpr CommandGroup kCommandGroups[] = {
    {"Make a set", "build batch capture calibrate stereo import join"},
    {"Look at it", "view render info"},
    {"Validate and measure it", "validate evaluate inspect advise"},
    {"Make it smaller, use it elsewhere", "prune export"},
    {"For developers", "bench selftest dataset"},
    {"About dtr", "help manual completion"}};

bool HasCommands(const CLI::App& app) {
  return app.get_subcommands({}).size() > AlternativesOf(app).size();
}

/// The group of an option; null where it is among the first.
const Group* GroupOf(const CLI::App& command, const CLI::Option& option) {
  if (HasCommands(command)) return nullptr;
  const std::vector<std::string> names = NamesOf(option);
  for (const Group& group : kGroups) {
    if (!group.commands.empty() && !HasWord(group.commands, command.get_name())) continue;
    for (const std::string& name : names) {
      if (HasWord(group.options, name)) return &group;
    }
  }
  return nullptr;
}

/// `text` from column kNameColumns on, behind `names`, which have a line to themselves where they
/// reach so far.
std::string Entry(const std::string& names, const std::string& text) {
  std::string out, line = "  " + names;
  const auto end_line = [&out, &line] {
    while (line.ends_with(' ')) line.pop_back();
    out += line + "\n";
    line.clear();
  };
  if (line.size() + 2 > kNameColumns) end_line();
  line.resize(kNameColumns, ' ');
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (line.size() > kNameColumns && line.size() + word.size() > kColumns) {
      end_line();
      line.assign(kNameColumns, ' ');
    }
    line += word + " ";
  }
  end_line();
  return out;
}

std::string ValueOf(const CLI::Option& option) {
  const std::string choices = fmt::format("{}", fmt::join(ChoicesOf(option), "|"));
  const std::string type = TypeOf(option);
  if (type != "TEXT" || choices.empty()) return type;
  return choices.size() <= kMaxChoices ? choices : "NAME";
}

/// " (with --gps)": options that `text` does not name; "" of many.
std::string Others(const char* words, const std::set<CLI::Option*>& options,
                   const std::string& text) {
  std::vector<std::string> names;
  for (const CLI::Option* option : options) {
    const std::string name = NamesOf(*option).back();
    if (text.find(name) == std::string::npos) names.push_back(name);
  }
  if (names.empty() || names.size() > kMaxOthers) return "";
  std::sort(names.begin(), names.end());  // the set is in order of addresses
  return fmt::format(" ({} {})", words, fmt::join(names, ", "));
}

std::string EntryOf(const CLI::Option& option, bool positional) {
  std::string names =
      positional ? option.get_name(true) : fmt::format("{}", fmt::join(NamesOf(option), ", "));
  std::string text = option.get_description();
  if (!positional && option.get_items_expected_max() > 0) {
    const std::string value = ValueOf(option);
    names += " " + value;
    if (value == "NAME" && !ChoicesOf(option).empty()) {
      text += fmt::format(": {}", fmt::join(ChoicesOf(option), ", "));
    }
  }
  if (const std::string range = RangeOf(option); !range.empty()) text += " (" + range + ")";
  text +=
      Others("with", option.get_needs(), text) + Others("not with", option.get_excludes(), text);
  if (option.get_required() && !positional) text += " (required)";
  return Entry(names, text);
}

std::string UsageOf(const CLI::App& command, const std::string& name) {
  std::string usage = "Usage: " + name + " [OPTIONS]";
  for (const CLI::Option* option : command.get_options([](const CLI::Option* option) {
         return option->get_positional() && !option->get_group().empty();
       })) {
    const bool many = option->get_items_expected_max() > 1;
    const std::string shown = option->get_name(true) + (many ? "..." : "");
    usage += option->get_required() ? " " + shown : " [" + shown + "]";
  }
  if (HasCommands(command))
    usage += command.get_require_subcommand_min() > 0 ? " COMMAND" : " [COMMAND]";
  return usage + "\n";
}

std::string PositionalsOf(const CLI::App& command) {
  std::string out;
  for (const CLI::Option* option : command.get_options([](const CLI::Option* option) {
         return !option->nonpositional() && !option->get_group().empty();
       })) {
    out += EntryOf(*option, true);
  }
  return out.empty() ? out : "\n" + out;
}

/// Commands below, by their groups.
std::string CommandsOf(const CLI::App& app) {
  std::vector<const CLI::App*> left = app.get_subcommands([](const CLI::App* below) {
    return !below->get_name().empty() && !below->get_group().empty();
  });
  std::string out;
  if (app.get_parent() == nullptr) {
    for (const CommandGroup& group : kCommandGroups) {
      std::string entries;
      std::erase_if(left, [&](const CLI::App* command) {
        if (!HasWord(group.commands, command->get_name())) return false;
        entries += Entry(command->get_name(), command->get_description());
        return true;
      });
      if (!entries.empty()) out += fmt::format("\n{}:\n{}", group.heading, entries);
    }
  }
  if (!left.empty()) out += "\nCommands:\n";
  for (const CLI::App* command : left) {
    out += Entry(command->get_name(), command->get_description());
  }
  return out;
}

std::string OptionsIn(const CLI::App& command, const Group* group) {
  std::string out;
  for (const CLI::Option* option : OwnOptionsOf(command)) {
    if (HasCommands(command) && option == command.get_help_all_ptr()) continue;  // nothing more
    if (GroupOf(command, *option) == group) out += EntryOf(*option, false);
  }
  return out;
}

/// Groups that the command has options of.
std::vector<const Group*> GroupsOf(const CLI::App& command) {
  std::vector<const Group*> groups;
  for (const Group& group : kGroups) {
    const auto options = OwnOptionsOf(command);
    if (std::any_of(options.begin(), options.end(), [&](const CLI::Option* option) {
          return GroupOf(command, *option) == &group;
        })) {
      groups.push_back(&group);
    }
  }
  return groups;
}

std::string FirstOptions(const CLI::App& command) {
  std::string out = OptionsIn(command, nullptr);
  if (!out.empty()) out = "\nOptions:\n" + out;
  for (const CLI::App* group : AlternativesOf(command)) {
    out += fmt::format("\n{}:\n{}", group->get_description(), OptionsIn(*group, nullptr));
  }
  return out;
}

std::string AllOptions(const CLI::App& command) {
  std::string out = FirstOptions(command);
  for (const Group* group : GroupsOf(command)) {
    out += fmt::format("\n{}:\n{}", group->heading, OptionsIn(command, group));
  }
  return out;
}

std::string LinesOfGroups(const CLI::App& command, const std::string& name) {
  std::string headings;
  for (const Group* group : GroupsOf(command)) {
    headings += (headings.empty() ? "" : ", ") + std::string(group->heading);
  }
  return "\nMore options:\n" + Entry(name + " --help-all", headings);
}

}  // namespace

std::string HelpFormatter::make_help(const CLI::App* command, std::string name,
                                     CLI::AppFormatMode mode) const {
  const std::string begin =
      command->get_description() + "\n" + UsageOf(*command, name) + PositionalsOf(*command);
  std::string end = CommandsOf(*command);
  if (!command->get_footer().empty()) end += "\n" + command->get_footer() + "\n";
  const std::string whole = begin + AllOptions(*command) + end;
  if (mode == CLI::AppFormatMode::All || GroupsOf(*command).empty() ||
      std::count(whole.begin(), whole.end(), '\n') <= kScreenLines) {
    return whole;
  }
  return begin + FirstOptions(*command) + LinesOfGroups(*command, name) + end;
}

}  // namespace dtr::cli
