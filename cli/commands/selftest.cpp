#include <algorithm>
#include <filesystem>

#include "cli/command.h"
#include "cli/output_file.h"
#include "cli/renderers.h"
#include "cli/selftest/table.h"
#include "dtr/base/error.h"
#include "dtr/base/files.h"

namespace dtr::cli {
namespace {

struct SelftestArguments {
  bool stability = false;
  std::filesystem::path table;
};

/// All renderers; one that this program or this machine lacks with the reason.
std::vector<selftest::NamedRenderer> Renderers(Console& console) {
  std::vector<selftest::NamedRenderer> renderers;
  const std::vector<std::string> known = RendererNames();
  for (const std::string name : {"gl", "simd", "cpu"}) {
    const auto make = [name, &console] {
      RendererChoice choice;
      choice.name = name;
      return MakeRenderer(choice, console);
    };
    renderers.push_back({name, make});
    if (name == "simd") renderers.back().methods = {RenderMethod::kDeferred};
    if (std::ranges::find(known, name) == known.end()) {
      renderers.back().missing = "this program was built without OpenGL";
      continue;
    }
    try {
      make();
    } catch (const Error& none) {
      renderers.back().missing = none.what();
    }
  }
  return renderers;
}

int RunSelftest(const SelftestArguments& options, const Context& context) {
  Console& console = context.console;
  if (!options.table.empty()) RequireOutputFile(options.table, "-o", {".md"});
  if (!options.table.empty() && !options.stability) {
    throw UsageError("-o: expected --stability with it: the table holds every case");
  }
  const std::vector<selftest::Row> rows =
      selftest::RunCases(selftest::AllCases(Renderers(console)), !options.stability, console);
  console.ThrowIfInterrupted();
  for (const selftest::Row& row : rows) {
    for (const std::string& line : selftest::TextLines(row)) console.Say(line);
  }
  const std::string summary = selftest::Summary(rows);
  const bool skipped =
      std::ranges::any_of(rows, [](const auto& row) { return !row.skipped.empty(); });
  if (!options.table.empty()) {
    WriteFileAtomically(options.table, selftest::ToMarkdown(rows));
    if (skipped) console.Note(options.table.string() + ": not the whole table: " + summary);
  }
  context.EmitJson(selftest::ToJson(rows));
  console.Say(summary);
  return std::ranges::any_of(rows, &selftest::Row::failed) ? kFailed : kDone;
}

}  // namespace

void AddSelftestCommand(CLI::App& app) {
  AddCommand(
      app, "selftest", "Ill-conditioned and extreme cases of every stage; exit 1 when one fails",
      "dtr selftest --stability -o stability.md", [](CLI::App& command) -> Action {
        auto options = std::make_shared<SelftestArguments>();
        command.add_flag("--stability", options->stability,
                         "Every case (a minute); else the quick ones");
        command.add_option("-o", options->table, "The table as a page, too")->type_name("FILE.md");
        return [options](const Context& context) { return RunSelftest(*options, context); };
      });
}

}  // namespace dtr::cli
