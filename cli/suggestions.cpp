#include "cli/suggestions.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <iterator>
#include <string_view>

#include "cli/shell_words.h"

namespace dtr::cli {
namespace {

// What needs a folder of pipeline/ that may be left out (cli/CMakeLists.txt).
struct LeftOut {
  std::string_view command, option;
  bool is_built;
};
constexpr LeftOut kMayBeLeftOut[] = {
    {"batch", "DTR_WITH_BATCH", DTR_WITH_BATCH},
    {"bench", "DTR_WITH_BENCH", DTR_WITH_BENCH},
    {"build --dynamic", "DTR_WITH_DYNAMIC", DTR_WITH_DYNAMIC},
    {"calibrate board", "DTR_WITH_BOARDS", DTR_WITH_BOARDS},
    {"calibrate rig", "DTR_WITH_BOARDS", DTR_WITH_BOARDS},
    {"calibrate scale", "DTR_WITH_METRES", DTR_WITH_METRES},
    {"export", "DTR_WITH_EXPORT", DTR_WITH_EXPORT},
    {"import", "DTR_WITH_IMPORT", DTR_WITH_IMPORT},
    {"prune", "DTR_WITH_PRUNE", DTR_WITH_PRUNE},
    {"validate CAMERAS", "DTR_WITH_IMPORT", DTR_WITH_IMPORT},
    {"validate CALIB", "DTR_WITH_BOARDS", DTR_WITH_BOARDS},
};

// Up to so many letters of a word may be wrong, more of a longer one.
size_t Tolerance(const std::string& typed) { return typed.size() < 4 ? 1 : 1 + typed.size() / 5; }

// Optimal string alignment: insertions, deletions, exchanges, and swaps of neighbours.
size_t Distance(const std::string& a, const std::string& b) {
  std::array<std::vector<size_t>, 3> rows;  // two before, one before, current
  for (auto& row : rows) row.resize(b.size() + 1);
  for (size_t j = 0; j <= b.size(); ++j) rows[2][j] = j;
  for (size_t i = 1; i <= a.size(); ++i) {
    std::rotate(rows.begin(), rows.begin() + 1, rows.end());
    rows[2][0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t exchange = rows[1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      rows[2][j] = std::min({rows[1][j] + 1, rows[2][j - 1] + 1, exchange});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) rows[2][j] = std::min(rows[2][j], rows[0][j - 2] + 1);
    }
  }
  return rows[2].back();
}

const CLI::App* CommandCalled(const CLI::App& app, const std::string& name) {
  const auto found = app.get_subcommands(
      [&](const CLI::App* one) { return !one->get_name().empty() && one->get_name() == name; });
  return found.empty() ? nullptr : found.front();
}

// Returns the command for a set or a folder in the place of one, "" for anything else.
std::string CommandFor(const std::string& word, const std::vector<std::string>& commands) {
  std::filesystem::path path(word);
  if (!path.has_filename()) path = path.parent_path();
  std::error_code ignored;
  if (!std::filesystem::is_directory(path, ignored)) return "";
  std::vector<std::string> line = {"dtr", "build", word, "-o", "NAME.dtr"};
  const bool is_set = path.extension() == ".dtr";
  if (is_set) {
    const bool has_window = std::find(commands.begin(), commands.end(), "view") != commands.end();
    line = {"dtr", has_window ? "view" : "info", word};
  }
  return fmt::format("expected a command, found the {} '{}'; {} {}", is_set ? "set" : "folder",
                     word, ShellLine(line), is_set ? "shows it" : "makes a set of its photos");
}

// The command that the first words call, and how many they are.
std::pair<const CLI::App*, size_t> Called(const CLI::App& app,
                                          const std::vector<std::string>& words) {
  const CLI::App* command = &app;
  size_t count = 0;
  while (count < words.size()) {
    const CLI::App* const below = CommandCalled(*command, words[count]);
    if (below == nullptr) break;
    command = below;
    ++count;
  }
  return {command, count};
}

// "--name" of all options, those of groups (commands without a name) included.
void AddOptionNames(const CLI::App& command, std::vector<std::string>& names) {
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  for (const CLI::App* group :
       command.get_subcommands([](const CLI::App* one) { return one->get_name().empty(); })) {
    AddOptionNames(*group, names);
  }
}

}  // namespace

std::string Nearest(const std::string& typed, const std::vector<std::string>& candidates) {
  std::vector<std::string> longer;
  std::copy_if(candidates.begin(), candidates.end(), std::back_inserter(longer),
               [&](const std::string& name) { return name.starts_with(typed); });
  if (longer.size() == 1) return longer.front();
  std::string nearest;
  size_t least = Tolerance(typed) + 1;
  for (const std::string& name : candidates) {
    const size_t distance = Distance(typed, name);
    if (distance > least) continue;
    nearest = distance == least ? "" : name;  // of two that are as near neither is meant surely
    least = distance;
  }
  return nearest;
}

std::string DidYouMean(const std::string& typed, const std::vector<std::string>& candidates) {
  const std::string meant = Nearest(typed, candidates);
  return meant.empty() ? "" : fmt::format(" (did you mean '{}'?)", meant);
}

std::string BuiltWithout(const std::string& command) {
  for (const LeftOut& one : kMayBeLeftOut) {
    if (one.is_built || one.command != command) continue;
    return fmt::format("this program was built without '{}' ({}=OFF)", command, one.option);
  }
  return "";
}

std::string NoCommandCalled(const std::vector<std::string>& words,
                            const std::vector<std::string>& candidates) {
  const std::string called = fmt::format("{}", fmt::join(words, " "));
  if (const std::string line = BuiltWithout(called); !line.empty()) return line;
  return fmt::format("no command is called '{}'{}", called,
                     words.empty() ? "" : DidYouMean(words.back(), candidates));
}

std::vector<std::string> CommandNames(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) {
    if (!command->get_name().empty()) names.push_back(command->get_name());
  }
  return names;
}

