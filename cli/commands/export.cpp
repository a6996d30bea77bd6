#include "pipeline/export.h"

#include <fmt/format.h>

#include "cli/command.h"
#include "cli/output_file.h"
#include "dtr/base/files.h"

namespace dtr::cli {
namespace {

int RunExport(pipeline::ExportRequest request, const Context& context) {
  request.output = WithoutTrailingSlash(request.output);
  if (!std::filesystem::exists(request.output)) RequireFolderOf(request.output, "-o");
  request.threads = context.common.threads;
  const pipeline::ExportReport report = pipeline::ExportColmap(request, context.console);
  context.console.Say(fmt::format(
      "{}: {} images, {} points{}", request.output.string(), report.images, report.points,
      report.points_from_depth ? " from depth, as the set has no sparse ones" : ""));
  context.EmitJson(fmt::format("{{\"images\": {}, \"points\": {}, \"points_from\": \"{}\"}}",
                               report.images, report.points,
                               report.points_from_depth ? "depth" : "sparse"));
  return kDone;
}

}  // namespace

void AddExportCommand(CLI::App& app) {
  AddCommand(app, "export",
             "Write a set's cameras, points and images for another program: sparse/0 and images",
             "dtr export scene.dtr --format colmap -o colmap/", [](CLI::App& command) -> Action {
               auto options = std::make_shared<pipeline::ExportRequest>();
               command.add_option("SET", options->set, "The set")->required();
               auto format = std::make_shared<std::string>();
               command.add_option("--format", *format, "Format [colmap]")
                   ->check(CLI::IsMember({"colmap"}))
                   ->type_name("colmap");
               command.add_flag("--text", options->text, "COLMAP's text files instead of binary");
               command.add_option("-o,--output", options->output, "Folder to write")
                   ->required()
                   ->type_name("DIR");
               return [options, format](const Context& context) {
                 return RunExport(*options, context);
               };
             });
}

}  // namespace dtr::cli
