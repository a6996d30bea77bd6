#include "cli/output_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <map>

#include "dtr/base/error.h"
#include "dtr/base/files.h"
#include "dtr/base/lower_case.h"

namespace dtr::cli {
namespace fs = std::filesystem;

void RequireFolderOf(const fs::path& file, const std::string& option) {
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  std::error_code ignored;
  if (fs::is_directory(folder, ignored)) {
    if (access(folder.c_str(), W_OK) == 0) return;
    throw Error(
        fmt::format("{} {}: expected a folder that can be written to, found {}, which cannot: {}",
                    option, file.string(), folder.string(), std::strerror(errno)));
  }
  throw UsageError(fmt::format(
      "{} {}: expected an existing folder to write into, found {} at {}", option, file.string(),
      fs::exists(folder, ignored) ? "a file" : "nothing", folder.string()));
}

void RequireOutputFile(const fs::path& file, const std::string& option,
                       const std::vector<std::string>& extensions) {
  const std::string extension = LowerExtension(file);
  if (std::find(extensions.begin(), extensions.end(), extension) == extensions.end()) {
    throw UsageError(fmt::format("{} {}: expected a name ending in {}, found '{}'", option,
                                 file.string(), fmt::join(extensions, " or "), extension));
  }
  RequireFolderOf(file, option);
  std::error_code ignored;
  if (fs::is_directory(file, ignored)) {
    throw UsageError(
        fmt::format("{} {}: expected a file name, found a folder", option, file.string()));
  }
}

namespace {

// Options whose value is a path that is written. --images of dtr evaluate is one, that of others an
// input.
constexpr std::array kOutputOptions{"--json",         "--output",     "-o",       "--depth-out",
                                    "--coverage-out", "--screenshot", "--report", "--normals",
                                    "--state-file",   "--pictures",   "--trace"};

constexpr char kSetFile[] = "set.json", kPageFile[] = "index.html";

struct Output {
  std::string option;  // as the user knows it
  fs::path path;
  bool is_set = false;
};

struct Paths {
  std::vector<Output> outputs;
  std::vector<fs::path> inputs;
};

bool IsOutput(const CLI::Option& option) {
  return std::any_of(kOutputOptions.begin(), kOutputOptions.end(),
                     [&](const char* name) { return option.check_name(name); });
}

void CollectPaths(const CLI::App& command, Paths& paths) {
  for (const CLI::Option* option : command.get_options()) {
    const bool is_output = IsOutput(*option);
    for (const std::string& value : option->results()) {
      if (is_output && value.empty()) {
        throw UsageError(option->get_name() + ": expected a name, found an empty one");
      }
      if (is_output && (value != "-" || !option->check_name("--json"))) {
        paths.outputs.push_back(
            {option->get_name(), value, option->get_type_name().starts_with("SET")});
      }
      std::error_code ignored;
      if (!is_output && fs::exists(value, ignored)) paths.inputs.push_back(value);
    }
  }
  for (const CLI::App* group :
       command.get_subcommands([](const CLI::App* one) { return one->get_name().empty(); })) {
    CollectPaths(*group, paths);
  }
}

fs::path PlaceOf(const fs::path& path) {
  return fs::weakly_canonical(ResolveLinks(WithoutTrailingSlash(path)));
}

bool LiesIn(const fs::path& inside, const fs::path& folder) {
  return std::mismatch(folder.begin(), folder.end(), inside.begin(), inside.end()).first ==
         folder.end();
}

// A set, or one that is being written. A web page that is a folder has a set.json, too.
bool IsSet(const fs::path& folder) {
  std::error_code ignored;
  const bool is_page = fs::is_regular_file(folder / kPageFile, ignored);
  return (fs::is_regular_file(folder / kSetFile, ignored) && !is_page) ||
         fs::is_regular_file(folder / "work" / "fingerprint.json", ignored);
}

void RejectPlaceInSet(const Output& output, const fs::path& place) {
  fs::path folder = output.is_set ? place.parent_path() : place;
  for (; folder.has_relative_path(); folder = folder.parent_path()) {
    if (!IsSet(folder)) continue;
    throw UsageError(
        fmt::format("{} {}: cannot be written into the set {}; choose a place outside it",
                    output.option, output.path.string(), folder.string()));
  }
}

void RejectInput(const Output& output, const fs::path& place, const std::vector<fs::path>& inputs) {
  for (const fs::path& input : inputs) {
    if (!LiesIn(place, PlaceOf(input))) continue;
    throw UsageError(fmt::format("{} {}: cannot replace an input; choose another name",
                                 output.option, output.path.string()));
  }
}

}  // namespace

void RequireOutputs(const CLI::App& command, bool force) {
  Paths paths;
  CollectPaths(command, paths);
  // The result for programs is the one that gives way.
  std::stable_partition(paths.outputs.begin(), paths.outputs.end(),
                        [](const Output& output) { return output.option != "--json"; });
  std::map<fs::path, std::string> named;
  for (const Output& output : paths.outputs) {
    if (output.option == "--json" || output.option == "--trace") {
      RequireFolderOf(output.path, output.option);
      if (fs::is_directory(output.path)) {
        throw UsageError(output.option + " " + output.path.string() +
                         ": expected a file name, found a folder");
      }
    }
    if (IsWrittenInPlace(output.path)) continue;
    const fs::path place = PlaceOf(output.path);
    const auto [other, is_new] = named.emplace(place, output.option);
    if (!is_new) {
      throw UsageError(fmt::format("{} {}: expected another file than {}, found it", output.option,
                                   output.path.string(), other->second));
    }
    RejectPlaceInSet(output, place);
    // Whoever writes several files into a folder says what is wrong with a file in its place.
    if (output.option == "--images" || output.option == "--normals") continue;
    std::error_code ignored;
    const bool has_content =
        fs::is_regular_file(place, ignored) && fs::file_size(place, ignored) > 0;
    if (!has_content || output.is_set) continue;
    RejectInput(output, place, paths.inputs);
    if (force) continue;
    throw UsageError(fmt::format("{} {}: exists already; choose another name or give --force",
                                 output.option, output.path.string()));
  }
}

}  // namespace dtr::cli
