#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <iterator>

#include "cli/command.h"
#include "cli/output_file.h"
#include "cli/renderers.h"
#include "cli/selftest/table.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"

namespace dtr::cli {
namespace {

struct Options {
  bool stability = false;
  std::filesystem::path table;
};

/// Renderers that this program and this machine have; what is missing is told, never passed, and
/// added to `skipped`.
std::vector<selftest::NamedRenderer> Renderers(bool with_gl, Console& console,
                                               std::vector<std::string>& skipped) {
  std::vector<selftest::NamedRenderer> renderers;
  for (const std::string& name : RendererNames()) {
    if (name == "gl" && !with_gl) continue;
    const auto make = [name, &console] {
      RendererChoice choice;
      choice.name = name;
      return MakeRenderer(choice, console);
    };
    try {
      make();
    } catch (const Error& none) {
      skipped.push_back(fmt::format("SKIPPED: rendering, {}: {}", name, none.what()));
      console.Note(skipped.back());
      continue;
    }
    renderers.push_back({name, make});
  }
  return renderers;
}

std::vector<selftest::Case> AllCases(const std::vector<selftest::NamedRenderer>& renderers) {
  std::vector<selftest::Case> all;
  for (std::vector<selftest::Case>& stage :
       std::vector{selftest::BundleCases(), selftest::StereoCases(), selftest::DepthCodingCases(),
                   selftest::BlendingCases(), selftest::RenderingCases(renderers)}) {
    std::ranges::move(stage, std::back_inserter(all));
  }
  return all;
}

int RunSelftest(const Options& options, const Context& context) {
  Console& console = context.console;
  if (!options.table.empty()) RequireOutputFile(options.table, "-o", {".md"});
  if (!options.table.empty() && !options.stability) {
    throw UsageError("-o: expected --stability with it: the table holds every case");
  }
  std::vector<std::string> skipped;
  const std::vector<selftest::Row> rows =
      selftest::RunCases(AllCases(Renderers(options.stability, console, skipped)),
                         {.threads = context.common.threads}, !options.stability, console);
  console.ThrowIfInterrupted();
  for (const selftest::Row& row : rows) {
    for (const std::string& line : selftest::TextLines(row)) console.Say(line);
  }
  if (!options.table.empty()) {
    std::string page = selftest::ToMarkdown(rows);
    for (const std::string& line : skipped) page += "\n" + line + "\n";
    WriteFileAtomically(options.table, page);
  }
  context.EmitJson(selftest::ToJson(rows));
  const auto failed = std::ranges::count_if(rows, [](const auto& row) { return !row.passed(); });
  console.Say(fmt::format("{} of {} cases hold{}", static_cast<long>(rows.size()) - failed,
                          rows.size(),
                          skipped.empty() ? "" : fmt::format("; {}", fmt::join(skipped, "; "))));
  return failed == 0 ? kDone : kFailed;
}

}  // namespace

void AddSelftestCommand(CLI::App& app) {
  AddCommand(
      app, "selftest",
      "Stiff and extreme cases of every stage, each held against its bound; exit 1 when one "
      "fails",
      "dtr selftest --stability -o STABILITY.md", [](CLI::App& command) -> Action {
        auto options = std::make_shared<Options>();
        command.add_flag("--stability", options->stability,
                         "Every case, with every renderer (a minute); else the quick ones");
        command.add_option("-o", options->table, "The table as a page, too")->type_name("FILE.md");
        return [options](const Context& context) { return RunSelftest(*options, context); };
      });
}

}  // namespace dtr::cli