std::vector<std::string> WithHelpAsOption(std::vector<std::string> words) {
  if (words.empty() || words.front() != "help") return words;
  words.erase(words.begin());
  const bool all = std::erase(words, "--all") + std::erase(words, "--help-all") > 0;
  std::erase_if(words, [](const std::string& word) { return word.starts_with('-'); });
  words.emplace_back(all ? "--help-all" : "--help");
  return words;
}

std::string UnknownCommand(const CLI::App& app, const std::vector<std::string>& words) {
  const auto [command, count] = Called(app, words);
  const std::vector<std::string> names = CommandNames(*command);
  // What takes words of its own, as `batch` does those of a build, may be given any.
  if (names.empty() || command->get_allow_extras() || count == words.size() ||
      words[count].starts_with('-')) {
    return "";
  }
  if (count == 0 && BuiltWithout(words[0]).empty() && Nearest(words[0], names).empty()) {
    if (std::string line = CommandFor(words[0], names); !line.empty()) return line;
  }
  return NoCommandCalled({words.begin(), words.begin() + static_cast<long>(count) + 1}, names);
}

std::string MeantOption(const CLI::App& app, const std::vector<std::string>& words) {
  std::vector<std::string> names;
  const CLI::App& command = *Called(app, words).first;
  AddOptionNames(command, names);
  for (const std::string& word : words) {
    if (word == "--") break;
    const std::string name = word.substr(0, word.find('='));
    if (!name.starts_with("--") || std::find(names.begin(), names.end(), name) != names.end()) {
      continue;
    }
    if (const std::string line = BuiltWithout(command.get_name() + " " + name); !line.empty()) {
      return fmt::format(" ({})", line);
    }
    const std::string meant = Nearest(name, names);
    return meant.empty() ? "" : fmt::format(" ({}: did you mean {}?)", name, meant);
  }
  return "";
}

}  // namespace dtr::cli
